// SPDX-License-Identifier: MIT
#pragma once

// The arithmetic of each block: how a coefficient acts on a value, how two of them compose, what
// the adjoint is. Everything else in this folder is written once on top of this.
//
// A value is kReals consecutive floats, in kParts parts that have a diagonal entry each. Periodic
// blocks have complex parts (two floats) whose norms the penalty holds near one.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <emmintrin.h>

#include "engine/solve/system.h"

namespace rattan {

// std::complex multiplication checks for NaN; these do not.
inline Complex multiply(Complex a, Complex b) {
  return {a.real() * b.real() - a.imag() * b.imag(), a.real() * b.imag() + a.imag() * b.real()};
}

/// c / |c|, or 1 for c = 0.
inline Complex unit(Complex c) {
  const double re = c.real();
  const double im = c.imag();
  const double n = std::sqrt(re * re + im * im);
  return n > 0.0 ? Complex(static_cast<float>(re / n), static_cast<float>(im / n))
                 : Complex(1.0F, 0.0F);
}

template <class Block>
struct BlockOps;

template <std::size_t Reals>
struct ScalarOps {
  using Coefficient = RealBlock::Coefficient;
  static constexpr std::size_t kReals = Reals;
  static constexpr std::size_t kParts = 1;
  static constexpr std::size_t kTurns = 1;
  static constexpr std::size_t kCoefficientReals = 1;
  static constexpr bool kPeriodic = false;
  using Sum = std::array<double, 1>;

  /// out += C x
  template <class S>
  static void apply_add(const Coefficient& c, const S* x, S* out) {
    for (std::size_t k = 0; k < Reals; ++k) {
      out[k] += static_cast<S>(c.w) * x[k];
    }
  }
  static Coefficient identity() { return {1.0F}; }
  static Coefficient compose(const Coefficient& p, const Coefficient& q) { return {p.w * q.w}; }
  static Coefficient adjoint(const Coefficient& c) { return c; }
  static Coefficient unit_of(const Coefficient&) { return identity(); }
  static float magnitude2(const Coefficient& c) { return c.w * c.w; }
  static std::uint32_t turn(const Coefficient&) { return 0; }
  static void add(const Coefficient& c, Sum& sum) { sum[0] += c.w; }
  static Coefficient from_sum(const Sum& sum, std::uint32_t) {
    return {static_cast<float>(sum[0])};
  }
  /// Moves a self-edge without turn into the diagonal.
  static void fold(const Sum& sum, std::array<double, kParts>& diagonal) { diagonal[0] -= sum[0]; }
  static double norm(const Sum& sum) { return std::abs(sum[0]); }
};

template <>
struct BlockOps<RealBlock> : ScalarOps<1> {};
template <>
struct BlockOps<Real3Block> : ScalarOps<3> {};

template <>
struct BlockOps<ComplexBlock> {
  using Coefficient = ComplexBlock::Coefficient;
  static constexpr std::size_t kReals = 2;
  static constexpr std::size_t kParts = 1;
  static constexpr std::size_t kTurns = 1;
  static constexpr std::size_t kCoefficientReals = 2;
  static constexpr bool kPeriodic = true;
  using Sum = std::array<double, 2>;

