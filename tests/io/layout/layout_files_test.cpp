// SPDX-License-Identifier: MIT
// Layouts through every format and back: by the readers of scans and remeshes, and by the stock
// decoder.

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <map>
#include <set>
#include <sstream>
#include <utility>

#include <gtest/gtest.h>

#include "engine/core/errors.h"
#include "io/file/atomic_file.h"
#include "io/layout/layout_writer.h"
#include "io/remesh/remesh_reader.h"
#include "io/remesh/remesh_writer.h"
#include "io/scan/scan_reader.h"
#include "tests/engine/layout/polygon_layout.h"
#include "tests/io/test_meshes.h"

namespace rattan {
namespace {

using testing::PolygonLayout;
using testing::PolygonLayoutOptions;
using testing::ScratchDirectory;

RemeshMetadata some_metadata() {
  RemeshMetadata m;
  m.version = "9.8.7";
  m.options = "--chart-size 3";
  m.input_hash = "abcdef";
  return m;
}

/// A textured OBJ file, by its words.
struct TexturedObj {
  std::vector<Vec3d> positions;
  std::vector<Vec3d> colours;
  std::vector<Vec2d> uv;
  std::vector<std::array<std::uint32_t, 3>> vertex;   // a face
  std::vector<std::array<std::uint32_t, 3>> texture;  // a face
  std::vector<std::string> group;                     // a face
  std::vector<std::string> other;                     // lines

