// SPDX-License-Identifier: MIT
//
// The hot loop of the program: it visits every half-edge of the scan a dozen times. Plain SSE2.

#include "engine/solve/sweeps.h"

#include <algorithm>
#include <cmath>
#include <emmintrin.h>

namespace rattan {

namespace {

// A node whose neighbours cancel exactly keeps its direction.
constexpr float kKeep = 1e-15F;
constexpr float kTiny = 1e-30F;
// Norms stay above this, so that a region that collapses still has directions to recover from (and
// no denormal numbers).
constexpr float kLeastNorm = 1e-3F;

// Real blocks; the others have their own below.
template <class Block, SweepMode Mode>
struct Node {
  static_assert(Mode == SweepMode::kLinear);
  using Ops = BlockOps<Block>;
  static void update(const NodeTerm<Block>& term, const std::uint32_t* neighbor,
                     const Coefficient<Block>* c, std::uint32_t degree, Value<Block>* x,
                     Value<Block>& xi, float omega) {
    std::array<float, Ops::kReals> b;
    for (std::size_t k = 0; k < Ops::kReals; ++k) {
      b[k] = reals<Block>(term.rhs)[k];
    }
    for (std::uint32_t e = 0; e < degree; ++e) {
      Ops::apply_add(c[e], reals<Block>(x[neighbor[e]]), b.data());
    }
    float* const xr = reals<Block>(xi);
    for (std::size_t k = 0; k < Ops::kReals; ++k) {
      const float d = term.diagonal[part_of<Block>(k)] + term.eps;
      const float target = d > 0.0F ? b[k] / d : xr[k];
      xr[k] += omega * (target - xr[k]);
    }
  }
};

using pair_lanes::bits;
using pair_lanes::swap_in_pairs;

// |u|^2 in the first two lanes, |v|^2 in the others.
inline __m128 part_norms2(__m128 v) {
  const __m128 squares = _mm_mul_ps(v, v);
  return _mm_add_ps(squares, swap_in_pairs(squares));
}

inline __m128 pair_row(const std::uint32_t* neighbor, const PairBlock::Coefficient* c,
                       std::uint32_t degree, const PairValue* x) {
  __m128 straight = _mm_setzero_ps();
  __m128 crossed = _mm_setzero_ps();
  for (std::uint32_t e = 0; e < degree; ++e) {
    const float* p = reinterpret_cast<const float*>(x + neighbor[e]);
    const __m128 v = pair_lanes::turned(p, c[e].r);
    const __m128 ab = _mm_loadu_ps(reinterpret_cast<const float*>(c + e));
    straight = _mm_add_ps(straight, _mm_mul_ps(_mm_shuffle_ps(ab, ab, _MM_SHUFFLE(2, 2, 0, 0)), v));
    crossed = _mm_add_ps(
        crossed, _mm_mul_ps(_mm_shuffle_ps(ab, ab, _MM_SHUFFLE(3, 3, 1, 1)), swap_in_pairs(v)));
  }
  return _mm_add_ps(straight, _mm_xor_ps(crossed, bits(pair_lanes::kRealSigns)));
}

// The new value of a node with the complex parts `old`, whose row and right-hand side come to
// `row`; `d` is their diagonal.
template <SweepMode Mode>
inline __m128 settled(__m128 row, __m128 old, __m128 d, float eps, float omega) {
  const __m128 one = _mm_set1_ps(1.0F);
  const __m128 tiny = _mm_set1_ps(kTiny);
  __m128 target;
  if constexpr (Mode == SweepMode::kLinear) {
    const __m128 whole = _mm_add_ps(d, _mm_set1_ps(eps));
    const __m128 usable = _mm_cmpgt_ps(whole, _mm_setzero_ps());
    const __m128 quotient = _mm_div_ps(row, _mm_max_ps(whole, tiny));
    target = _mm_or_ps(_mm_and_ps(usable, quotient), _mm_andnot_ps(usable, old));
  } else {
    const __m128 b = _mm_add_ps(row, _mm_mul_ps(_mm_set1_ps(kKeep), old));
    const __m128 norm = _mm_sqrt_ps(part_norms2(b));
    const __m128 inverse = _mm_div_ps(one, _mm_max_ps(norm, tiny));
    if constexpr (Mode == SweepMode::kUnit) {
      return _mm_mul_ps(b, inverse);
    } else if constexpr (Mode == SweepMode::kHold) {
      target = _mm_mul_ps(b, _mm_mul_ps(_mm_sqrt_ps(part_norms2(old)), inverse));
    } else {
      // The positive root of D s - b + 2 eps s (s^2 - 1) by Newton from above, where the function
      // is convex: one step from the old norm lands above the root (or is cut off at an upper
      // bound), the others descend to it.
      const __m128 eps2 = _mm_set1_ps(2.0F * eps);
      const __m128 eps4 = _mm_add_ps(eps2, eps2);
      const __m128 eps6 = _mm_add_ps(eps4, eps2);
      const __m128 slope = _mm_sub_ps(d, eps2);
      const __m128 upper = _mm_max_ps(one, _mm_div_ps(norm, _mm_max_ps(d, tiny)));
      const auto newton = [&](__m128 s2, __m128 s, __m128 denominator) {
        return _mm_div_ps(_mm_add_ps(_mm_mul_ps(_mm_mul_ps(eps4, s2), s), norm), denominator);
      };
      const __m128 old2 = part_norms2(old);
      const __m128 first = _mm_add_ps(_mm_mul_ps(eps6, old2), slope);
      const __m128 usable = _mm_cmpgt_ps(first, _mm_setzero_ps());
      const __m128 stepped = _mm_min_ps(upper, newton(old2, _mm_sqrt_ps(old2), first));
      __m128 s = _mm_or_ps(_mm_and_ps(usable, stepped), _mm_andnot_ps(usable, upper));
      for (int k = 0; k < 2; ++k) {
        const __m128 s2 = _mm_mul_ps(s, s);
        s = newton(s2, s, _mm_max_ps(_mm_add_ps(_mm_mul_ps(eps6, s2), slope), tiny));
      }
      s = _mm_max_ps(s, _mm_set1_ps(kLeastNorm));
      target = _mm_mul_ps(b, _mm_mul_ps(s, inverse));
    }
  }
  return _mm_add_ps(old, _mm_mul_ps(_mm_set1_ps(omega), _mm_sub_ps(target, old)));
}

template <SweepMode Mode>
struct Node<PairBlock, Mode> {
  static void update(const NodeTerm<PairBlock>& term, const std::uint32_t* neighbor,
                     const PairBlock::Coefficient* c, std::uint32_t degree, PairValue* x,
                     PairValue& xi, float omega) {
    float* const xr = reinterpret_cast<float*>(&xi);
    const __m128 row = _mm_add_ps(pair_row(neighbor, c, degree, x),
                                  _mm_loadu_ps(reinterpret_cast<const float*>(&term.rhs)));
    const __m128 d =
        _mm_set_ps(term.diagonal[1], term.diagonal[1], term.diagonal[0], term.diagonal[0]);
    _mm_storeu_ps(xr, settled<Mode>(row, _mm_loadu_ps(xr), d, term.eps, omega));
  }
};

inline __m128 load_complex(const Complex* z) {
  return _mm_loadl_pi(_mm_setzero_ps(), reinterpret_cast<const __m64*>(z));
}

// One complex part in the lower half of a register, the upper is zero. Values are stored whole: two
// halves would have to reach the cache before the next node's load of both.
template <SweepMode Mode>
struct Node<ComplexBlock, Mode> {
  static void update(const NodeTerm<ComplexBlock>& term, const std::uint32_t* neighbor,
                     const ComplexBlock::Coefficient* c, std::uint32_t degree, Complex* x,
                     Complex& xi, float omega) {
    // (sum re x_re, sum re x_im, sum im x_im, sum im x_re)
    __m128 sum = _mm_setzero_ps();
    for (std::uint32_t e = 0; e < degree; ++e) {
      const __m128 z = load_complex(&c[e].c);
      const __m128 v = load_complex(x + neighbor[e]);
      sum = _mm_add_ps(
          sum, _mm_mul_ps(_mm_unpacklo_ps(z, z), _mm_shuffle_ps(v, v, _MM_SHUFFLE(0, 1, 1, 0))));
    }
    const __m128 crossed =
        _mm_xor_ps(_mm_movehl_ps(_mm_setzero_ps(), sum), bits(pair_lanes::kRealSign));
    const __m128 straight = _mm_movelh_ps(sum, _mm_setzero_ps());
    const __m128 row = _mm_add_ps(_mm_add_ps(straight, crossed), load_complex(&term.rhs));
    const __m128 d = _mm_set1_ps(term.diagonal[0]);
    const __m128 next = settled<Mode>(row, load_complex(&xi), d, term.eps, omega);
    _mm_storel_pi(reinterpret_cast<__m64*>(&xi), next);
  }
};

// One complex part of the Newton system: (d + 4 eps u u^T) x = b.
inline void newton_part(float diagonal, float eps, const float* u, const float* b, float* x,
                        float omega) {
  const float norm2 = u[0] * u[0] + u[1] * u[1];
  const float d = diagonal + 2.0F * eps * std::max(norm2 - 1.0F, 0.0F);
  if (d > 0.0F) {
    const float along = 4.0F * eps * (u[0] * b[0] + u[1] * b[1]) / (d * (d + 4.0F * eps * norm2));
    for (int k = 0; k < 2; ++k) {
      x[k] += omega * (b[k] / d - along * u[k] - x[k]);
    }
  }
}

template <class Block>
void run_newton(std::span<const NodeTerm<Block>> terms, std::span<const std::uint32_t> row_begin,
                const std::uint32_t* neighbor, const Coefficient<Block>* coefficient,
                Value<Block>* x, float omega, bool backward, const Value<Block>* at) {
  using Ops = BlockOps<Block>;
  const auto n = static_cast<std::uint32_t>(terms.size());
  for (std::uint32_t k = 0; k < n; ++k) {
    const std::uint32_t i = backward ? n - 1 - k : k;
    Value<Block> b = terms[i].rhs;
    for (std::uint32_t e = row_begin[i]; e < row_begin[i + 1]; ++e) {
      Ops::apply_add(coefficient[e], reals<Block>(x[neighbor[e]]), reals<Block>(b));
    }
    for (std::size_t p = 0; p < Ops::kParts; ++p) {
      newton_part(terms[i].diagonal[p], terms[i].eps, reals<Block>(at[i]) + 2 * p,
                  reals<Block>(b) + 2 * p, reals<Block>(x[i]) + 2 * p, omega);
    }
  }
}

// A node waits for the one before, its neighbour along the curve, to the last division. So a sweep
// goes along several stretches of the tile at once, one node of each in turn.
constexpr std::uint32_t kStretches = 2;

template <class Visit>
void in_sweep_order(std::uint32_t n, bool backward, const Visit& visit) {
  const std::uint32_t stretch = n / kStretches;
  const std::uint32_t rest = stretch * kStretches;
  if (backward) {
    for (std::uint32_t i = n; i-- > rest;) {
      visit(i);
    }
    for (std::uint32_t k = stretch; k-- > 0;) {
      for (std::uint32_t s = kStretches; s-- > 0;) {
        visit(s * stretch + k);
      }
    }
    return;
  }
  for (std::uint32_t k = 0; k < stretch; ++k) {
    for (std::uint32_t s = 0; s < kStretches; ++s) {
      visit(s * stretch + k);
    }
  }
  for (std::uint32_t i = rest; i < n; ++i) {
    visit(i);
  }
}

template <class Block, SweepMode Mode>
void run(std::span<const NodeTerm<Block>> terms, std::span<const std::uint32_t> row_begin,
         const std::uint32_t* neighbor, const Coefficient<Block>* coefficient, Value<Block>* x,
         float omega, bool backward) {
  in_sweep_order(static_cast<std::uint32_t>(terms.size()), backward, [&](std::uint32_t i) {
    const std::uint32_t first = row_begin[i];
    Node<Block, Mode>::update(terms[i], neighbor + first, coefficient + first,
                              row_begin[i + 1] - first, x, x[i], omega);
  });
}

}  // namespace

template <class Block>
void sweep(std::span<const NodeTerm<Block>> terms, std::span<const std::uint32_t> row_begin,
           std::span<const std::uint32_t> neighbor, std::span<const Coefficient<Block>> coefficient,
           std::span<Value<Block>> x, float omega, SweepMode mode, bool backward,
           std::span<const Value<Block>> at) {
  if constexpr (BlockOps<Block>::kPeriodic) {
    if (mode == SweepMode::kNewton) {
      run_newton<Block>(terms, row_begin, neighbor.data(), coefficient.data(), x.data(), omega,
                        backward, at.data());
      return;
    }
    if (mode == SweepMode::kPenalty) {
      run<Block, SweepMode::kPenalty>(terms, row_begin, neighbor.data(), coefficient.data(),
                                      x.data(), omega, backward);
      return;
    }
    if (mode == SweepMode::kHold) {
      run<Block, SweepMode::kHold>(terms, row_begin, neighbor.data(), coefficient.data(), x.data(),
                                   omega, backward);
      return;
    }
    if (mode == SweepMode::kUnit) {
      run<Block, SweepMode::kUnit>(terms, row_begin, neighbor.data(), coefficient.data(), x.data(),
                                   omega, backward);
      return;
    }
  }
  ensure(mode == SweepMode::kLinear, "real blocks have no norms");
  run<Block, SweepMode::kLinear>(terms, row_begin, neighbor.data(), coefficient.data(), x.data(),
                                 omega, backward);
}

#define RATTAN_INSTANTIATE(Block)                                                                 \
  template void sweep<Block>(std::span<const NodeTerm<Block>>, std::span<const std::uint32_t>,    \
                             std::span<const std::uint32_t>, std::span<const Coefficient<Block>>, \
                             std::span<Value<Block>>, float, SweepMode, bool,                     \
                             std::span<const Value<Block>>);
RATTAN_FOR_EACH_BLOCK(RATTAN_INSTANTIATE)
#undef RATTAN_INSTANTIATE

}  // namespace rattan
