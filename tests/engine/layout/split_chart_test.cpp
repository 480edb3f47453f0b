// SPDX-License-Identifier: MIT
#include "engine/layout/split_chart.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

#include <gtest/gtest.h>

#include "engine/core/errors.h"
#include "engine/core/exact_math.h"
#include "tests/engine/layout/disk_checks.h"

namespace rattan {
namespace {

using testing::Disk;
using testing::even_middles;
using testing::expect_split;
using testing::Random;
using testing::Support;

Disk mapped(const Disk& disk, const std::function<Vec3d(const Vec3d&)>& f) {
  Disk out = disk;
  std::transform(disk.position.begin(), disk.position.end(), out.position.begin(), f);
  return out;
}

Disk jittered(Disk disk, double size, std::uint64_t seed) {
  Random random(seed);
  for (Vec3d& p : disk.position) {
    p.x() += size * (random.next() - 0.5);
    p.y() += size * (random.next() - 0.5);
  }
  return disk;
}

Disk grid_disk(std::uint32_t nx, std::uint32_t ny) {
  const testing::IndexedMesh m = testing::grid(nx, ny);
  return {m.positions, m.triangles};
}

/// How far spokes are from straight where `flat` has the vertices, and how much longer.
struct Bend {
  double aside = 0;
  double longer = 0;
};
Bend bend_in(const Disk& disk, const std::vector<Vec3d>& flat, const SplitDisk& cut) {
  std::vector<Vec3d> at;
  for (const Support& s : testing::supports(disk, cut)) {
    Vec3d& p = at.emplace_back(0, 0, 0);
    for (std::size_t k = 0; k < s.vertex.size(); ++k) {
      p += s.share[k] * flat[s.vertex[k]];
    }
  }
  Bend bend;
  for (const auto& spoke : cut.spokes) {
    const Vec3d from = at[spoke.front()];
    const Vec3d way = at[spoke.back()] - from;
    double length = 0;
    for (std::size_t i = 1; i < spoke.size(); ++i) {
      bend.aside = std::max(bend.aside, way.cross(at[spoke[i]] - from).norm() / way.norm());
      length += (at[spoke[i]] - at[spoke[i - 1]]).norm();
    }
    bend.longer = std::max(bend.longer, length / way.norm() - 1.0);
  }
  return bend;
}

/// The sine of the sharpest angle.
double sharpest(const std::vector<Vec3d>& position,
                const std::vector<std::array<std::uint32_t, 3>>& triangle) {
  double least = 1;
  for (const auto& t : triangle) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3d a = position[t[(k + 1) % 3]] - position[t[k]];
      const Vec3d b = position[t[(k + 2) % 3]] - position[t[k]];
      least = std::min(least, a.cross(b).norm() / (a.norm() * b.norm()));
    }
  }
  return least;
}

TEST(SplitChart, CutsPolygonsFromTheirMiddle) {
  for (std::uint32_t sides = 3; sides <= 12; ++sides) {
    const Disk disk = testing::ring_disk(6, 4 * sides);
    const auto middles = even_middles(disk, sides);
    const SplitDisk cut = split_disk(disk.position, disk.triangle, middles);
    expect_split(disk, middles, cut);
    EXPECT_EQ(cut.centre, 0U) << sides;
    // Middles lie on rays of the rings: no edge has to be cut.
    EXPECT_TRUE(cut.made.empty() || cut.made.back().share == 0.5) << sides;
    EXPECT_LT(bend_in(disk, disk.position, cut).aside, 1e-12) << sides;
  }
}

TEST(SplitChart, IsStraightInThePlane) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Disk disk = jittered(grid_disk(14, 11), 0.5, seed);
    const auto middles = even_middles(disk, 3 + static_cast<std::uint32_t>(seed % 7));
    const SplitDisk cut = split_disk(disk.position, disk.triangle, middles);
    expect_split(disk, middles, cut);
    const Bend bend = bend_in(disk, disk.position, cut);
    EXPECT_LT(bend.aside, 0.2) << seed;  // of an edge: passing through vertices nearby
    EXPECT_LT(bend.longer, 0.006) << seed;
    EXPECT_GT(sharpest(cut.position, cut.triangle), 0.02) << seed;
    const Vec3d& centre = cut.position[cut.centre];
    EXPECT_LT((centre - Vec3d(7, 5.5, 0)).norm(), 2.5) << seed;
  }
}

