// SPDX-License-Identifier: MIT
#include "engine/mesh/curve.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <vector>

#include <gtest/gtest.h>

namespace rattan {
namespace {

TEST(HilbertCurve, VisitsEveryCellOnceByStepsAcrossFaces) {
  // The 16^3 blocks of 2^17 cells: the curve passes through them as one of order 4 does.
  constexpr std::uint32_t kSide = 16;
  struct Cell {
    std::uint64_t index;
    std::array<int, 3> at;
  };
  std::vector<Cell> cells;
  for (std::uint32_t x = 0; x < kSide; ++x) {
    for (std::uint32_t y = 0; y < kSide; ++y) {
      for (std::uint32_t z = 0; z < kSide; ++z) {
        cells.push_back({hilbert_index(x << 17, y << 17, z << 17) >> 51,
                         {static_cast<int>(x), static_cast<int>(y), static_cast<int>(z)}});
      }
    }
  }
  std::sort(cells.begin(), cells.end(),
            [](const Cell& a, const Cell& b) { return a.index < b.index; });
  for (std::size_t i = 0; i < cells.size(); ++i) {
    ASSERT_EQ(cells[i].index, i);
    if (i > 0) {
      int distance = 0;
      for (int c = 0; c < 3; ++c) {
        distance += std::abs(cells[i].at[c] - cells[i - 1].at[c]);
      }
      ASSERT_EQ(distance, 1) << i;
    }
  }
}

TEST(HilbertCurve, FinestCellsAreNeighboursToo) {
  struct Cell {
    std::uint64_t index;
    std::array<int, 3> at;
  };
  std::vector<Cell> cells;
  for (std::uint32_t i = 0; i < 512; ++i) {
    const std::uint32_t x = 1024 + i / 64;
    const std::uint32_t y = 8 + i / 8 % 8;
    const std::uint32_t z = 2097144 + i % 8;
    cells.push_back(
        {hilbert_index(x, y, z), {static_cast<int>(x), static_cast<int>(y), static_cast<int>(z)}});
  }
  std::sort(cells.begin(), cells.end(),
            [](const Cell& a, const Cell& b) { return a.index < b.index; });
  for (std::size_t i = 1; i < cells.size(); ++i) {
    ASSERT_EQ(cells[i].index, cells[i - 1].index + 1);
    int distance = 0;
    for (int c = 0; c < 3; ++c) {
      distance += std::abs(cells[i].at[c] - cells[i - 1].at[c]);
    }
    ASSERT_EQ(distance, 1);
  }
}

TEST(HilbertCurve, ClampsToItsBoxAndAcceptsAPoint) {
  const HilbertCurve curve(Vec3d(0, 0, 0), Vec3d(1, 2, 4));
  EXPECT_EQ(curve(Vec3d(0, 0, 0)), 0U);
  EXPECT_EQ(curve(Vec3d(-1, 0, 0)), 0U);
  EXPECT_EQ(curve(Vec3d(0, 0, 4)), curve(Vec3d(0, 0, 5)));
  const HilbertCurve point(Vec3d(3, 3, 3), Vec3d(3, 3, 3));
  EXPECT_EQ(point(Vec3d(3, 3, 3)), 0U);
}

}  // namespace
}  // namespace rattan
