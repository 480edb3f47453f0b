// SPDX-License-Identifier: MIT
#include "engine/core/exact_math.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace rattan {
namespace {

TEST(ExactMath, AgreesWithTheCLibrary) {
  std::mt19937_64 engine(7);
  std::uniform_real_distribution<double> wide(-1e4, 1e4);
  std::uniform_real_distribution<double> small(-8.0, 8.0);
  for (int i = 0; i < 200000; ++i) {
    const double x = i % 2 == 0 ? wide(engine) : small(engine);
    const exact::SinCos sc = exact::sincos(x);
    ASSERT_NEAR(sc.sin, std::sin(x), 2e-15) << x;
    ASSERT_NEAR(sc.cos, std::cos(x), 2e-15) << x;
    const double y = small(engine);
    const double z = small(engine);
    ASSERT_NEAR(exact::atan2(y, z), std::atan2(y, z), 1e-15) << y << " " << z;
    ASSERT_NEAR(exact::exp(y * 10), std::exp(y * 10), 4e-15 * std::exp(y * 10)) << y * 10;
    const double p = std::exp(y * 20);
    ASSERT_NEAR(exact::log(p), std::log(p), 1e-15 * (1 + std::abs(std::log(p)))) << p;
    const double c = y / 8.0;
    ASSERT_NEAR(exact::acos(c), std::acos(c), 2e-15) << c;
  }
}

TEST(ExactMath, SpecialAngles) {
  EXPECT_EQ(exact::atan2(0.0, 0.0), 0.0);
  EXPECT_EQ(exact::atan2(0.0, -1.0), exact::kPi);
  EXPECT_EQ(exact::atan2(-0.0, -1.0), exact::kPi);
  EXPECT_EQ(exact::atan2(1.0, 0.0), exact::kPi / 2);
  EXPECT_EQ(exact::atan2(-1.0, 0.0), -exact::kPi / 2);
  EXPECT_EQ(exact::sincos(0.0).cos, 1.0);
  EXPECT_EQ(exact::exp(0.0), 1.0);
  EXPECT_EQ(exact::log(1.0), 0.0);
}

}  // namespace
}  // namespace rattan