TEST(SplitChart, IsStraightOnDevelopableSurfaces) {
  const auto cylinder = [](const Vec3d& p) {
    const exact::SinCos a = exact::sincos(p.x() / 4.0);
    return Vec3d(4.0 * a.cos, 4.0 * a.sin, p.y());
  };
  // A cone whose apex is at (7, -6) in the plane, opened to a third of the angle.
  const auto cone = [](const Vec3d& p) {
    const double x = p.x() - 7.0;
    const double y = p.y() + 6.0;
    const double radius = std::sqrt(x * x + y * y);
    const exact::SinCos a = exact::sincos(3.0 * exact::atan2(x, y));
    return Vec3d(radius / 3.0 * a.sin, radius / 3.0 * a.cos, radius * std::sqrt(8.0) / 3.0);
  };
  for (const auto& surface :
       {std::function<Vec3d(const Vec3d&)>(cylinder), std::function<Vec3d(const Vec3d&)>(cone)}) {
    for (std::uint64_t seed = 0; seed < 5; ++seed) {
      const Disk plane = jittered(grid_disk(14, 11), 0.4, seed);
      const Disk disk = mapped(plane, surface);
      const auto middles = even_middles(disk, 5);
      const SplitDisk cut = split_disk(disk.position, disk.triangle, middles);
      expect_split(disk, middles, cut);
      const Bend bend = bend_in(disk, plane.position, cut);
      EXPECT_LT(bend.aside, 0.35) << seed;
      EXPECT_LT(bend.longer, 0.01) << seed;
    }
  }
}

TEST(SplitChart, FollowsGreatCircles) {
  const Disk flat = testing::ring_disk(10, 30);
  const Disk disk = mapped(jittered(flat, 0.04, 3), [](const Vec3d& p) {
    const double r = std::sqrt(p.x() * p.x() + p.y() * p.y());
    const exact::SinCos a = exact::sincos(0.5 * exact::kPi * r);
    return r > 0 ? Vec3d(p.x() / r * a.sin, p.y() / r * a.sin, a.cos) : Vec3d(0, 0, 1);
  });
  for (const std::uint32_t sides : {3U, 5U, 6U, 7U}) {
    const auto middles = even_middles(disk, sides);
    const SplitDisk cut = split_disk(disk.position, disk.triangle, middles);
    expect_split(disk, middles, cut);
    for (const auto& spoke : cut.spokes) {
      const Vec3d from = cut.position[spoke.front()];
      const Vec3d to = cut.position[spoke.back()];
      EXPECT_NEAR(testing::length_of(cut, spoke) / exact::acos(from.dot(to)), 1.0, 0.015);
      const Vec3d normal = from.cross(to).normalized();
      for (const std::uint32_t v : spoke) {
        EXPECT_LT(std::abs(normal.dot(cut.position[v])), 0.03);
      }
    }
  }
}

TEST(SplitChart, GoesAroundAHill) {
  // A steep hill beside the centre: straight over it is far longer.
  const Disk disk = mapped(grid_disk(20, 20), [](const Vec3d& p) {
    const double d = (p - Vec3d(14, 10.2, 0)).squaredNorm();
    return Vec3d(p.x(), p.y(), 12.0 * exact::exp(-d / 4.0));
  });
  const auto middles = even_middles(disk, 5);
  const SplitDisk cut = split_disk(disk.position, disk.triangle, middles);
  expect_split(disk, middles, cut);
  for (const auto& spoke : cut.spokes) {
    EXPECT_LT(testing::length_of(cut, spoke), 16.0);
    for (const std::uint32_t v : spoke) {
      EXPECT_LT(cut.position[v].z(), 4.0);
    }
  }
}

