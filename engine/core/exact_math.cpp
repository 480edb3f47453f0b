// SPDX-License-Identifier: MIT
#include "engine/core/exact_math.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

namespace rattan::exact {

namespace {

// pi/2 in two pieces; the first has 33 significant bits, so k * head is exact for k < 2^20.
constexpr double kHalfPiHead = 1.57079632673412561417e+00;
constexpr double kHalfPiTail = 6.07710050650619224932e-11;

// Taylor polynomials on [-pi/4, pi/4]: the first dropped term is below 1e-17.
double sin_kernel(double x) {
  const double z = x * x;
  double p = -1.0 / 1307674368000.0;
  p = p * z + 1.0 / 6227020800.0;
  p = p * z - 1.0 / 39916800.0;
  p = p * z + 1.0 / 362880.0;
  p = p * z - 1.0 / 5040.0;
  p = p * z + 1.0 / 120.0;
  p = p * z - 1.0 / 6.0;
  return x + x * z * p;
}

double cos_kernel(double x) {
  const double z = x * x;
  double p = 1.0 / 20922789888000.0;
  p = p * z - 1.0 / 87178291200.0;
  p = p * z + 1.0 / 479001600.0;
  p = p * z - 1.0 / 3628800.0;
  p = p * z + 1.0 / 40320.0;
  p = p * z - 1.0 / 720.0;
  p = p * z + 1.0 / 24.0;
  return 1.0 - 0.5 * z + z * z * p;
}

// atan on [0, tan(pi/16)] by its series; arguments are first reduced by multiples of pi/8.
double atan_series(double x) {
  const double z = x * x;
  double p = 0.0;
  for (int k = 25; k >= 3; k -= 2) {
    const double term = ((k / 2) % 2 == 0 ? 1.0 : -1.0) / k;
    p = p * z + term;
  }
  return x + x * z * p;
}

double atan_unit(double t) {
  // t in [0, 1]: subtract the nearest of 0, pi/8, pi/4 by the addition theorem.
  constexpr std::array<double, 3> kTan = {0.0, 0.41421356237309504880, 1.0};
  constexpr std::array<double, 3> kAngle = {0.0, 0.39269908169872415481, 0.78539816339744830962};
  const int i = t < 0.19891236737965800691 ? 0 : (t < 0.66817863791929891999 ? 1 : 2);
  const double r = (t - kTan[i]) / (1.0 + t * kTan[i]);
  return kAngle[i] + atan_series(r);
}

constexpr double kLn2Head = 6.93147180369123816490e-01;
constexpr double kLn2Tail = 1.90821492927058770002e-10;

}  // namespace

SinCos sincos(double x) {
  const double k = std::floor(x * (2.0 / kPi) + 0.5);
  const double r = (x - k * kHalfPiHead) - k * kHalfPiTail;
  const double s = sin_kernel(r);
  const double c = cos_kernel(r);
  switch (static_cast<std::int64_t>(k) & 3) {
    case 0:
      return {s, c};
    case 1:
      return {c, -s};
    case 2:
      return {-s, -c};
    default:
      return {-c, s};
  }
}

double atan2(double y, double x) {
  const double ax = std::abs(x);
  const double ay = std::abs(y);
  if (ax == 0.0 && ay == 0.0) {
    return 0.0;
  }
  const double a = ay <= ax ? atan_unit(ay / ax) : kPi / 2 - atan_unit(ax / ay);
  const double b = x < 0.0 ? kPi - a : a;
  // y == 0 with x < 0 gives +pi whatever the sign of zero, so that the range is half open.
  return y < 0.0 ? -b : b;
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
  double p = 1.0;
  for (int n = 13; n >= 1; --n) {
    p = 1.0 + p * r / n;
  }
  return std::ldexp(p, static_cast<int>(k));
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