  template <class S>
  static void apply_add(const Coefficient& c, const S* x, S* out) {
    const S re = c.c.real();
    const S im = c.c.imag();
    out[0] += re * x[0] - im * x[1];
    out[1] += re * x[1] + im * x[0];
  }
  static Coefficient identity() { return {Complex(1.0F, 0.0F)}; }
  static Coefficient compose(const Coefficient& p, const Coefficient& q) {
    return {multiply(p.c, q.c)};
  }
  static Coefficient adjoint(const Coefficient& c) { return {std::conj(c.c)}; }
  static Coefficient unit_of(const Coefficient& c) { return {unit(c.c)}; }
  static float magnitude2(const Coefficient& c) {
    return c.c.real() * c.c.real() + c.c.imag() * c.c.imag();
  }
  static std::uint32_t turn(const Coefficient&) { return 0; }
  static void add(const Coefficient& c, Sum& sum) {
    sum[0] += c.c.real();
    sum[1] += c.c.imag();
  }
  static Coefficient from_sum(const Sum& sum, std::uint32_t) {
    return {Complex(static_cast<float>(sum[0]), static_cast<float>(sum[1]))};
  }
  static void fold(const Sum& sum, std::array<double, kParts>& diagonal) { diagonal[0] -= sum[0]; }
  static double norm(const Sum& sum) { return std::sqrt(sum[0] * sum[0] + sum[1] * sum[1]); }
};

// Both complex parts of a pair side by side in one register: (u_re, u_im, v_re, v_im).
namespace pair_lanes {

inline constexpr std::uint32_t kMinus = 0x80000000U;
alignas(16) inline constexpr std::uint32_t kTurnSigns[4][4] = {
    {0, 0, 0, 0}, {0, 0, 0, kMinus}, {0, kMinus, 0, kMinus}, {0, kMinus, 0, 0}};
alignas(16) inline constexpr std::uint32_t kRealSigns[4] = {kMinus, 0, kMinus, 0};
alignas(16) inline constexpr std::uint32_t kRealSign[4] = {kMinus, 0, 0, 0};
alignas(16) inline constexpr std::uint32_t kImaginarySigns[4] = {0, kMinus, 0, kMinus};

inline __m128 bits(const std::uint32_t* p) {
  return _mm_castsi128_ps(_mm_load_si128(reinterpret_cast<const __m128i*>(p)));
}
inline __m128 swap_in_pairs(__m128 v) {
  return _mm_shuffle_ps(v, v, _MM_SHUFFLE(2, 3, 0, 1));
}
/// The pair at p after r quarter turns. Without branches: turns are as good as random.
inline __m128 turned(const float* p, std::uint32_t r) {
  const std::uint32_t odd = (r & 1U) * 2U;
  __m128 v = _mm_loadl_pi(_mm_setzero_ps(), reinterpret_cast<const __m64*>(p + odd));
  v = _mm_loadh_pi(v, reinterpret_cast<const __m64*>(p + (2U - odd)));
  return _mm_xor_ps(v, bits(kTurnSigns[r & 3U]));
}
/// Products of the complex parts.
inline __m128 multiply(__m128 p, __m128 q) {
  const __m128 re = _mm_shuffle_ps(p, p, _MM_SHUFFLE(2, 2, 0, 0));
  const __m128 im = _mm_shuffle_ps(p, p, _MM_SHUFFLE(3, 3, 1, 1));
  const __m128 crossed = _mm_xor_ps(_mm_mul_ps(im, swap_in_pairs(q)), bits(kRealSigns));
  return _mm_add_ps(_mm_mul_ps(re, q), crossed);
}
/// A coefficient stored at once, so that it can be loaded at once right away.
inline PairBlock::Coefficient coefficient(__m128 v, std::uint32_t r) {
  PairBlock::Coefficient c;
  _mm_storeu_ps(reinterpret_cast<float*>(&c), v);
  c.r = r;
  return c;
}
inline __m128 load(const PairBlock::Coefficient& c) {
  return _mm_loadu_ps(reinterpret_cast<const float*>(&c));
}

}  // namespace pair_lanes

template <>
struct BlockOps<PairBlock> {
  using Coefficient = PairBlock::Coefficient;
  static constexpr std::size_t kReals = 4;
  static constexpr std::size_t kParts = 2;
  static constexpr std::size_t kTurns = 4;
  static constexpr std::size_t kCoefficientReals = 4;
  static constexpr bool kPeriodic = true;
  using Sum = std::array<double, 4>;

  /// -1 where a turn conjugates its first (second) result, else 1.
  static float sign_u(std::uint32_t r) { return 1.0F - static_cast<float>(r & 2U); }
  static float sign_v(std::uint32_t r) { return 1.0F - static_cast<float>((r + 1U) & 2U); }