TEST(SplitChart, CutsWhatHasNoVertexInside) {
  // The fewest triangles there can be: three corners and three middles.
  Disk disk;
  for (int i = 0; i < 6; ++i) {
    const exact::SinCos a = exact::sincos(exact::kPi / 3 * i);
    disk.position.emplace_back(a.cos, a.sin, 0);
  }
  disk.triangle = {{0, 2, 4}, {0, 1, 2}, {2, 3, 4}, {4, 5, 0}};
  for (const std::vector<std::uint32_t>& middles :
       {std::vector<std::uint32_t>{0, 2, 4}, {1, 3, 5}, {5, 1, 3}}) {
    const SplitDisk cut = split_disk(disk.position, disk.triangle, middles);
    expect_split(disk, middles, cut);
    EXPECT_LT(cut.position[cut.centre].norm(), 0.4);
  }
  // A strip.
  Disk strip;
  for (std::uint32_t i = 0; i < 12; ++i) {
    strip.position.emplace_back(i, 0, 0);
    strip.position.emplace_back(i, 1, 0);
    if (i > 0) {
      strip.triangle.push_back({2 * i - 2, 2 * i, 2 * i - 1});
      strip.triangle.push_back({2 * i - 1, 2 * i, 2 * i + 1});
    }
  }
  for (std::uint32_t sides = 3; sides <= 12; ++sides) {
    const auto middles = even_middles(strip, sides);
    expect_split(strip, middles, split_disk(strip.position, strip.triangle, middles));
  }
}

/// All spokes have to leave through few triangles, along each other.
TEST(SplitChart, FindsRoomWhereThereIsLittle) {
  // A comb: middles at the tips of teeth, seen from the centre around corners.
  const testing::IndexedMesh whole = testing::grid(26, 6);
  const testing::IndexedMesh comb = testing::without(whole, [](std::uint32_t t) {
    const std::uint32_t x = t / 2 % 26;
    return t / 2 / 26 >= 2 && x % 4 >= 2;
  });
  const Disk disk{comb.positions, comb.triangles};
  const auto rim = testing::rim_of(disk);
  std::vector<std::uint32_t> middles;
  for (std::size_t i = 0; i < rim.size(); ++i) {
    const Vec3d& p = disk.position[rim[i]];
    const bool tip = p.y() == 6.0 && static_cast<int>(p.x()) % 4 == 1;
    if (tip || p == Vec3d(12, 0, 0)) {
      middles.push_back(rim[i]);
    }
  }
  ASSERT_GE(middles.size(), 7U);
  const SplitDisk cut = split_disk(disk.position, disk.triangle, middles);
  expect_split(disk, middles, cut);
  EXPECT_GT(sharpest(cut.position, cut.triangle), 0.01);
}

TEST(SplitChart, CutsRandomDisks) {
  Random random(11);
  int compared = 0;
  for (int i = 0; i < 400; ++i) {
    SCOPED_TRACE(i);
    const auto n = 2 + static_cast<std::uint32_t>(random.next() * 11);
    const bool tight = i % 3 == 0;  // one vertex between middles
    const std::uint32_t sides =
        tight ? 2 * n : 2 * n + static_cast<std::uint32_t>(random.next() * 40);
    const auto inside = static_cast<std::uint32_t>(random.next() * random.next() * 300);
    const double folded = i % 4 == 0 ? 0.0 : i % 4 == 1 ? 0.1 : i % 4 == 2 ? 2.0 : 1e-9;
    const double collapsed = i % 5 == 0 ? 0.2 : 0.0;
    const Disk disk = testing::random_disk(sides, inside, folded, collapsed, random);
    std::vector<std::uint32_t> middles = even_middles(disk, n);
    std::rotate(middles.begin(), middles.begin() + i % n, middles.end());
    const SplitDisk cut = split_disk(disk.position, disk.triangle, middles);
    expect_split(disk, middles, cut);
    if (cut.centre < disk.position.size()) {
      for (std::size_t s = 0; s < n; ++s) {
        const double edges = testing::edge_way(disk, middles, cut, s);
        EXPECT_LE(testing::length_of(cut, cut.spokes[s]), edges * (1.0 + 1e-9));
        compared += std::isfinite(edges) ? 1 : 0;
      }
    }
    if (::testing::Test::HasFailure()) {
      break;
    }
  }
  EXPECT_GT(compared, 100);
}

