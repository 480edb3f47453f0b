// SPDX-License-Identifier: MIT
#include "engine/remesh/shape_pull.h"

#include <array>
#include <cmath>
#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace rattan {
namespace {

const std::vector<std::uint32_t> kQuad{0, 1, 2, 3};

std::array<ShapePull, 4> pull(const std::vector<Vec3d>& x, double edge_length = 1.0,
                              double length_weight = 0.8) {
  std::array<ShapePull, 4> out;
  const std::vector<std::uint32_t> face(kQuad.begin(),
                                        kQuad.begin() + static_cast<std::ptrdiff_t>(x.size()));
  pull_face(x, face, Vec3d::UnitZ(), edge_length, length_weight, out.data());
  return out;
}

/// What the header says that the forces come from.
double energy(const std::vector<Vec3d>& x, double edge_length, double length_weight) {
  const std::size_t n = x.size();
  double squares = 0.0;
  double lengths = 0.0;
  for (std::size_t k = 0; k < n; ++k) {
    const Vec3d a = x[(k + 1) % n] - x[k];
    const Vec3d b = x[(k + n - 1) % n] - x[k];
    const double loss = 1.0 - a.cross(b).norm() / (a.norm() * b.norm());
    squares += loss * loss;
    const double off = a.norm() / edge_length - 1.0;
    lengths += 0.5 * length_weight * off * off;
  }
  return std::sqrt(squares) + lengths;
}

TEST(ShapePull, SquaresOfTheRightSizeAreAtRest) {
  for (const ShapePull& p : pull({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}})) {
    EXPECT_LT(p.force.norm(), 1e-12);
    EXPECT_GT(p.stiffness, 0.0);
  }
  for (const ShapePull& p : pull({{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}})) {
    EXPECT_NEAR(p.force.norm(), 0.8 * std::sqrt(2.0), 1e-12);
  }
}

TEST(ShapePull, IsMinusTheGradient) {
  // All corners well off 90 degrees, so that no weight is at its floor.
  const std::vector<Vec3d> x{{0, 0, 0}, {1.3, 0.2, 0}, {1.7, 1.4, 0}, {0.5, 0.9, 0}};
  for (const double size : {1.0, 0.01, 300.0}) {
    std::vector<Vec3d> y = x;
    for (Vec3d& p : y) {
      p *= size;
    }
    const double edge_length = 1.1 * size;
    const auto forces = pull(y, edge_length, 0.5);
    const double h = 1e-6 * size;
    for (std::size_t v = 0; v < 4; ++v) {
      for (int axis = 0; axis < 2; ++axis) {
        std::vector<Vec3d> up = y, down = y;
        up[v][axis] += h;
        down[v][axis] -= h;
        const double slope =
            (energy(up, edge_length, 0.5) - energy(down, edge_length, 0.5)) / (2 * h);
        EXPECT_NEAR(forces[v].force[axis], -edge_length * edge_length * slope, 1e-5 * size);
      }
    }
  }
}

TEST(ShapePull, MovesNoFaceAsAWhole) {
  const std::vector<std::vector<Vec3d>> faces{
      {{0, 0, 0.1}, {1.2, 0.1, 0}, {1.5, 0.8, 0.1}, {0.3, 0.2, 0}},
      {{0, 0, 0}, {2, 0, 0.3}, {0.5, 0.6, 0}},
      {{0, 0, 0}, {0, 0, 0}, {1, 1, 0}, {0, 1, 0}}};
  for (const auto& x : faces) {
    Vec3d sum = Vec3d::Zero();
    const auto forces = pull(x);
    for (std::size_t v = 0; v < x.size(); ++v) {
      EXPECT_TRUE(forces[v].force.allFinite());
      EXPECT_TRUE(std::isfinite(forces[v].stiffness));
      sum += forces[v].force;
    }
    EXPECT_LT(sum.norm(), 1e-9);
  }
}

TEST(ShapePull, OpensReflexCorners) {
  // The third corner is dented inwards; its force points outwards.
  const auto dart = pull({{0, 0, 0}, {1, 0, 0}, {0.3, 0.3, 0}, {0, 1, 0}}, 1.0, 0.0);
  EXPECT_GT(dart[2].force.x(), 0.1);
  EXPECT_GT(dart[2].force.y(), 0.1);
}

TEST(ShapePull, TrianglesTendToSixtyDegrees) {
  const auto even = pull({{0, 0, 0}, {1.1, 0, 0}, {0.55, 1.1 * std::sqrt(0.75), 0}});
  for (int k = 0; k < 3; ++k) {
    EXPECT_LT(even[static_cast<std::size_t>(k)].force.norm(), 1e-12);
  }
  const auto flat = pull({{0, 0, 0}, {2, 0, 0}, {1, 0.3, 0}});
  EXPECT_GT(flat[2].force.y(), 0.1);
}

TEST(ShapePull, LeavesLargerFacesAlone) {
  const std::vector<Vec3d> x{{0, 0, 0}, {2, 0, 0}, {3, 1, 0}, {1, 2, 0}, {0, 1, 0}};
  const std::vector<std::uint32_t> face{0, 1, 2, 3, 4};
  std::array<ShapePull, 5> out;
  pull_face(x, face, Vec3d::UnitZ(), 1.0, 1.0, out.data());
  for (const ShapePull& p : out) {
    EXPECT_EQ(p.force, Vec3d::Zero().eval());
    EXPECT_EQ(p.stiffness, 0.0);
  }
}

}  // namespace
}  // namespace rattan