  explicit TexturedObj(const std::string& path) {
    std::ifstream file(path);
    std::string line;
    std::string current;
    while (std::getline(file, line)) {
      std::istringstream words(line);
      std::string kind;
      words >> kind;
      if (kind == "v") {
        Vec3d p;
        words >> p[0] >> p[1] >> p[2];
        positions.push_back(p);
        if (words >> p[0] >> p[1] >> p[2]) {
          colours.push_back(p);
        }
      } else if (kind == "vt") {
        Vec2d p;
        words >> p[0] >> p[1];
        uv.push_back(p);
      } else if (kind == "g") {
        words >> current;
      } else if (kind == "f") {
        vertex.emplace_back();
        texture.emplace_back();
        for (std::size_t k = 0; k < 3; ++k) {
          char slash = 0;
          words >> vertex.back()[k] >> slash >> texture.back()[k];
          --vertex.back()[k];
          --texture.back()[k];
        }
        group.push_back(current);
      } else {
        other.push_back(line);
      }
    }
  }
};

double area(const Vec2d& a, const Vec2d& b, const Vec2d& c) {
  return 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
}

struct Surface {
  long euler = 0;
  std::size_t boundary = 0;  // edges
  friend bool operator==(const Surface&, const Surface&) = default;
};

Surface surface_of(std::size_t vertices, const std::vector<std::array<std::uint32_t, 3>>& faces) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> uses;
  for (const auto& f : faces) {
    for (std::size_t k = 0; k < 3; ++k) {
      ++uses[std::minmax(f[k], f[(k + 1) % 3])];
    }
  }
  Surface out;
  for (const auto& [edge, n] : uses) {
    EXPECT_LE(n, 2);
    out.boundary += n == 1 ? 1 : 0;
  }
  out.euler = static_cast<long>(vertices) - static_cast<long>(uses.size()) +
              static_cast<long>(faces.size());
  return out;
}

Surface surface_of(PolygonLayout& layout) {
  std::vector<std::array<std::uint32_t, 3>> faces;
  layout.for_each_chart([&](const LayoutChart& chart) {
    for (const auto& t : chart.triangle) {
      faces.push_back({static_cast<std::uint32_t>(chart.vertex[t[0]]),
                       static_cast<std::uint32_t>(chart.vertex[t[1]]),
                       static_cast<std::uint32_t>(chart.vertex[t[2]])});
    }
  });
  return surface_of(layout.positions.size(), faces);
}

class CountingSink : public ScanSink {
 public:
  void add_vertices(std::span<const Vec3d> p) override {
    positions.insert(positions.end(), p.begin(), p.end());
  }
  void add_colours(std::span<const Rgba> c) override {
    colours.insert(colours.end(), c.begin(), c.end());
  }
  void add_triangles(std::span<const std::array<std::uint64_t, 3>> t) override {
    for (const auto& [a, b, c] : t) {
      triangles.push_back({static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b),
                           static_cast<std::uint32_t>(c)});
    }
  }
  std::vector<Vec3d> positions;
  std::vector<Rgba> colours;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

class EveryLayoutFormat : public ::testing::TestWithParam<const char*> {};

TEST_P(EveryLayoutFormat, IsReadAsAScanAndAsARemesh) {
  const ScratchDirectory scratch;
  PolygonLayoutOptions options;
  options.warp = 0.07;
  for (const bool colours : {false, true}) {
    options.colours = colours;
    for (const auto& [name, mesh] : testing::polygon_meshes()) {
      SCOPED_TRACE(name);
      PolygonLayout layout(mesh, options);
      const std::string path = scratch.file(name + std::string(GetParam()));
      LayoutWriteResult result;
      ASSERT_NO_THROW(result = write_layout(layout, some_metadata(), path));
      EXPECT_EQ(result.bytes, std::filesystem::file_size(path));
      EXPECT_EQ(result.folded, 0U);
      const LayoutSize size = layout.size();
      const Surface meant = surface_of(layout);
      CountingSink scan;
      read_scan(path, scan);
      EXPECT_EQ(scan.positions.size(), size.vertices);
      EXPECT_EQ(scan.triangles.size(), size.triangles);
      EXPECT_EQ(scan.colours.size(), colours ? size.vertices : 0);
      EXPECT_EQ(surface_of(scan.positions.size(), scan.triangles), meant);
      const PolygonMesh remesh = read_polygons(path);
      EXPECT_EQ(remesh.vertex_count(), size.vertices);
      EXPECT_EQ(remesh.face_count(), size.triangles);
      if (std::string(GetParam()) != ".drc") {
        EXPECT_EQ(scan.positions, layout.positions);
        EXPECT_EQ(scan.colours, layout.colours);
      }
    }
  }
}

TEST_P(EveryLayoutFormat, WritesTheSameBytesTwice) {
  const ScratchDirectory scratch;
  PolygonLayoutOptions options;
  PolygonLayout a(testing::polygon_torus(8, 6, 5), options);
  options.vertices_at_once = 1000;
  PolygonLayout b(testing::polygon_torus(8, 6, 5), options);
  write_layout(a, some_metadata(), scratch.file(std::string("a") + GetParam()));
  write_layout(b, some_metadata(), scratch.file(std::string("b") + GetParam()));
  EXPECT_EQ(read_file(scratch.file(std::string("a") + GetParam())),
            read_file(scratch.file(std::string("b") + GetParam())));
}

TEST_P(EveryLayoutFormat, KeepsFarPositions) {
  const ScratchDirectory scratch;
  PolygonLayout layout(testing::polygon_grid(5, 4));
  RemeshMetadata metadata = some_metadata();
  metadata.origin = Vec3d(3.5e6 + 0.123456789, -5.1e6 + 0.3, 412.25);
  LayoutWriteOptions options;
  options.unit = 0.25;
  const std::string path = scratch.file(std::string("far") + GetParam());
  const LayoutWriteResult result = write_layout(layout, metadata, path, options);
  CountingSink scan;
  read_scan(path, scan);
  ASSERT_EQ(scan.positions.size(), layout.positions.size());
  for (const Vec3d& p : layout.positions) {
    double nearest = 1e9;
    for (const Vec3d& q : scan.positions) {
      nearest = std::min(nearest, (q - p * 0.25 - metadata.origin).cwiseAbs().maxCoeff());
    }
    EXPECT_LE(nearest, result.position_bound + 2e-9);
  }
  EXPECT_LE(result.position_bound, 1e-4);
}

TEST_P(EveryLayoutFormat, LeavesNothingAfterDamage) {
  const ScratchDirectory scratch;
  const std::string path = scratch.file(std::string("damaged") + GetParam());
  std::ofstream(path) << "older";
  PolygonLayout layout(testing::polygon_prism(5));
  // Every byte in turn would take long; some of each part of the file.
  const LayoutWriteResult whole =
      write_layout(layout, some_metadata(), scratch.file(std::string("whole") + GetParam()));
  const std::string bytes = read_file(scratch.file(std::string("whole") + GetParam()));
  std::size_t refused = 0;
  std::size_t tried = 0;
  for (std::size_t at = 0; at < whole.bytes; at += 1 + whole.bytes / 97) {
    LayoutWriteOptions options;
    options.before_verify = [&](const std::string& temporary) {
      std::fstream file(temporary, std::ios::in | std::ios::out | std::ios::binary);
      file.seekp(static_cast<std::streamoff>(at));
      file.put(static_cast<char>(bytes[at] ^ 1));
    };
    ++tried;
    try {
      write_layout(layout, some_metadata(), path, options);
    } catch (const std::exception&) {
      ++refused;
      EXPECT_EQ(read_file(path), "older");
    }
    std::ofstream(path) << "older";
  }
  // Comments of an OBJ, names in a Draco file's metadata may change.
  EXPECT_GT(refused, tried * 8 / 10);
  LayoutWriteOptions cut;
  cut.before_verify = [&](const std::string& temporary) {
    std::filesystem::resize_file(temporary, bytes.size() * 2 / 3);
  };
  EXPECT_ANY_THROW(write_layout(layout, some_metadata(), path, cut));
  LayoutWriteOptions longer;
  longer.before_verify = [&](const std::string& temporary) {
    std::ofstream(temporary, std::ios::app) << "f 1/1 2/2 3/3\n";
  };
  if (std::string(GetParam()) != ".drc") {  // which ends where its decoder stops
    EXPECT_THROW(write_layout(layout, some_metadata(), path, longer), InternalError);
  }
  EXPECT_EQ(read_file(path), "older");
  EXPECT_EQ(scratch.names().size(), 2U);
}

TEST_P(EveryLayoutFormat, LetsTheSourceStop) {
  struct Stopping : PolygonLayout {
    using PolygonLayout::PolygonLayout;
    void for_each_chart(const std::function<void(const LayoutChart&)>& f) override {
      PolygonLayout::for_each_chart([&](const LayoutChart& chart) {
        if (chart.chart == 3) {
          throw Cancelled("stopped");
        }
        f(chart);
      });
    }
  };
  const ScratchDirectory scratch;
  Stopping layout(testing::polygon_cube());
  EXPECT_THROW(write_layout(layout, {}, scratch.file(std::string("x") + GetParam())), Cancelled);
  EXPECT_TRUE(scratch.names().empty());
}

INSTANTIATE_TEST_SUITE_P(Layouts, EveryLayoutFormat, ::testing::Values(".obj", ".ply", ".drc"),
                         [](const auto& format) { return std::string(format.param).substr(1); });

TEST(LayoutObj, HoldsEveryCornerExactly) {
  const ScratchDirectory scratch;
  PolygonLayoutOptions options;
  options.warp = 0.1;
  options.colours = true;
  PolygonLayout layout(testing::polygon_torus(6, 5, 4), options);
  LayoutWriteOptions write;
  write.material_file = "my layout.mtl";
  write.material = "atlas";
  write_layout(layout, some_metadata(), scratch.file("a.obj"), write);
  const TexturedObj obj(scratch.file("a.obj"));
  EXPECT_EQ(obj.positions, layout.positions);
  ASSERT_EQ(obj.colours.size(), layout.colours.size());
  for (std::size_t v = 0; v < obj.colours.size(); ++v) {
    for (int c = 0; c < 3; ++c) {
      EXPECT_EQ(std::lround(obj.colours[v][c] * 255),
                layout.colours[v][static_cast<std::size_t>(c)]);
    }
  }
  EXPECT_EQ(obj.other[0], "# rattan 9.8.7");
  EXPECT_EQ(std::count(obj.other.begin(), obj.other.end(), "mtllib my layout.mtl"), 1);
  EXPECT_EQ(std::count(obj.other.begin(), obj.other.end(), "usemtl atlas"), 1);
  EXPECT_EQ(std::count(obj.other.begin(), obj.other.end(), "# chart side 2"), 1);
  std::size_t face = 0;
  layout.for_each_chart([&](const LayoutChart& chart) {
    for (std::size_t part = 0; part + 1 < chart.part_begin.size(); ++part) {
      std::string group = "chart_" + std::to_string(chart.chart);
      group += chart.part_begin.size() > 2 ? "_part_" + std::to_string(part) : "";
      for (std::size_t t = chart.part_begin[part]; t < chart.part_begin[part + 1]; ++t, ++face) {
        EXPECT_EQ(obj.group[face], group);
        for (std::size_t k = 0; k < 3; ++k) {
          const std::uint32_t v = chart.triangle[t][k];
          EXPECT_EQ(obj.vertex[face][k], chart.vertex[v]);
          EXPECT_EQ(obj.uv[obj.texture[face][k]], chart.uv[v]);
        }
      }
    }
  });
  EXPECT_EQ(face, obj.vertex.size());
  EXPECT_EQ(obj.uv.size(), layout.size().texture_vertices);
}

TEST(LayoutPly, HasTextureCoordinatesChartsAndParts) {
  const ScratchDirectory scratch;
  PolygonLayout layout(testing::polygon_prism(3));
  LayoutWriteOptions write;
  write.image_file = "bake.png";
  const auto header = [&] {
    const std::string bytes = read_file(scratch.file("a.ply"));
    return bytes.substr(0, bytes.find("end_header\n") + 11);
  };
  write_layout(layout, some_metadata(), scratch.file("a.ply"), write);
  for (const char* line :
       {"format binary_little_endian 1.0\n", "comment TextureFile bake.png\n",
        "property list uchar int vertex_indices\nproperty list uchar float texcoord\n"
        "property int chart\nproperty int part\n"}) {
    EXPECT_NE(header().find(line), std::string::npos) << line;
  }
  const std::string bytes = read_file(scratch.file("a.ply"));
  const LayoutSize size = layout.size();
  const std::size_t record = 1 + 3 * 4 + 1 + 6 * 4 + 8;
  ASSERT_EQ(bytes.size(), header().size() + size.vertices * 24 + size.triangles * record);
  const char* at = bytes.data() + header().size() + size.vertices * 24;
  layout.for_each_chart([&](const LayoutChart& chart) {
    for (std::uint32_t part = 0; part + 1 < chart.part_begin.size(); ++part) {
      for (std::size_t t = chart.part_begin[part]; t < chart.part_begin[part + 1]; ++t) {
        for (std::size_t k = 0; k < 3; ++k) {
          const std::uint32_t v = chart.triangle[t][k];
          std::uint32_t vertex = 0;
          float uv[2];
          std::memcpy(&vertex, at + 1 + 4 * k, 4);
          std::memcpy(uv, at + 14 + 8 * k, 8);
          EXPECT_EQ(vertex, chart.vertex[v]);
          EXPECT_EQ(uv[0], static_cast<float>(chart.uv[v][0]));
          EXPECT_EQ(uv[1], static_cast<float>(chart.uv[v][1]));
        }
        std::uint32_t numbers[2];
        std::memcpy(numbers, at + 38, 8);
        EXPECT_EQ(numbers[0], chart.chart);
        EXPECT_EQ(numbers[1], chart.first_part + part);
        at += record;
      }
    }
  });
  // Two texture vertices that float32 cannot tell apart.
  layout.charts[0].uv[1][0] = layout.charts[0].uv[2][0] - 1e-12;
  const LayoutWriteResult wide = write_layout(layout, {}, scratch.file("a.ply"));
  EXPECT_NE(header().find("property list uchar double texcoord"), std::string::npos);
  EXPECT_EQ(wide.folded, 0U);
}

/// The stock decoder's OBJ against what was meant: surface, charts' disks, texture coordinates.
void expect_stock_decode(PolygonLayout& layout, const ScratchDirectory& scratch,
                         const LayoutWriteResult& result) {
  ASSERT_EQ(std::system(("draco_decoder -i " + scratch.file("m.drc") + " -o " +
                         scratch.file("m.obj") + " >/dev/null")
                            .c_str()),
            0);
  const TexturedObj obj(scratch.file("m.obj"));
  const LayoutSize size = layout.size();
  EXPECT_EQ(obj.positions.size(), size.vertices);
  EXPECT_EQ(obj.uv.size(), size.texture_vertices);
  ASSERT_EQ(obj.vertex.size(), size.triangles);
  EXPECT_EQ(surface_of(obj.positions.size(), obj.vertex), surface_of(layout));
  // Texture vertices alone are the parts: disks.
  const Surface parts = surface_of(obj.uv.size(), obj.texture);
  EXPECT_EQ(parts.euler, static_cast<long>(size.parts));
  const double step = result.texture_step > 0.0 ? result.texture_step : 1e-6;
  for (const auto& t : obj.texture) {
    EXPECT_GT(area(obj.uv[t[0]], obj.uv[t[1]], obj.uv[t[2]]), 0.0);
  }
  // As sets: the stock decoder renumbers, and prints six decimals.
  std::vector<std::pair<double, double>> meant;
  std::vector<std::pair<double, double>> read;
  layout.for_each_chart([&](const LayoutChart& chart) {
    for (const Vec2d& p : chart.uv) {
      meant.emplace_back(std::nearbyint(p[0] / step) * step, std::nearbyint(p[1] / step) * step);
    }
  });
  for (const Vec2d& p : obj.uv) {
    read.emplace_back(std::nearbyint(p[0] / step) * step, std::nearbyint(p[1] / step) * step);
  }
  std::sort(meant.begin(), meant.end());
  std::sort(read.begin(), read.end());
  EXPECT_EQ(meant, read);
}

TEST(LayoutDraco, ComesBackWholeFromTheStockDecoder) {
  if (std::system("command -v draco_decoder >/dev/null 2>&1") != 0) {
    GTEST_SKIP() << "draco_decoder (package draco) is not installed: NOT compared";
  }
  const ScratchDirectory scratch;
  PolygonLayoutOptions options;
  options.warp = 0.08;
  for (const bool colours : {false, true}) {
    options.colours = colours;
    for (const auto& [name, mesh] : testing::polygon_meshes()) {
      SCOPED_TRACE(name);
      PolygonLayout layout(mesh, options);
      expect_stock_decode(layout, scratch,
                          write_layout(layout, some_metadata(), scratch.file("m.drc")));
    }
  }
  for (int speed = 0; speed <= 5; ++speed) {
    SCOPED_TRACE(speed);
    PolygonLayout layout(testing::polygon_torus(12, 9, 5), options);
    LayoutWriteOptions write;
    write.draco_speed = speed;
    write.position_bits = speed % 2 == 0 ? 24 : 11;
    expect_stock_decode(layout, scratch,
                        write_layout(layout, some_metadata(), scratch.file("m.drc"), write));
  }
}

/// Thins the row of cells beside side 0 of chart 0 to `thickness`.
PolygonLayout thin_layout(double thickness) {
  PolygonLayoutOptions options;
  options.cells = 6;
  PolygonLayout layout(testing::polygon_grid(3, 3), options);
  for (Vec2d& p : layout.charts[0].uv) {
    if (p[1] > 0.1 && p[1] < 0.2 && p[0] > 0.0 && p[0] < 1.0) {
      p[1] = thickness * (1.0 + p[0]);
    }
  }
  return layout;
}

TEST(LayoutDraco, FoldsNothingHoweverThin) {
  const ScratchDirectory scratch;
  double last = 1.0;
  for (const double thickness : {1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-9}) {
    SCOPED_TRACE(thickness);
    PolygonLayout layout = thin_layout(thickness);
    const LayoutWriteResult result =
        write_layout(layout, some_metadata(), scratch.file("thin.drc"));
    EXPECT_EQ(result.folded, 0U);
    EXPECT_LE(result.texture_step, last);
    if (thickness > 1e-3) {
      EXPECT_EQ(result.texture_step, std::ldexp(1.0, -12));
    } else if (thickness > 1e-6) {
      EXPECT_LT(result.texture_step, 2 * thickness);
      EXPECT_GT(result.texture_step, 0.2 * thickness);
    } else if (thickness < 1e-8) {
      EXPECT_EQ(result.texture_step, 0.0);  // float32
    }
    last = result.texture_step;
  }
  // A triangle that is folded to begin with is counted, not hidden.
  PolygonLayout folded = thin_layout(0.1);
  std::swap(folded.charts[4].triangle[5][0], folded.charts[4].triangle[5][1]);
  for (const char* name : {"folded.obj", "folded.ply"}) {
    EXPECT_EQ(write_layout(folded, {}, scratch.file(name)).folded, 1U) << name;
  }
}

/// Beside each other after rounding, too: the grid is mapped onto itself.
TEST(LayoutDraco, KeepsTransitionsExact) {
  if (std::system("command -v draco_decoder >/dev/null 2>&1") != 0) {
    GTEST_SKIP() << "draco_decoder (package draco) is not installed: NOT compared";
  }
  const ScratchDirectory scratch;
  PolygonLayoutOptions options;
  options.warp = 0.1;
  for (const std::uint32_t every : {0U, 4U}) {
    PolygonLayout layout(testing::polygon_torus(7, 5, every), options);
    const LayoutWriteResult result = write_layout(layout, {}, scratch.file("m.drc"));
    ASSERT_GT(result.texture_step, 0.0);
    ASSERT_EQ(std::system(("draco_decoder -i " + scratch.file("m.drc") + " -o " +
                           scratch.file("m.obj") + " >/dev/null")
                              .c_str()),
              0);
    const TexturedObj obj(scratch.file("m.obj"));
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::pair<Vec2d, Vec2d>> sides;
    const auto exact = [&](std::uint32_t t) {
      return Vec2d(std::nearbyint(obj.uv[t][0] / result.texture_step),
                   std::nearbyint(obj.uv[t][1] / result.texture_step));
    };
    for (std::size_t f = 0; f < obj.vertex.size(); ++f) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t l = (k + 1) % 3;
        sides[{obj.vertex[f][k], obj.vertex[f][l]}] = {exact(obj.texture[f][k]),
                                                       exact(obj.texture[f][l])};
      }
    }
    const double unit = 1.0 / result.texture_step;
    for (const auto& [edge, ends] : sides) {
      const auto other = sides.find({edge.second, edge.first});
      ASSERT_NE(other, sides.end());
      const auto& [b1, b0] = other->second;
      bool found = false;
      for (int turn = 0; turn < 4; ++turn) {
        Vec2d p = ends.first;
        Vec2d q = ends.second;
        for (int i = 0; i < turn; ++i) {
          p = Vec2d(-p[1], p[0]);
          q = Vec2d(-q[1], q[0]);
        }
        const Vec2d shift = b0 - p;
        found = found || (q + shift == b1 && std::remainder(shift[0], unit) == 0.0 &&
                          std::remainder(shift[1], unit) == 0.0);
      }
      EXPECT_TRUE(found) << edge.first << " " << edge.second;
    }
  }
}

