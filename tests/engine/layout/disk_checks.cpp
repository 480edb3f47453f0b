// SPDX-License-Identifier: MIT
#include "tests/engine/layout/disk_checks.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include <gtest/gtest.h>

#include "engine/core/exact_math.h"

namespace rattan::testing {

namespace {

using Triangles = std::vector<std::array<std::uint32_t, 3>>;

/// The boundary from `first` on; empty if the triangles are no disk.
std::vector<std::uint32_t> disk_rim(const Triangles& triangles, std::uint32_t first) {
  std::set<std::array<std::uint32_t, 2>> halves;
  std::set<std::uint32_t> vertices;
  for (const auto& t : triangles) {
    for (int k = 0; k < 3; ++k) {
      if (!halves.insert({t[k], t[(k + 1) % 3]}).second) {
        return {};
      }
      vertices.insert(t[k]);
    }
  }
  std::map<std::uint32_t, std::uint32_t> next;
  std::size_t inner = 0;
  for (const auto& [a, b] : halves) {
    if (halves.count({b, a}) != 0) {
      ++inner;
    } else if (!next.emplace(a, b).second) {
      return {};
    }
  }
  const std::size_t edges = halves.size() - inner / 2;
  if (vertices.size() + triangles.size() != edges + 1) {
    return {};
  }
  std::vector<std::uint32_t> rim;
  for (std::uint32_t v = first; next.count(v) != 0 && rim.size() < next.size(); v = next[v]) {
    rim.push_back(v);
  }
  // Connected: of what has Euler characteristic 1 and a single loop, all else would be closed.
  std::map<std::uint32_t, std::uint32_t> root;
  for (const std::uint32_t v : vertices) {
    root[v] = v;
  }
  const auto find = [&](std::uint32_t v) {
    while (root[v] != v) {
      v = root[v] = root[root[v]];
    }
    return v;
  };
  for (const auto& [a, b] : halves) {
    root[find(a)] = find(b);
  }
  for (const std::uint32_t v : vertices) {
    if (find(v) != find(first)) {
      return {};
    }
  }
  return rim.size() == next.size() && next[rim.back()] == first ? rim
                                                                : std::vector<std::uint32_t>{};
}

double area(const std::vector<Vec3d>& position, const Triangles& triangles) {
  double sum = 0;
  for (const auto& t : triangles) {
    sum += 0.5 * (position[t[1]] - position[t[0]]).cross(position[t[2]] - position[t[0]]).norm();
  }
  return sum;
}

}  // namespace

std::vector<std::uint32_t> rim_of(const Disk& disk) {
  std::set<std::array<std::uint32_t, 2>> halves;
  for (const auto& t : disk.triangle) {
    for (int k = 0; k < 3; ++k) {
      halves.insert({t[k], t[(k + 1) % 3]});
    }
  }
  for (const auto& [a, b] : halves) {
    if (halves.count({b, a}) == 0) {
      return disk_rim(disk.triangle, a);
    }
  }
  return {};
}

std::vector<std::uint32_t> even_middles(const Disk& disk, std::uint32_t count) {
  const std::vector<std::uint32_t> rim = rim_of(disk);
  std::vector<std::uint32_t> middles;
  for (std::uint32_t i = 0; i < count; ++i) {
    middles.push_back(rim[i * rim.size() / count]);
  }
  return middles;
}

Disk ring_disk(std::uint32_t rings, std::uint32_t sectors) {
  Disk disk;
  disk.position.emplace_back(0, 0, 0);
  for (std::uint32_t r = 1; r <= rings; ++r) {
    for (std::uint32_t s = 0; s < sectors; ++s) {
      const exact::SinCos a = exact::sincos(2 * exact::kPi * s / sectors);
      disk.position.emplace_back(a.cos * r / rings, a.sin * r / rings, 0);
    }
  }
  for (std::uint32_t s = 0; s < sectors; ++s) {
    const std::uint32_t t = (s + 1) % sectors;
    disk.triangle.push_back({0, 1 + s, 1 + t});
    for (std::uint32_t r = 0; r + 1 < rings; ++r) {
      const std::uint32_t in = 1 + r * sectors;
      const std::uint32_t out = in + sectors;
      disk.triangle.push_back({in + s, out + s, out + t});
      disk.triangle.push_back({in + s, out + t, in + t});
    }
  }
  return disk;
}

Disk random_disk(std::uint32_t sides, std::uint32_t inside, double folded, double collapsed,
                 Random& random) {
  const auto below = [&](std::size_t n) {
    return std::min(n - 1, static_cast<std::size_t>(random.next() * static_cast<double>(n)));
  };
  Disk disk;
  std::vector<std::uint32_t> polygon;
  for (std::uint32_t i = 0; i < sides; ++i) {
    const exact::SinCos a = exact::sincos(2 * exact::kPi * i / sides);
    disk.position.emplace_back(a.cos, a.sin, 0);
    polygon.push_back(i);
  }
  while (polygon.size() > 2) {
    const std::size_t n = polygon.size();
    const std::size_t ear = below(n);
    disk.triangle.push_back({polygon[(ear + n - 1) % n], polygon[ear], polygon[(ear + 1) % n]});
    polygon.erase(polygon.begin() + static_cast<std::ptrdiff_t>(ear));
  }
  for (std::uint32_t i = 0; i < inside; ++i) {
    const std::size_t t = below(disk.triangle.size());
    const auto [a, b, c] = disk.triangle[t];
    const auto v = static_cast<std::uint32_t>(disk.position.size());
    const double x = 0.05 + random.next();
    const double y = 0.05 + random.next();
    const double z = 0.05 + random.next();
    disk.position.emplace_back(
        (x * disk.position[a] + y * disk.position[b] + z * disk.position[c]) / (x + y + z));
    disk.triangle[t] = {a, b, v};
    disk.triangle.push_back({b, c, v});
    disk.triangle.push_back({c, a, v});
  }
  // Flips whatever the geometry says, as long as no two edges join the same vertices.
  std::map<std::array<std::uint32_t, 2>, std::size_t> triangle_of;
  for (std::size_t t = 0; t < disk.triangle.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      triangle_of[{disk.triangle[t][k], disk.triangle[t][(k + 1) % 3]}] = t;
    }
  }
  for (std::size_t i = 0; i < disk.triangle.size(); ++i) {
    const std::size_t t = below(disk.triangle.size());
    const std::size_t k = below(3);
    const std::array<std::uint32_t, 3> one = disk.triangle[t];
    const std::uint32_t a = one[k];
    const std::uint32_t b = one[(k + 1) % 3];
    const std::uint32_t c = one[(k + 2) % 3];
    const auto beside = triangle_of.find({b, a});
    if (beside == triangle_of.end()) {
      continue;
    }
    const std::size_t u = beside->second;
    std::uint32_t d = 0;
    for (const std::uint32_t v : disk.triangle[u]) {
      d = v != a && v != b ? v : d;
    }
    if (triangle_of.count({c, d}) != 0 || triangle_of.count({d, c}) != 0) {
      continue;
    }
    triangle_of.erase({a, b});
    triangle_of.erase({b, a});
    disk.triangle[t] = {a, d, c};
    disk.triangle[u] = {d, b, c};
    for (const std::size_t f : {t, u}) {
      for (int s = 0; s < 3; ++s) {
        triangle_of[{disk.triangle[f][s], disk.triangle[f][(s + 1) % 3]}] = f;
      }
    }
  }
  for (Vec3d& p : disk.position) {
    for (int k = 0; k < 3; ++k) {
      p[k] += folded * (random.next() - 0.5);
    }
  }
  for (const auto& t : disk.triangle) {
    if (random.next() < collapsed) {
      disk.position[t[0]] = disk.position[t[1]];
    }
  }
  return disk;
}

