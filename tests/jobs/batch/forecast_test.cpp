// SPDX-License-Identifier: MIT
#include "jobs/batch/forecast.h"

#include <cmath>
#include <cstring>
#include <random>

#include <fmt/format.h>

#include "io/scan/scan_outline.h"
#include "io/scan/scan_reader.h"
#include "tests/jobs/batch/batch_fixture.h"

namespace rattan {
namespace {

/// A grid of n x n squares in all formats.
struct Grid {
  explicit Grid(int side) : n(side) {}
  int n;
  int vertices() const { return (n + 1) * (n + 1); }
  int triangles() const { return 2 * n * n; }
  double height(int i) const { return std::sin(0.37 * i) * 3.0; }

  std::string obj(bool normals, bool texture) const {
    std::string text;
    for (int i = 0; i < vertices(); ++i) {
      text += fmt::format("v {:.6f} {:.6f} {:.6f}\n", 0.1 * (i % (n + 1)), 0.1 * (i / (n + 1)),
                          height(i));
    }
    for (int i = 0; texture && i < vertices(); ++i) {
      text += fmt::format("vt {:.5f} {:.5f}\n", 0.001 * (i % (n + 1)), 0.001 * (i / (n + 1)));
    }
    for (int i = 0; normals && i < vertices(); ++i) {
      text += fmt::format("vn {:.6f} {:.6f} {:.6f}\n", 0.1, 0.2, 0.9);
    }
    const auto corner = [&](int v) {
      return normals && texture ? fmt::format(" {}/{}/{}", v + 1, v + 1, v + 1)
             : normals          ? fmt::format(" {}//{}", v + 1, v + 1)
                                : fmt::format(" {}", v + 1);
    };
    for_triangles([&](int a, int b, int c) {
      text += fmt::format("f{}{}{}\n", corner(a), corner(b), corner(c));
    });
    return text;
  }
  std::string off() const {
    std::string text = fmt::format("OFF\n# a grid\n{} {} 0\n", vertices(), triangles());
    for (int i = 0; i < vertices(); ++i) {
      text += fmt::format("{} {} {}\n", i % (n + 1), i / (n + 1), height(i));
    }
    for_triangles([&](int a, int b, int c) { text += fmt::format("3 {} {} {}\n", a, b, c); });
    return text;
  }
  std::string ply_quads() const {
    std::string text = fmt::format(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float "
        "y\nproperty float z\nelement face {}\nproperty list uchar int "
        "vertex_indices\nend_header\n",
        vertices(), n * n);
    for (int i = 0; i < vertices(); ++i) {
      put(text, static_cast<float>(i % (n + 1)));
      put(text, static_cast<float>(i / (n + 1)));
      put(text, static_cast<float>(height(i)));
    }
    for (int y = 0; y < n; ++y) {
      for (int x = 0; x < n; ++x) {
        const int a = y * (n + 1) + x;
        text += '\4';
        for (const int v : {a, a + 1, a + n + 2, a + n + 1}) {
          put(text, v);
        }
      }
    }
    return text;
  }
  std::string stl(bool binary) const {
    std::string text = binary ? std::string(80, ' ') : "solid grid\n";
    if (binary) {
      put(text, triangles());
    }
    for_triangles([&](int a, int b, int c) {
      if (binary) {
        text += std::string(12, '\0');
      } else {
        text += " facet normal 0 0 1\n  outer loop\n";
      }
      for (const int v : {a, b, c}) {
        if (binary) {
          put(text, static_cast<float>(v % (n + 1)));
          put(text, static_cast<float>(v / (n + 1)));
          put(text, static_cast<float>(height(v)));
        } else {
          text += fmt::format("   vertex {:e} {:e} {:e}\n", 1.0 * (v % (n + 1)),
                              1.0 * (v / (n + 1)), height(v));
        }
      }
      text += binary ? std::string(2, '\0') : "  endloop\n endfacet\n";
    });
    return binary ? text : text + "endsolid grid\n";
  }

