// SPDX-License-Identifier: MIT
#include "engine/layout/arrangement.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <string>

#include <gtest/gtest.h>

#include "engine/core/errors.h"
#include "engine/core/exact_math.h"
#include "tests/engine/layout/sample_meshes.h"

namespace rattan {
namespace {

using testing::expect_decomposition;
using testing::expect_same;
using testing::extract;
using testing::Extracted;
using testing::Fields;
using testing::IndexedMesh;

constexpr std::uint32_t kOneTile = 1000000000;

std::vector<IndexedMesh> all_meshes() {
  using namespace testing;
  std::vector<IndexedMesh> list;
  list.push_back(grid(12, 9));
  list.push_back(without(grid(14, 11), [](std::uint32_t t) {
    const std::uint32_t x = t / 2 % 14;
    const std::uint32_t y = t / 2 / 14;
    return (x == 3 && y == 3) || (x > 6 && x < 10 && y > 4 && y < 8);
  }));
  list.push_back(torus(24, 12));
  list.push_back(sphere(3, 4.0));
  list.push_back(without(torus(20, 9), [](std::uint32_t t) { return t % 61 == 3; }));
  list.push_back(plate({"#####", "#.#.#", "#####", "#.###", "#####"}));
  list.push_back(tetrahedron());
  list.push_back(pillow());
  list.push_back({"triangle", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}});
  list.push_back(join({sphere(2), tetrahedron(), torus(9, 5), grid(4, 3), pillow(), sphere(0)}));
  list.push_back(shuffled(plate({"####", "#..#", "####"}), 5));
  list.push_back(shuffled(list[1], 7));
  return list;
}

TEST(Arrangement, KeepsTopologyForRandomFields) {
  for (const IndexedMesh& m : all_meshes()) {
    for (const double omega : {0.7, 2.0, 6.0, 40.0}) {
      for (std::uint64_t seed = 0; seed < 4; ++seed) {
        SCOPED_TRACE(m.name + ", omega " + std::to_string(omega) + ", seed " +
                     std::to_string(seed));
        const Fields f = testing::random_fields(m, seed);
        const int density = 1 + static_cast<int>(seed);
        const Extracted one = extract(m, f, omega, density, kOneTile);
        expect_decomposition(m, one.cells);
        if (::testing::Test::HasFailure()) {
          return;
        }
      }
    }
  }
}

TEST(Arrangement, DoesNotDependOnTilesOrThreads) {
  for (const IndexedMesh& m : all_meshes()) {
    for (const double omega : {2.0, 8.0, 1000.0}) {
      SCOPED_TRACE(m.name + ", omega " + std::to_string(omega));
      const Fields f = testing::random_fields(m, 11);
      const Extracted one = extract(m, f, omega, 2, kOneTile);
      expect_decomposition(m, one.cells);
      for (const std::uint32_t size : {3U, 17U, 64U, 256U}) {
        SCOPED_TRACE("tiles of " + std::to_string(size));
        for (const int threads : {1, 2}) {
          const Extracted tiled = extract(m, f, omega, 2, size, threads);
          expect_same(one.cells, tiled.cells);
          EXPECT_EQ(one.report.singularities, tiled.report.singularities);
          EXPECT_EQ(one.report.dangling_ends, tiled.report.dangling_ends);
          EXPECT_EQ(one.report.dropped_circles, tiled.report.dropped_circles);
          EXPECT_EQ(one.report.cut_faces, tiled.report.cut_faces);
          if (::testing::Test::HasFailure()) {
            return;
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace rattan