std::vector<Support> supports(const Disk& disk, const SplitDisk& cut) {
  std::vector<Support> all(disk.position.size());
  for (std::uint32_t v = 0; v < all.size(); ++v) {
    all[v] = {{v}, {1.0}};
  }
  for (const SplitDisk::Made& m : cut.made) {
    std::map<std::uint32_t, double> sum;
    for (const auto& [parent, weight] : {std::pair{m.a, 1.0 - m.share}, std::pair{m.b, m.share}}) {
      for (std::size_t k = 0; k < all.at(parent).vertex.size(); ++k) {
        sum[all[parent].vertex[k]] += weight * all[parent].share[k];
      }
    }
    Support& s = all.emplace_back();
    for (const auto& [v, share] : sum) {
      s.vertex.push_back(v);
      s.share.push_back(share);
    }
  }
  return all;
}

void expect_split(const Disk& disk, const std::vector<std::uint32_t>& middles,
                  const SplitDisk& cut) {
  const std::size_t n = middles.size();
  ASSERT_EQ(cut.position.size(), disk.position.size() + cut.made.size());
  EXPECT_TRUE(std::equal(disk.position.begin(), disk.position.end(), cut.position.begin()));
  for (std::size_t i = 0; i < cut.made.size(); ++i) {
    const SplitDisk::Made& m = cut.made[i];
    ASSERT_LT(std::max(m.a, m.b), disk.position.size() + i);
    ASSERT_GT(m.share, 0.0);
    ASSERT_LT(m.share, 1.0);
    EXPECT_EQ(cut.position[disk.position.size() + i],
              Vec3d((1.0 - m.share) * cut.position[m.a] + m.share * cut.position[m.b]));
  }

  // Every triangle lies in one of the input, and they fill it, the same way round.
  const std::vector<Support> support = supports(disk, cut);
  std::map<std::array<std::uint32_t, 3>, std::size_t> triangle_of;
  std::multimap<std::uint32_t, std::size_t> triangles_at;
  for (std::size_t t = 0; t < disk.triangle.size(); ++t) {
    for (const std::uint32_t v : disk.triangle[t]) {
      triangles_at.emplace(v, t);
    }
  }
  std::vector<double> filled(disk.triangle.size(), 0.0);
  for (const auto& t : cut.triangle) {
    std::set<std::uint32_t> corners;
    for (const std::uint32_t v : t) {
      corners.insert(support.at(v).vertex.begin(), support[v].vertex.end());
    }
    ASSERT_EQ(corners.size(), 3U);
    bool found = false;
    const auto [begin, end] = triangles_at.equal_range(*corners.begin());
    for (auto i = begin; i != end; ++i) {
      const auto& in = disk.triangle[i->second];
      if (std::set<std::uint32_t>(in.begin(), in.end()) != corners) {
        continue;
      }
      Eigen::Matrix3d m = Eigen::Matrix3d::Zero();
      for (int k = 0; k < 3; ++k) {
        const Support& s = support[t[static_cast<std::size_t>(k)]];
        for (std::size_t j = 0; j < s.vertex.size(); ++j) {
          m(k, std::find(in.begin(), in.end(), s.vertex[j]) - in.begin()) = s.share[j];
        }
      }
      EXPECT_GT(m.determinant(), 0.0);
      filled[i->second] += m.determinant();
      found = true;
    }
    EXPECT_TRUE(found);
  }
  for (const double f : filled) {
    EXPECT_NEAR(f, 1.0, 1e-9);
  }
  EXPECT_NEAR(area(cut.position, cut.triangle), area(disk.position, disk.triangle),
              1e-9 * (1.0 + area(disk.position, disk.triangle)));

  const std::vector<std::uint32_t> rim = rim_of(disk);
  ASSERT_EQ(cut.spokes.size(), n);
  std::set<std::uint32_t> used(rim.begin(), rim.end());
  ASSERT_TRUE(used.insert(cut.centre).second);
  for (std::size_t i = 0; i < n; ++i) {
    const auto& spoke = cut.spokes[i];
    ASSERT_GE(spoke.size(), 2U);
    EXPECT_EQ(spoke.front(), cut.centre);
    EXPECT_EQ(spoke.back(), middles[i]);
    for (std::size_t k = 1; k + 1 < spoke.size(); ++k) {
      EXPECT_TRUE(used.insert(spoke[k]).second) << "spoke " << i << " meets something";
    }
  }
  ASSERT_EQ(cut.part_begin.size(), n + 1);
  EXPECT_EQ(cut.part_begin.front(), 0U);
  EXPECT_EQ(cut.part_begin.back(), cut.triangle.size());
  for (std::size_t i = 0; i < n; ++i) {
    ASSERT_LE(cut.part_begin[i], cut.part_begin[i + 1]);
    const Triangles part(cut.triangle.begin() + cut.part_begin[i],
                         cut.triangle.begin() + cut.part_begin[i + 1]);
    const auto& before = cut.spokes[(i + n - 1) % n];
    std::vector<std::uint32_t> expected;
    auto at = std::find(rim.begin(), rim.end(), before.back());
    while (*at != middles[i]) {
      expected.push_back(*at);
      at = at + 1 == rim.end() ? rim.begin() : at + 1;
    }
    expected.insert(expected.end(), cut.spokes[i].rbegin(), cut.spokes[i].rend());
    expected.insert(expected.end(), before.begin() + 1, before.end() - 1);
    EXPECT_EQ(disk_rim(part, before.back()), expected) << "part " << i;
  }
}

