// SPDX-License-Identifier: MIT
#include "engine/core/exact_math.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <emmintrin.h>

namespace rattan::exact {

namespace {

// pi/2 in two pieces; the first has 33 significant bits, so k * head is exact for k < 2^20.
constexpr double kHalfPiHead = 1.57079632673412561417e+00;
constexpr double kHalfPiTail = 6.07710050650619224932e-11;

// Taylor polynomials on [-pi/4, pi/4]: the first dropped term is below 1e-17. The sine's (times x
// z, x) and the cosine's (times z z, 1 - z / 2) have as many terms, so they go side by side.
constexpr std::size_t kTerms = 7;
alignas(16) constexpr std::array<std::array<double, 2>, kTerms> kSinCos{{
    {-1.0 / 1307674368000.0, 1.0 / 20922789888000.0},
    {1.0 / 6227020800.0, -1.0 / 87178291200.0},
    {-1.0 / 39916800.0, 1.0 / 479001600.0},
    {1.0 / 362880.0, -1.0 / 3628800.0},
    {-1.0 / 5040.0, 1.0 / 40320.0},
    {1.0 / 120.0, -1.0 / 720.0},
    {-1.0 / 6.0, 1.0 / 24.0},
}};

// (sin x, cos x)
inline __m128d sin_cos_kernel(double x) {
  const double z = x * x;
  const __m128d zz = _mm_set1_pd(z);
  __m128d p = _mm_load_pd(kSinCos[0].data());
  for (std::size_t k = 1; k < kTerms; ++k) {
    p = _mm_add_pd(_mm_mul_pd(p, zz), _mm_load_pd(kSinCos[k].data()));
  }
  const __m128d first = _mm_unpacklo_pd(_mm_set_sd(x), _mm_set_sd(1.0 - 0.5 * z));
  const __m128d factor = _mm_mul_pd(_mm_unpacklo_pd(_mm_set_sd(x), _mm_set_sd(z)), zz);
  return _mm_add_pd(first, _mm_mul_pd(factor, p));
}

// The coefficients of atan's series behind x, from x^25 down to x^3.
constexpr auto kAtan = [] {
  std::array<double, 12> terms{};
  for (int n = 0; n < 12; ++n) {
    const int k = 25 - 2 * n;
    terms[static_cast<std::size_t>(n)] = ((k / 2) % 2 == 0 ? 1.0 : -1.0) / k;
  }
  return terms;
}();

inline __m128d choose(__m128d mask, __m128d yes, __m128d no) {
  return _mm_or_pd(_mm_and_pd(mask, yes), _mm_andnot_pd(mask, no));
}

// atan of two numbers in [0, 1]: the nearest of 0, pi/8, pi/4 is subtracted by the addition
// theorem; the series serves for the rest, up to tan(pi/16).
inline __m128d atan_unit(__m128d t) {
  const __m128d from_first = _mm_cmpge_pd(t, _mm_set1_pd(0.19891236737965800691));
  const __m128d from_second = _mm_cmpge_pd(t, _mm_set1_pd(0.66817863791929891999));
  const __m128d tangent = choose(from_second, _mm_set1_pd(1.0),
                                 _mm_and_pd(from_first, _mm_set1_pd(0.41421356237309504880)));
  const __m128d angle = choose(from_second, _mm_set1_pd(0.78539816339744830962),
                               _mm_and_pd(from_first, _mm_set1_pd(0.39269908169872415481)));
  const __m128d x = (t - tangent) / (_mm_set1_pd(1.0) + t * tangent);
  const __m128d z = x * x;
  __m128d p = _mm_setzero_pd();
  for (const double term : kAtan) {
    p = p * z + _mm_set1_pd(term);
  }
  return angle + (x + x * z * p);
}

// 1 / 13! down to 1 / 0!.
constexpr auto kInverseFactorial = [] {
  std::array<double, 14> terms{};
  double factorial = 1.0;
  for (std::size_t n = 0; n < terms.size(); ++n) {
    factorial *= n > 0 ? static_cast<double>(n) : 1.0;
    terms[terms.size() - 1 - n] = 1.0 / factorial;
  }
  return terms;
}();

constexpr double kLn2Head = 6.93147180369123816490e-01;
constexpr double kLn2Tail = 1.90821492927058770002e-10;

}  // namespace

SinCos sincos(double x) {
  // floor() without its call.
  const double turns = x * (2.0 / kPi) + 0.5;
  const auto toward_zero = static_cast<std::int64_t>(_mm_cvttsd_si64(_mm_set_sd(turns)));
  const std::int64_t quarter = toward_zero - (static_cast<double>(toward_zero) > turns ? 1 : 0);
  const auto k = static_cast<double>(quarter);
  const double r = (x - k * kHalfPiHead) - k * kHalfPiTail;
  // (s, c), (c, -s), (-s, -c), (-c, s): without branches, as quarters are as good as random.
  const auto q = static_cast<std::uint64_t>(quarter);
  const __m128i kernel = _mm_castpd_si128(sin_cos_kernel(r));
  const __m128i swapped = _mm_shuffle_epi32(kernel, _MM_SHUFFLE(1, 0, 3, 2));
  const __m128i odd = _mm_set1_epi64x(-static_cast<std::int64_t>(q & 1U));
  const __m128i signs = _mm_set_epi64x(static_cast<std::int64_t>((q + 1) >> 1U << 63U),
                                       static_cast<std::int64_t>(q >> 1U << 63U));
  const __m128d turned = _mm_castsi128_pd(_mm_xor_si128(
      _mm_or_si128(_mm_and_si128(odd, swapped), _mm_andnot_si128(odd, kernel)), signs));
  return {_mm_cvtsd_f64(turned), _mm_cvtsd_f64(_mm_unpackhi_pd(turned, turned))};
}

std::array<double, 2> atan2(const std::array<double, 2>& ys, const std::array<double, 2>& xs) {
  // Two loads each: one of both would wait for the stores that have just made them.
  const __m128d y = _mm_set_pd(ys[1], ys[0]);
  const __m128d x = _mm_set_pd(xs[1], xs[0]);
  const __m128d minus = _mm_set1_pd(-0.0);
  const __m128d zero = _mm_setzero_pd();
  const __m128d ax = _mm_andnot_pd(minus, x);
  const __m128d ay = _mm_andnot_pd(minus, y);
  const __m128d steep = _mm_cmpgt_pd(ay, ax);
  const __m128d longer = _mm_max_pd(ax, ay);
  const __m128d unit = atan_unit(_mm_min_pd(ax, ay) / longer);
  const __m128d a = choose(steep, _mm_set1_pd(kPi / 2) - unit, unit);
  const __m128d b = choose(_mm_cmplt_pd(x, zero), _mm_set1_pd(kPi) - a, a);
  // y == 0 with x < 0 gives +pi whatever the sign of zero, so that the range is half open.
  const __m128d signed_b = _mm_xor_pd(b, _mm_and_pd(_mm_cmplt_pd(y, zero), minus));
  std::array<double, 2> out;
  _mm_storeu_pd(out.data(), _mm_and_pd(signed_b, _mm_cmpneq_pd(longer, zero)));
  return out;
}

double atan2(double y, double x) {
  return atan2(std::array{y, y}, std::array{x, x})[0];
}

double exp(double x) {
  if (x > 709.0) {
    x = 709.0;
  }
  if (x < -708.0) {
    return 0.0;
  }
  const double k = std::floor(x * 1.44269504088896340736 + 0.5);
  const double r = (x - k * kLn2Head) - k * kLn2Tail;
  double p = kInverseFactorial.front();
  for (std::size_t n = 1; n < kInverseFactorial.size(); ++n) {
    p = p * r + kInverseFactorial[n];
  }
  // |k| < 1024 and 0.7 < p < 1.5: the power of two is a normal number.
  return p * std::bit_cast<double>((static_cast<std::int64_t>(k) + 1023) << 52);
}

double log(double x) {
  int e = 0;
  double m = std::frexp(x, &e);  // [0.5, 1)
  if (m < 0.70710678118654752440) {
    m *= 2.0;
    --e;
  }
  const double s = (m - 1.0) / (m + 1.0);
  const double z = s * s;
  double p = 0.0;
  for (int k = 21; k >= 3; k -= 2) {
    p = (p + 1.0 / k) * z;
  }
  return e * kLn2Head + (2.0 * s + (2.0 * s * p + e * kLn2Tail));
}

double acos(double x) {
  if (x >= 1.0) {
    return 0.0;
  }
  if (x <= -1.0) {
    return kPi;
  }
  return exact::atan2(std::sqrt((1.0 - x) * (1.0 + x)), x);
}

double pow(double base, double exponent) {
  return exact::exp(exponent * exact::log(base));
}

}  // namespace rattan::exact