  template <class Call>
  void for_triangles(const Call& call) const {
    for (int y = 0; y < n; ++y) {
      for (int x = 0; x < n; ++x) {
        const int a = y * (n + 1) + x;
        call(a, a + 1, a + n + 2);
        call(a, a + n + 2, a + n + 1);
      }
    }
  }
  template <class T>
  static void put(std::string& text, T value) {
    char bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof(T));
    text.append(bytes, sizeof(T));
  }
};

class ForecastTest : public BatchFixture {};

TEST_F(ForecastTest, CountsWhatHeadersCount) {
  const Grid grid(60);
  for (const auto& [name, text] :
       {std::pair("a.off", grid.off()), {"a.ply", grid.ply_quads()}, {"a.stl", grid.stl(true)}}) {
    const ScanOutline scan = outline_scan(write(name, text));
    EXPECT_TRUE(scan.counted) << name;
    EXPECT_NEAR(scan.triangles, grid.triangles(), 0.5) << name;
  }
}

TEST_F(ForecastTest, EstimatesTheRestWithinAQuarter) {
  for (const int n : {10, 40, 200}) {
    const Grid grid(n);
    for (const auto& [name, text] : {std::pair("a.obj", grid.obj(false, false)),
                                     {"n.obj", grid.obj(true, false)},
                                     {"t.obj", grid.obj(true, true)},
                                     {"t.stl", grid.stl(false)}}) {
      const ScanOutline scan = outline_scan(write(name, text));
      EXPECT_FALSE(scan.counted);
      EXPECT_NEAR(scan.triangles, grid.triangles(), 0.25 * grid.triangles()) << name << " " << n;
    }
  }
}

TEST_F(ForecastTest, BelievesNoHeaderThatTheFileIsTooSmallFor) {
  const std::string header =
      "ply\nformat ascii 1.0\nelement vertex 4000000000000\nproperty float x\nproperty float y\n"
      "property float z\nelement face 9000000000000000\nproperty list uchar int "
      "vertex_indices\nend_header\n0 0 0\n";
  EXPECT_LT(outline_scan(write("a.ply", header)).triangles, 1000.0);
  EXPECT_LT(outline_scan(write("a.off", "OFF\n999999999999 999999999999 0\n")).triangles, 1000.0);
}

TEST_F(ForecastTest, TakesAnyBytesForAScan) {
  std::mt19937 random(5);
  const Grid grid(8);
  const std::string good[] = {grid.off(),           grid.ply_quads(),
                              grid.stl(true),       grid.stl(false),
                              grid.obj(true, true), std::string("DRACO\2\2\1\1\0\0\0\x88\x27", 14)};
  const char* names[] = {"x.off", "x.ply", "x.stl", "x.obj", "x.drc", "x.ply.gz", "x"};
  for (int round = 0; round < 600; ++round) {
    std::string text = good[random() % std::size(good)];
    text.resize(random() % (text.size() + 1));
    for (std::size_t k = random() % 4; k > 0 && !text.empty(); --k) {
      text[random() % text.size()] = static_cast<char>(random());
    }
    const ScanOutline scan = outline_scan(write(names[random() % std::size(names)], text));
    EXPECT_GE(scan.triangles, 0.0);
    EXPECT_LE(scan.triangles, 60.0 * static_cast<double>(text.size()) + 1000.0);
    EXPECT_GE(scan.vertices, 0.0);
  }
  EXPECT_EQ(outline_scan(path("nothing")).triangles, 0.0);
  EXPECT_EQ(outline_scan(folder_).triangles, 0.0);
}

TEST_F(ForecastTest, MoreTrianglesOrFacesCostMore) {
  RemeshOptions options;
  options.size_kind = SizeKind::kFaces;
  options.sizes = {1000};
  const Grid small(20);
  const Grid large(200);
  const Forecast a = forecast(item("a.drc", write("a.off", small.off()), options));
  const Forecast b = forecast(item("b.drc", write("b.off", large.off()), options));
  EXPECT_LT(a.cpu_seconds, b.cpu_seconds);
  EXPECT_LT(a.least_memory, b.least_memory);
  EXPECT_LT(b.least_memory, b.good_memory);
  options.sizes = {1e6, 2e6};
  const Forecast c = forecast(item("b.drc", path("b.off"), options));
  EXPECT_GT(c.least_memory, b.least_memory + (std::uint64_t{1} << 30));
  EXPECT_EQ(c.faces, 2e6);
  EXPECT_LT(forecast_seconds(c, 4), forecast_seconds(c, 1));
  BatchItem stated = item("b.drc", path("b.off"), options);
  stated.cost = 77.0;
  EXPECT_EQ(forecast(stated).cpu_seconds, 77.0);
}

}  // namespace
}  // namespace rattan