  template <class S>
  static void apply_add(const Coefficient& c, const S* x, S* out) {
    const std::uint32_t swap = (c.r & 1U) * 2U;
    const S conj_u = sign_u(c.r);
    const S conj_v = sign_v(c.r);
    const S u_re = x[swap];
    const S u_im = conj_u * x[swap + 1];
    const S v_re = x[2 - swap];
    const S v_im = conj_v * x[3 - swap];
    const S a_re = c.a.real();
    const S a_im = c.a.imag();
    const S b_re = c.b.real();
    const S b_im = c.b.imag();
    out[0] += a_re * u_re - a_im * u_im;
    out[1] += a_re * u_im + a_im * u_re;
    out[2] += b_re * v_re - b_im * v_im;
    out[3] += b_re * v_im + b_im * v_re;
  }
  static Coefficient identity() {
    return pair_lanes::coefficient(_mm_set_ps(0.0F, 1.0F, 0.0F, 1.0F), 0);
  }
  /// p after q: turn_p(a_q U'', b_q V'') turns the factors as it turns the values.
  static Coefficient compose(const Coefficient& p, const Coefficient& q) {
    const __m128 v = pair_lanes::turned(reinterpret_cast<const float*>(&q), p.r);
    return pair_lanes::coefficient(pair_lanes::multiply(pair_lanes::load(p), v), (p.r + q.r) & 3U);
  }
  /// The inverse turn of the conjugates: (0; conj a, conj b), (3; b, conj a), (2; a, b), (1; conj
  /// b, a).
  static Coefficient adjoint(const Coefficient& c) {
    const std::uint32_t back = (4U - c.r) & 3U;
    const __m128 v = pair_lanes::turned(reinterpret_cast<const float*>(&c), back);
    return pair_lanes::coefficient(_mm_xor_ps(v, pair_lanes::bits(pair_lanes::kImaginarySigns)),
                                   back);
  }
  /// unit() of both parts.
  static Coefficient unit_of(const Coefficient& c) {
    const __m128 v = pair_lanes::load(c);
    const __m128d re = _mm_cvtps_pd(_mm_shuffle_ps(v, v, _MM_SHUFFLE(3, 1, 2, 0)));
    const __m128d im = _mm_cvtps_pd(_mm_shuffle_ps(v, v, _MM_SHUFFLE(2, 0, 3, 1)));
    const __m128d n = _mm_sqrt_pd(_mm_add_pd(_mm_mul_pd(re, re), _mm_mul_pd(im, im)));
    const __m128d some = _mm_cmpgt_pd(n, _mm_setzero_pd());
    const __m128d unit_re =
        _mm_or_pd(_mm_and_pd(some, _mm_div_pd(re, n)), _mm_andnot_pd(some, _mm_set1_pd(1.0)));
    const __m128d unit_im = _mm_and_pd(some, _mm_div_pd(im, n));
    return pair_lanes::coefficient(_mm_unpacklo_ps(_mm_cvtpd_ps(unit_re), _mm_cvtpd_ps(unit_im)),
                                   c.r & 3U);
  }
  static float magnitude2(const Coefficient& c) {
    return c.a.real() * c.a.real() + c.a.imag() * c.a.imag() + c.b.real() * c.b.real() +
           c.b.imag() * c.b.imag();
  }
  static std::uint32_t turn(const Coefficient& c) { return c.r & 3U; }
  static void add(const Coefficient& c, Sum& sum) {
    const __m128 v = pair_lanes::load(c);
    double* const s = sum.data();
    _mm_storeu_pd(s, _mm_add_pd(_mm_loadu_pd(s), _mm_cvtps_pd(v)));
    _mm_storeu_pd(s + 2, _mm_add_pd(_mm_loadu_pd(s + 2), _mm_cvtps_pd(_mm_movehl_ps(v, v))));
  }
  static Coefficient from_sum(const Sum& sum, std::uint32_t turn) {
    return {Complex(static_cast<float>(sum[0]), static_cast<float>(sum[1])),
            Complex(static_cast<float>(sum[2]), static_cast<float>(sum[3])), turn};
  }
  static void fold(const Sum& sum, std::array<double, kParts>& diagonal) {
    diagonal[0] -= sum[0];
    diagonal[1] -= sum[2];
  }
  static double norm(const Sum& sum) {
    return std::sqrt(
        std::max(sum[0] * sum[0] + sum[1] * sum[1], sum[2] * sum[2] + sum[3] * sum[3]));
  }
};

template <class Block>
using Value = typename Block::Value;
template <class Block>
using Coefficient = typename Block::Coefficient;

template <class Block>
const float* reals(const Value<Block>& x) {
  static_assert(sizeof(Value<Block>) == BlockOps<Block>::kReals * sizeof(float));
  return reinterpret_cast<const float*>(&x);
}
template <class Block>
float* reals(Value<Block>& x) {
  return reinterpret_cast<float*>(&x);
}

template <class Block>
Value<Block> zero_value() {
  Value<Block> v;
  for (std::size_t k = 0; k < BlockOps<Block>::kReals; ++k) {
    reals<Block>(v)[k] = 0.0F;
  }
  return v;
}

template <class Block>
Value<Block> apply(const Coefficient<Block>& c, const Value<Block>& x) {
  Value<Block> out = zero_value<Block>();
  BlockOps<Block>::apply_add(c, reals<Block>(x), reals<Block>(out));
  return out;
}

/// x += s y
template <class Block>
void add_scaled(Value<Block>& x, float s, const Value<Block>& y) {
  for (std::size_t k = 0; k < BlockOps<Block>::kReals; ++k) {
    reals<Block>(x)[k] += s * reals<Block>(y)[k];
  }
}

/// <x, y> as real vectors.
template <class Block>
double dot(const Value<Block>& x, const Value<Block>& y) {
  double sum = 0.0;
  for (std::size_t k = 0; k < BlockOps<Block>::kReals; ++k) {
    sum += static_cast<double>(reals<Block>(x)[k]) * reals<Block>(y)[k];
  }
  return sum;
}

/// Complex parts to unit length (1 for a zero); nothing for real blocks.
template <class Block>
void normalise(Value<Block>& x) {
  if constexpr (BlockOps<Block>::kPeriodic) {
    for (std::size_t p = 0; p < BlockOps<Block>::kParts; ++p) {
      const Complex u = unit(Complex(reals<Block>(x)[2 * p], reals<Block>(x)[2 * p + 1]));
      reals<Block>(x)[2 * p] = u.real();
      reals<Block>(x)[2 * p + 1] = u.imag();
    }
  }
}

}  // namespace rattan