TEST(LayoutWriter, RefusesWhatItCannotWrite) {
  const ScratchDirectory scratch;
  PolygonLayout layout(testing::polygon_cube());
  EXPECT_THROW(write_layout(layout, {}, scratch.file("a.off")), UsageError);
  EXPECT_THROW(check_layout_output("a"), UsageError);
  EXPECT_NO_THROW(check_layout_output("a.DRC"));
  LayoutWriteOptions options;
  options.position_bits = 30;
  EXPECT_THROW(write_layout(layout, {}, scratch.file("a.drc"), options), UsageError);
  EXPECT_THROW(write_layout(layout, {}, scratch.file("none/a.obj")), InputError);
  for (const char* name : {"a.obj", "a.ply", "a.drc"}) {
    SCOPED_TRACE(name);
    PolygonLayout wrong(testing::polygon_cube());
    wrong.charts[2].number[1] = 1000;
    EXPECT_THROW(write_layout(wrong, {}, scratch.file(name)), std::logic_error);
    wrong = PolygonLayout(testing::polygon_cube());
    wrong.charts[2].uv[1][0] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THROW(write_layout(wrong, {}, scratch.file(name)), InternalError);
    wrong = PolygonLayout(testing::polygon_prism(3));
    wrong.charts.back().triangle[0][0] = wrong.charts.back().part_uv_begin[1];
    EXPECT_THROW(write_layout(wrong, {}, scratch.file(name)), InternalError);
    wrong = PolygonLayout(testing::polygon_cube());
    wrong.charts.back().chart = 9;
    EXPECT_THROW(write_layout(wrong, {}, scratch.file(name)), InternalError);
  }
  // Counts beyond what a format can number: refused before anything is read.
  struct Huge : PolygonLayout {
    using PolygonLayout::PolygonLayout;
    LayoutSize size() const override {
      LayoutSize out = PolygonLayout::size();
      out.texture_vertices = std::uint64_t{5} << 30;
      out.vertices = std::uint64_t{5} << 30;
      return out;
    }
  };
  Huge huge(testing::polygon_cube());
  EXPECT_THROW(write_layout(huge, {}, scratch.file("a.drc")), UsageError);
  EXPECT_THROW(write_layout(huge, {}, scratch.file("a.ply")), UsageError);
  EXPECT_TRUE(scratch.names().empty());
}

TEST(LayoutWriter, SaysWhatDracoTakes) {
  EXPECT_GT(layout_write_bytes("a.drc", std::uint64_t{1} << 33), std::uint64_t{1} << 40);
  EXPECT_LT(layout_write_bytes("a.obj", std::uint64_t{1} << 33), std::uint64_t{1} << 24);
}

/// The base complex is a remesh of quads.
TEST(LayoutWriter, LeavesBaseComplexesToTheRemeshWriter) {
  const ScratchDirectory scratch;
  for (const PolygonMesh& mesh : {testing::polygon_cube(), testing::polygon_torus(5, 4)}) {
    for (const char* name : {"base.obj", "base.ply", "base.drc"}) {
      write_remesh(mesh, some_metadata(), scratch.file(name));
      const PolygonMesh read = read_polygons(scratch.file(name));
      EXPECT_EQ(read.vertex_count(), mesh.vertex_count());
      ASSERT_EQ(read.face_count(), mesh.face_count());
      for (std::size_t f = 0; f < read.face_count(); ++f) {
        EXPECT_EQ(read.degree(f), 4U);
      }
    }
  }
}

}  // namespace
}  // namespace rattan