TEST(SplitChart, IsNoLongerThanEdges) {
  Random random(8);
  int compared = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(seed);
    Disk disk = jittered(grid_disk(12, 5 + static_cast<std::uint32_t>(seed % 8)), 0.8, seed);
    for (Vec3d& p : disk.position) {
      p.z() = static_cast<double>(seed % 5) * random.next();
    }
    const auto middles = even_middles(disk, 3 + static_cast<std::uint32_t>(seed % 9));
    const SplitDisk cut = split_disk(disk.position, disk.triangle, middles);
    expect_split(disk, middles, cut);
    for (std::size_t s = 0; s < middles.size() && cut.centre < disk.position.size(); ++s) {
      const double edges = testing::edge_way(disk, middles, cut, s);
      EXPECT_LE(testing::length_of(cut, cut.spokes[s]), edges * (1.0 + 1e-9)) << s;
      compared += std::isfinite(edges) ? 1 : 0;
    }
  }
  EXPECT_GT(compared, 300);
}

TEST(SplitChart, CutsPointsAndNeedles) {
  Random random(5);
  for (int i = 0; i < 60; ++i) {
    SCOPED_TRACE(i);
    Disk disk = testing::random_disk(12, static_cast<std::uint32_t>(i), 0.0, 0.0, random);
    for (Vec3d& p : disk.position) {
      p = i % 3 == 0   ? Vec3d(1, 2, 3)                   // all in one point
          : i % 3 == 1 ? Vec3d(p.x(), 0, 0)               // on a line
                       : Vec3d(p.x(), 1e-14 * p.y(), 0);  // almost
    }
    const auto middles = even_middles(disk, 5);
    expect_split(disk, middles, split_disk(disk.position, disk.triangle, middles));
  }
}

TEST(SplitChart, IsTheSameEveryTime) {
  Random random(2);
  const Disk disk = testing::random_disk(30, 200, 0.2, 0.05, random);
  const auto middles = even_middles(disk, 5);
  const SplitDisk a = split_disk(disk.position, disk.triangle, middles);
  const SplitDisk b = split_disk(disk.position, disk.triangle, middles);
  EXPECT_EQ(a.position, b.position);
  EXPECT_EQ(a.triangle, b.triangle);
  EXPECT_EQ(a.spokes, b.spokes);
  EXPECT_EQ(a.part_begin, b.part_begin);
}

TEST(SplitChart, RefusesWhatIsNoDisk) {
  const Disk disk = testing::ring_disk(3, 8);
  const auto rim = testing::rim_of(disk);
  const auto split = [](const Disk& d, std::vector<std::uint32_t> middles) {
    split_disk(d.position, d.triangle, middles);
  };
  EXPECT_THROW(split(disk, {rim[0]}), InternalError);                  // too few
  EXPECT_THROW(split(disk, {rim[0], rim[1], rim[4]}), InternalError);  // no corner between
  EXPECT_THROW(split(disk, {rim[4], rim[2], rim[0]}), InternalError);  // the wrong way round
  EXPECT_THROW(split(disk, {rim[0], rim[2], 0}), InternalError);       // not on the rim
  Disk ring = disk;
  ring.triangle.erase(ring.triangle.begin());
  EXPECT_THROW(split(ring, {rim[0], rim[2], rim[4]}), InternalError);
  Disk loose = disk;
  loose.position.emplace_back(0, 0, 1);
  EXPECT_THROW(split(loose, {rim[0], rim[2], rim[4]}), InternalError);
}

}  // namespace
}  // namespace rattan