double length_of(const SplitDisk& cut, const std::vector<std::uint32_t>& way) {
  double sum = 0;
  for (std::size_t i = 1; i < way.size(); ++i) {
    sum += (cut.position[way[i]] - cut.position[way[i - 1]]).norm();
  }
  return sum;
}

double edge_way(const Disk& disk, const std::vector<std::uint32_t>& middles, const SplitDisk& cut,
                std::size_t i) {
  const std::vector<Support> support = supports(disk, cut);
  std::vector<bool> closed(disk.position.size(), false);
  std::set<std::vector<std::uint32_t>> crossed;
  for (const std::uint32_t v : rim_of(disk)) {
    closed[v] = true;
  }
  for (std::size_t k = 0; k < i; ++k) {
    for (const std::uint32_t v : cut.spokes[k]) {
      if (v < disk.position.size()) {
        closed[v] = true;
      } else {
        crossed.insert(support[v].vertex);
      }
    }
  }
  closed[cut.centre] = false;
  closed[middles[i]] = false;
  std::vector<std::set<std::uint32_t>> beside(disk.position.size());
  for (const auto& t : disk.triangle) {
    for (const std::uint32_t a : t) {
      for (const std::uint32_t b : t) {
        if (a != b && crossed.count({std::min(a, b), std::max(a, b)}) == 0) {
          beside[a].insert(b);
        }
      }
    }
  }
  std::vector<double> distance(disk.position.size(), std::numeric_limits<double>::infinity());
  std::set<std::pair<double, std::uint32_t>> queue{{0.0, cut.centre}};
  distance[cut.centre] = 0;
  while (!queue.empty()) {
    const auto [d, v] = *queue.begin();
    queue.erase(queue.begin());
    for (const std::uint32_t w : beside[v]) {
      const double to = d + (disk.position[w] - disk.position[v]).norm();
      if (!closed[w] && v != middles[i] && to < distance[w]) {
        queue.erase({distance[w], w});
        distance[w] = to;
        queue.emplace(to, w);
      }
    }
  }
  return distance[middles[i]];
}

}  // namespace rattan::testing
