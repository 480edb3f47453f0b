// SPDX-License-Identifier: MIT
#pragma once

// sin, cos, atan2, exp and log whose bits are the same on every x86-64 machine. The C library picks
// its variant (with or without fused multiply-add) at run time, so its last bit depends on the
// processor; engine code that decides output must use these instead of <cmath>. sqrt, floor, round,
// abs and fmod are exactly defined and stay with <cmath>.
//
// Accuracy: absolute error below 1e-15 for sin and cos with |x| <= 1e5, relative below 4e-16 plus
// rounding for exp and log, absolute below 1e-15 for atan2. Checked in tests/engine/core.

#include <array>

namespace rattan::exact {

struct SinCos {
  double sin;
  double cos;
};

/// Radians; |x| up to 1e5.
SinCos sincos(double x);
/// In (-pi, pi]; atan2(0, 0) is 0.
double atan2(double y, double x);
/// Two at the price of one, to the same bits.
std::array<double, 2> atan2(const std::array<double, 2>& y, const std::array<double, 2>& x);
/// |x| up to 700; saturates beyond.
double exp(double x);
/// x > 0.
double log(double x);
/// x in [-1, 1], clamped.
double acos(double x);
/// base > 0.
double pow(double base, double exponent);

inline constexpr double kPi = 3.14159265358979323846;

}  // namespace rattan::exact
