// SPDX-License-Identifier: MIT
#include "io/synth/synth.h"

#include <cmath>
#include <cstdio>
#include <filesystem>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "engine/core/errors.h"
#include "tests/io/scan/scan_files.h"
#include "tests/io/synth/mesh_topology.h"

namespace rattan {
namespace {

using testing::CollectedScan;
using testing::TemporaryFile;

struct Made {
  CollectedScan scan;
  ScanFileInfo info;
  SynthResult result;
};

Made make(const SynthOptions& options) {
  const TemporaryFile file("synth.ply");
  NullProgress progress;
  Made made;
  made.info.want_sha256 = true;
  made.result = synthesise(options, file.path(), progress);
  read_scan(file.path(), made.scan, &made.info);
  EXPECT_FALSE(std::filesystem::exists(file.path() + ".part"));
  return made;
}

void expect_topology(const SynthOptions& options) {
  SCOPED_TRACE("triangles " + std::to_string(options.triangles) + " genus " +
               std::to_string(options.genus) + " holes " + std::to_string(options.holes));
  const Made made = make(options);
  EXPECT_EQ(made.result.vertices, made.scan.vertices.size());
  EXPECT_EQ(made.result.triangles, made.scan.triangles.size());
  EXPECT_NEAR(static_cast<double>(made.result.triangles), static_cast<double>(options.triangles),
              std::max(1.0, 0.01 * static_cast<double>(options.triangles)));
  const testing::MeshTopology topology =
      testing::count_topology(made.scan.vertices.size(), made.scan.triangles);
  EXPECT_TRUE(topology.is_manifold);
  EXPECT_TRUE(topology.is_simple);
  EXPECT_EQ(topology.components, 1U);
  EXPECT_EQ(topology.unused_vertices, 0U);
  EXPECT_EQ(topology.boundary_loops, static_cast<std::uint64_t>(options.holes));
  EXPECT_EQ(topology.euler, 2 - 2 * options.genus - options.holes);
}

TEST(Synth, HasTheTopologyAskedFor) {
  for (const int genus : {0, 1, 2, 5, 20}) {
    for (const int holes : {0, 3}) {
      for (const std::uint64_t triangles : {2000U, 9001U, 50000U}) {
        expect_topology({triangles, 1, genus, 0.1, holes});
      }
    }
  }
}

TEST(Synth, MakesTheSmallestScans) {
  for (std::uint64_t triangles = 12; triangles < 120; ++triangles) {
    expect_topology({triangles, triangles, 0, 0.1, 0});
  }
  for (std::uint64_t triangles = 48; triangles < 400; triangles += 7) {
    expect_topology({triangles, triangles, 1, 0.1, 0});
  }
  expect_topology({76, 3, 2, 0.1, 0});
  expect_topology({816, 3, 20, 0.1, 0});
}

TEST(Synth, MakesManyHoles) {
  expect_topology({60000, 5, 0, 0.1, 100});
  expect_topology({60000, 5, 3, 0.1, 40});
}

TEST(Synth, IsReproducible) {
  const Made a = make({20000, 7, 2, 0.1, 2});
  EXPECT_EQ(a.info.sha256, make({20000, 7, 2, 0.1, 2}).info.sha256);
  EXPECT_NE(a.info.sha256, make({20000, 8, 2, 0.1, 2}).info.sha256);
  EXPECT_NE(a.info.sha256, make({20000, 7, 2, 0.2, 2}).info.sha256);
  // The bits of a build for any x86-64 machine; changes only with the generator.
  EXPECT_EQ(make({5000, 1, 0, 0.1, 0}).info.sha256,
            "68baacc30de1aff336844df2b2e88d6eb086ba1fdf374ffb5d399ce84d949716");
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

double quantile(std::vector<double> values, double share) {
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

class SynthLooks : public ::testing::TestWithParam<int> {};

TEST_P(SynthLooks, LikeARealScan) {
  const Made made = make({60000, 1, GetParam(), 0.1, 0});
  const auto& v = made.scan.vertices;
  const auto& t = made.scan.triangles;
  std::vector<int> valence(v.size(), 0);
  std::vector<double> lengths, areas, aspects;
  std::vector<Vec3d> normals;
  double volume = 0.0;
  for (const auto& c : t) {
    double longest = 0.0;
    for (std::size_t k = 0; k < 3; ++k) {
      ++valence[c[k]];
      lengths.push_back((v[c[k]] - v[c[(k + 1) % 3]]).norm());
      longest = std::max(longest, lengths.back());
    }
    const Vec3d n = (v[c[1]] - v[c[0]]).cross(v[c[2]] - v[c[0]]);
    areas.push_back(0.5 * n.norm());
    aspects.push_back(longest * longest / (2.0 * areas.back()));
    normals.push_back(n.normalized());
    volume += v[c[0]].dot(v[c[1]].cross(v[c[2]])) / 6.0;
  }
  EXPECT_GT(volume, 0.0) << "normals point outwards";

  const double six = static_cast<double>(std::count(valence.begin(), valence.end(), 6)) /
                     static_cast<double>(v.size());
  const double median_area = median(areas);
  const double length_ratio = quantile(lengths, 0.95) / quantile(lengths, 0.05);
  const double area_ratio = quantile(areas, 0.95) / quantile(areas, 0.05);

  // Angles between neighbours, over edges found by sorting.
  std::vector<std::pair<std::array<std::uint64_t, 2>, std::size_t>> sides;
  for (std::size_t k = 0; k < t.size(); ++k) {
    for (std::size_t e = 0; e < 3; ++e) {
      const std::uint64_t a = t[k][e];
      const std::uint64_t b = t[k][(e + 1) % 3];
      sides.push_back({{std::min(a, b), std::max(a, b)}, k});
    }
  }
  std::sort(sides.begin(), sides.end());
  std::vector<double> bends;
  for (std::size_t k = 0; k + 1 < sides.size(); k += 2) {
    const double cosine = normals[sides[k].second].dot(normals[sides[k + 1].second]);
    bends.push_back(std::acos(std::clamp(cosine, -1.0, 1.0)) * 180.0 / 3.14159265358979);
  }
  std::printf(
      "genus %d: valence 6 %.1f %%, edges 95/5 %.2f, areas 95/5 %.2f, aspect median %.2f 99 %% "
      "%.1f, bend median %.1f 90 %% %.1f 99.9 %% %.1f max %.1f degrees\n",
      GetParam(), 100.0 * six, length_ratio, area_ratio, median(aspects), quantile(aspects, 0.99),
      median(bends), quantile(bends, 0.9), quantile(bends, 0.999), quantile(bends, 1.0));
  EXPECT_LT(six, 0.6);
  EXPECT_GT(length_ratio, 3.0);
  EXPECT_GT(area_ratio, 4.0);
  EXPECT_GT(quantile(areas, 0.0), 1e-4 * median_area);
  EXPECT_LT(quantile(aspects, 0.99), 20.0);
  EXPECT_GT(median(bends), 3.0);            // rough all over
  EXPECT_LT(median(bends), 25.0);           // but a surface
  EXPECT_GT(quantile(bends, 0.999), 25.0);  // with creases
  EXPECT_LT(quantile(bends, 0.999), 90.0);  // and hardly a triangle turned over
}

INSTANTIATE_TEST_SUITE_P(Genus, SynthLooks, ::testing::Values(0, 1, 5));

TEST(Synth, MixesTheOrder) {
  // Neighbouring triangles of the file mostly touch, but it jumps about often.
  const Made made = make({60000, 1, 0, 0.1, 0});
  const auto& v = made.scan.vertices;
  const auto& t = made.scan.triangles;
  std::size_t jumps = 0;
  for (std::size_t k = 1; k < t.size(); ++k) {
    jumps += static_cast<std::size_t>((v[t[k][0]] - v[t[k - 1][0]]).norm() > 20.0);
  }
  EXPECT_GT(jumps, t.size() / 500);
  EXPECT_LT(jumps, t.size() / 20);
}

TEST(Synth, RefusesTheImpossible) {
  const TemporaryFile file("refused.ply");
  NullProgress progress;
  for (const SynthOptions& options :
       {SynthOptions{11}, SynthOptions{9000000000U}, SynthOptions{100, 1, 20},
        SynthOptions{1000, 1, -1}, SynthOptions{1000, 1, 0, -0.5},
        SynthOptions{1000, 1, 0, 0.1, -1}, SynthOptions{100, 1, 0, 0.1, 50}}) {
    EXPECT_THROW(synthesise(options, file.path(), progress), UsageError);
  }
  EXPECT_THROW(synthesise({1000}, "/nonexistent/scan.ply", progress), UsageError);
}

}  // namespace
}  // namespace rattan
