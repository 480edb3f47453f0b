// SPDX-License-Identifier: MIT
#include "io/layout/bake.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include "engine/core/errors.h"
#include "io/layout/texture_picture.h"
#include "tests/engine/layout/memory_layout.h"
#include "tests/io/test_meshes.h"

namespace rattan {
namespace {

using testing::MemoryLayout;
using testing::ScratchDirectory;

/// Between the four nearest texels, as a graphics card does it; (0, 0) is the lower left corner.
std::array<double, 3> sampled(const Image& image, const Vec2d& uv) {
  const double x = std::clamp(uv.x() * image.width() - 0.5, 0.0, image.width() - 1.0);
  const double y = std::clamp((1.0 - uv.y()) * image.height() - 0.5, 0.0, image.height() - 1.0);
  const int i = std::min(static_cast<int>(x), image.width() - 2);
  const int j = std::min(static_cast<int>(y), image.height() - 2);
  std::array<double, 3> c{};
  for (std::size_t k = 0; k < 3; ++k) {
    const double upper = image.at(i, j)[k] * (i + 1 - x) + image.at(i + 1, j)[k] * (x - i);
    const double lower = image.at(i, j + 1)[k] * (i + 1 - x) + image.at(i + 1, j + 1)[k] * (x - i);
    c[k] = upper * (j + 1 - y) + lower * (y - j);
  }
  return c;
}

std::uint8_t byte(double value) {
  return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0)));
}

/// Colour says where on the sheet a vertex lies.
MemoryLayout coded_sheet(std::uint32_t columns, std::uint32_t rows, std::uint32_t k) {
  MemoryLayout layout =
      testing::sheet_layout(columns, rows, k, [](std::uint32_t c) { return c % 4 == 1; });
  for (const Vec3d& p : layout.position) {
    layout.colour.push_back({byte(255 * p.x() / columns), byte(255 * p.y() / rows),
                             byte(127 + 100 * std::sin(p.x()) * std::cos(p.y())), 255});
  }
  return layout;
}

struct Baked {
  AtlasPlan plan;
  BakedImage result;
};
Baked baked_atlas(MemoryLayout& layout, std::uint32_t size, const TexturedScan* texture = nullptr) {
  AtlasPlan plan(layout.size(), split_parts(layout), {size, 4});
  AtlasSource atlas(layout, plan);
  BakedImage result = bake(atlas, plan, texture);
  return {std::move(plan), std::move(result)};
}

TEST(Bake, ShowsVertexColoursWhereTheyAre) {
  MemoryLayout layout = coded_sheet(7, 5, 4);
  const Baked baked = baked_atlas(layout, 512);
  EXPECT_EQ(baked.result.uncovered, 0U);
  EXPECT_EQ(baked.result.searched, 0U);
  std::uint64_t texels = 0;
  for (std::uint64_t p = 0; p < baked.plan.parts(); ++p) {
    texels += std::uint64_t{baked.plan.part(p).side + 1} * (baked.plan.part(p).side + 1);
  }
  EXPECT_EQ(baked.result.texels, texels);
  AtlasSource atlas(layout, baked.plan);
  double worst = 0.0;
  atlas.for_each_chart([&](const LayoutChart& chart) {
    for (std::size_t i = 0; i < chart.uv.size(); ++i) {
      const auto c = sampled(baked.result.image, chart.uv[i]);
      for (std::size_t k = 0; k < 3; ++k) {
        worst = std::max(worst, std::abs(c[k] - chart.colour[i][k]));
      }
    }
  });
  EXPECT_LE(worst, 1.5);
}

// A margin repeats the border, and no texel anywhere has a colour of its own making.
TEST(Bake, MarginsRepeatTheBorder) {
  MemoryLayout layout = coded_sheet(5, 3, 2);
  const Baked baked = baked_atlas(layout, 200);
  const Image& image = baked.result.image;
  const auto texel = [&](std::uint32_t x, std::uint32_t y) {
    return image.at(static_cast<int>(x), static_cast<int>(baked.plan.size() - 1 - y));
  };
  for (std::uint64_t p = 0; p < baked.plan.parts(); ++p) {
    const AtlasPart part = baked.plan.part(p);
    for (std::uint32_t y = part.y_begin; y < part.y_end; ++y) {
      for (std::uint32_t x = part.x_begin; x < part.x_end; ++x) {
        ASSERT_EQ(texel(x, y), texel(std::clamp(x, part.x, part.x + part.side),
                                     std::clamp(y, part.y, part.y + part.side)))
            << "part " << p << ", texel " << x << ", " << y;
      }
    }
  }
  for (const AtlasPart& place : baked.plan.free()) {
    EXPECT_EQ(texel(place.x_begin, place.y_begin), texel(place.x_end - 1, place.y_end - 1));
    EXPECT_NEAR(texel(place.x_begin, place.y_begin)[0], 127, 10);  // the mean
  }
}

// Filtered along a side that two whole charts share, both show the same.
TEST(Bake, SharedSidesShowNoSeam) {
  MemoryLayout layout = coded_sheet(6, 1, 5);
  const Baked baked = baked_atlas(layout, 256);
  for (std::uint32_t c = 2; c + 1 < 6; c += 4) {  // 2 and 3 are whole
    const std::uint32_t first = c + 3;            // chart 1 has four parts
    const AtlasMap left = baked.plan.map(first);
    const AtlasMap right = baked.plan.map(first + 1);
    for (double t = 0.0; t <= 2.0; t += 0.01) {
      const auto a = sampled(baked.result.image, left.origin + left.scale * Vec2d(2.0, t));
      const auto b = sampled(baked.result.image, right.origin + right.scale * Vec2d(0.0, t));
      for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_NEAR(a[k], b[k], 1e-6);
      }
    }
  }
}

TEST(Bake, SameBytesForAnyNumberOfThreads) {
  MemoryLayout layout = coded_sheet(9, 9, 3);
  std::vector<Rgb> first;
  for (const std::size_t threads : {1U, 2U, 4U}) {
    const oneapi::tbb::global_control control(oneapi::tbb::global_control::max_allowed_parallelism,
                                              threads);
    const Baked baked = baked_atlas(layout, 777);
    const Image& image = baked.result.image;
    const std::vector<Rgb> pixels(image.data(), image.data() + 777 * 777);
    if (first.empty()) {
      first = pixels;
    }
    EXPECT_TRUE(first == pixels) << threads;
  }
}

// Triangles that miss their square's border leave texels to their neighbours.
TEST(Bake, FillsWhatNoTriangleCovers) {
  MemoryLayout layout = testing::sheet_layout(1, 1, 4);
  layout.colour.assign(layout.position.size(), {10, 20, 30, 255});
  for (Vec2d& uv : layout.charts[0].uv) {
    uv = uv * 0.5 + Vec2d(0.1, 0.3);
  }
  const Baked baked = baked_atlas(layout, 64);
  EXPECT_GT(baked.result.uncovered, 100U);
  const Image& image = baked.result.image;
  EXPECT_THAT(std::span(image.data(), std::size_t{64} * 64), ::testing::Each(Rgb{10, 20, 30}));
}

TEST(Bake, ScanWithoutColoursIsRefused) {
  TextureOutline none;
  EXPECT_THROW(bakes_textures("scan.stl", none, false), UsageError);
  EXPECT_FALSE(bakes_textures("scan.ply", none, true));
  none.textured = 1;
  EXPECT_TRUE(bakes_textures("scan.obj", none, true));
}

// ---- a textured cube ----

/// Six squares, 3 x 2 in the picture, apart from each other by a margin.
constexpr double kMargin = 0.02;
Vec3d on_cube(int face, double s, double t) {
  const int axis = face % 3;
  const double a = 2 * s - 1;
  const double b = 2 * t - 1;
  Vec3d p;
  p[axis] = face < 3 ? 1 : -1;
  p[(axis + 1) % 3] = face < 3 ? a : b;
  p[(axis + 2) % 3] = face < 3 ? b : a;
  return p;
}
Vec2d in_picture(int face, double s, double t) {
  const double w = 1.0 / 3.0;
  const double h = 0.5;
  return {face % 3 * w + w * (kMargin + (1 - 2 * kMargin) * s),
          face / 3 * h + h * (kMargin + (1 - 2 * kMargin) * t)};
}
/// Each face's own base colour with its own gentle pattern.
Rgb painted(const Vec2d& uv) {
  const int face = static_cast<int>(uv.x() * 3) + 3 * static_cast<int>(uv.y() * 2);
  return {byte(40 * face + 40 * uv.x() + 10), byte(200 - 30 * face + 50 * std::sin(9 * uv.y())),
          byte(128 + 100 * std::cos(7 * uv.x()) * std::sin(8 * uv.y()))};
}
Image painted_picture(int width, int height) {
  Image picture(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      picture.at(x, y) = painted({(x + 0.5) / width, 1.0 - (y + 0.5) / height});
    }
  }
  return picture;
}

/// A quad a face as OBJ, triangles for PLY; written beside picture.png.
void write_cube_obj(const ScratchDirectory& folder, const std::string& map = "picture.png") {
  std::ofstream obj(folder.file("cube.obj"));
  std::ofstream mtl(folder.file("paint of cube.mtl"));
  mtl << "newmtl other\nKd 1 0 0\nnewmtl paint\nKd 0.5 0.5 0.5\nmap_Kd " << map << "\n";
  obj << "mtllib paint of cube.mtl\n";
  static constexpr int kCorner[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  for (int f = 0; f < 6; ++f) {
    obj << "usemtl paint\n";
    for (const auto& c : kCorner) {
      const Vec3d p = on_cube(f, c[0], c[1]) + Vec3d(1000, 2000, 3000);
      const Vec2d t = in_picture(f, c[0], c[1]);
      obj << "v " << p.x() << " " << p.y() << " " << p.z() << "\n";
      obj << "vt " << t.x() << " " << t.y() << "\n";
    }
    obj << (f % 2 == 0 ? "f -4/-4 -3/-3 -2/-2 -1/-1\n" : "");
    for (int k = 2; f % 2 == 1 && k < 4; ++k) {
      const int v = 4 * f + 1;
      obj << "f " << v << "/" << v << "/1 " << v + k - 1 << "/" << v + k - 1 << "/1 " << v + k
          << "/" << v + k << "/1 # corner\n";
    }
  }
}

MemoryLayout cube_layout(std::uint32_t k) {
  MemoryLayout layout;
  layout.units = 1;
  for (std::uint32_t f = 0; f < 6; ++f) {
    MemoryLayout face = testing::sheet_layout(
        1, 1, k, {}, [&](double s, double t) { return on_cube(static_cast<int>(f), s, t); });
    FlatChart& chart = face.charts[0];
    chart.chart = f;
    for (std::uint64_t& n : chart.number) {
      n += layout.position.size();
    }
    for (Vec2d& uv : chart.uv) {
      uv /= 2.0;
    }
    layout.position.insert(layout.position.end(), face.position.begin(), face.position.end());
    layout.charts.push_back(chart);
  }
  return layout;
}

/// Baked colours at texture vertices and triangles' middles against the painting itself.
void expect_painted(MemoryLayout& layout, const Baked& baked, double tolerance) {
  AtlasSource atlas(layout, baked.plan);
  atlas.for_each_chart([&](const LayoutChart& chart) {
    const int face = static_cast<int>(chart.chart);
    const auto expect_at = [&](const Vec3d& p, const Vec2d& uv) {
      const int axis = face % 3;
      const double a = (p[(axis + 1) % 3] + 1) / 2;
      const double b = (p[(axis + 2) % 3] + 1) / 2;
      const Rgb wanted = painted(face < 3 ? in_picture(face, a, b) : in_picture(face, b, a));
      const auto got = sampled(baked.result.image, uv);
      for (std::size_t k = 0; k < 3; ++k) {
        ASSERT_NEAR(got[k], wanted[k], tolerance) << "face " << face << ", uv " << uv.transpose();
      }
    };
    for (std::size_t i = 0; i < chart.uv.size(); ++i) {
      expect_at(chart.position[i], chart.uv[i]);
    }
    for (const auto& t : chart.triangle) {
      expect_at((chart.position[t[0]] + chart.position[t[1]] + chart.position[t[2]]) / 3,
                (chart.uv[t[0]] + chart.uv[t[1]] + chart.uv[t[2]]) / 3);
    }
  });
}

const Vec3d kOrigin(1000, 2000, 3000);

TEST(Bake, TexturedObjKeepsItsPicture) {
  const ScratchDirectory folder;
  write_png(painted_picture(600, 400), folder.file("picture.png"));
  write_cube_obj(folder);
  const TextureOutline outline = outline_textures(folder.file("cube.obj"));
  EXPECT_EQ(outline.vertices, 24U);
  EXPECT_EQ(outline.texture_vertices, 24U);
  EXPECT_EQ(outline.triangles, 12U);
  EXPECT_EQ(outline.textured, 12U);
  EXPECT_EQ(outline.pixels, 240000U);
  EXPECT_GT(outline.bytes, 720000U);
  const TexturedScan scan(folder.file("cube.obj"), outline, kOrigin);
  ASSERT_EQ(scan.triangles(), 12U);
  MemoryLayout layout = cube_layout(5);
  const Baked baked = baked_atlas(layout, 512, &scan);
  EXPECT_EQ(baked.result.uncovered, 0U);
  EXPECT_LT(baked.result.searched, baked.result.texels / 10);
  expect_painted(layout, baked, 2.5);
}

// A layout whose triangles lie across those of the scan and a little beside it: closest points.
TEST(Bake, LooksUpClosestPointsWhereNoTriangleHolds) {
  const ScratchDirectory folder;
  write_png(painted_picture(600, 400), folder.file("picture.png"));
  write_cube_obj(folder);
  const TexturedScan scan(folder.file("cube.obj"), outline_textures(folder.file("cube.obj")),
                          kOrigin);
  MemoryLayout layout = cube_layout(5);
  for (const FlatChart& chart : layout.charts) {
    for (const std::uint64_t v : chart.number) {
      layout.position[v] *= 0.999;
      layout.position[v][chart.chart % 3] *= 1.003;
    }
  }
  const Baked baked = baked_atlas(layout, 512, &scan);
  EXPECT_EQ(baked.result.searched, baked.result.texels);
  expect_painted(layout, baked, 3.0);
}

TEST(Bake, TexturedPlyIsTheSame) {
  const ScratchDirectory folder;
  write_png(painted_picture(600, 400), folder.file("picture of cube.png"));
  std::ofstream ply(folder.file("cube.ply"));
  ply << "ply\nformat ascii 1.0\ncomment TextureFile picture of cube.png\nelement vertex 24\n"
         "property double x\nproperty double y\nproperty double z\nelement face 6\n"
         "property list uchar int vertex_indices\nproperty list uchar float texcoord\n"
         "property int texnumber\nend_header\n";
  static constexpr int kCorner[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  std::ostringstream faces;
  for (int f = 0; f < 6; ++f) {
    faces << "4";
    for (int c = 0; c < 4; ++c) {
      const Vec3d p = on_cube(f, kCorner[c][0], kCorner[c][1]) + kOrigin;
      ply << p.x() << " " << p.y() << " " << p.z() << "\n";
      faces << " " << 4 * f + c;
    }
    faces << " 8";
    for (const auto& c : kCorner) {
      const Vec2d t = in_picture(f, c[0], c[1]);
      faces << " " << t.x() << " " << t.y();
    }
    faces << " 0\n";
  }
  ply << faces.str();
  ply.close();
  const TextureOutline outline = outline_textures(folder.file("cube.ply"));
  EXPECT_EQ(outline.textured, 12U);
  const TexturedScan scan(folder.file("cube.ply"), outline, kOrigin);
  MemoryLayout layout = cube_layout(4);
  expect_painted(layout, baked_atlas(layout, 512, &scan), 2.5);
}

TEST(TexturedScan, RepeatsOrClampsAsTheMaterialSays) {
  const ScratchDirectory folder;
  Image picture(2, 1);
  picture.at(0, 0) = {200, 0, 0};
  picture.at(1, 0) = {0, 100, 0};
  write_png(picture, folder.file("p.png"));
  const auto colour_at = [&](const std::string& options, double u) {
    std::ofstream(folder.file("m.mtl")) << "newmtl m\nmap_Kd " << options << "p.png\n";
    std::ofstream(folder.file("t.obj"))
        << "mtllib m.mtl\nusemtl m\nv -3 0 0\nv 3 0 0\nv 0 9 0\nvt -3 0.5\nvt 3 0.5\nvt 0 0.5\n"
           "f 1/1 2/2 3/3\n";
    const TexturedScan scan(folder.file("t.obj"), outline_textures(folder.file("t.obj")),
                            Vec3d::Zero());
    return scan.colour(0, scan.texture(0, Vec3d(u, 0, 0)));
  };
  using ::testing::DoubleNear;
  using ::testing::Each;
  using ::testing::ElementsAre;
  const auto is = [](double r, double g) {
    return ElementsAre(DoubleNear(r, 1e-3), DoubleNear(g, 1e-3), DoubleNear(0, 1e-3));
  };
  EXPECT_THAT(colour_at("", 0.25), is(200, 0));
  EXPECT_THAT(colour_at("", 0.75), is(0, 100));
  EXPECT_THAT(colour_at("", 0.5), is(100, 50));
  EXPECT_THAT(colour_at("", 1.25), is(200, 0));
  EXPECT_THAT(colour_at("", -1.25), is(0, 100));
  EXPECT_THAT(colour_at("", 1.0), is(100, 50));  // the last pixel beside the first
  EXPECT_THAT(colour_at("-clamp on ", 1.0), is(0, 100));
  EXPECT_THAT(colour_at("-clamp on ", -2.0), is(200, 0));
  EXPECT_THAT(colour_at("-s 0.5 1 -o 0.5 0 0 ", 0.5), is(0, 100));
  EXPECT_THAT(colour_at("-blendu off -mm 0 1 ", 0.75), is(0, 100));
}

TEST(TexturedScan, MaterialsWithoutPictureGiveTheirColour) {
  const ScratchDirectory folder;
  std::ofstream(folder.file("m.mtl")) << "newmtl plain\nKd 1 0.5 0\n";
  std::ofstream(folder.file("t.obj"))
      << "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 9\nusemtl plain\nf 1 2 3\nusemtl lost\n"
         "f 1 2 4\n";
  const TextureOutline outline = outline_textures(folder.file("t.obj"));
  EXPECT_EQ(outline.textured, 0U);
  EXPECT_EQ(outline.bytes, 0U);
  const TexturedScan scan(folder.file("t.obj"), outline, Vec3d::Zero());
  EXPECT_THAT(scan.colour(scan.nearest(Vec3d(0.3, 0.3, 0)), Vec2d::Zero()),
              ::testing::ElementsAre(255, 128, 0));
  EXPECT_THAT(scan.colour(scan.nearest(Vec3d(0.3, 0, 5)), Vec2d::Zero()),
              ::testing::ElementsAre(255, 255, 255));
}

TEST(TexturedScan, NamesWhatIsWrong) {
  const ScratchDirectory folder;
  write_cube_obj(folder);  // no picture
  const auto problem = [&](const std::string& file) {
    try {
      const TextureOutline outline = outline_textures(folder.file(file));
      const TexturedScan scan(folder.file(file), outline, kOrigin);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  using ::testing::HasSubstr;
  EXPECT_THAT(problem("cube.obj"), HasSubstr("picture.png"));
  std::ofstream(folder.file("picture.png")) << "no picture";
  EXPECT_THAT(problem("cube.obj"), HasSubstr("neither a PNG nor a JPEG"));
  write_png(painted_picture(60, 40), folder.file("picture.png"));
  EXPECT_EQ(problem("cube.obj"), "");
  const auto obj = [&](const std::string& text) {
    std::ofstream(folder.file("t.obj")) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\n" << text;
    return problem("t.obj");
  };
  EXPECT_THAT(obj("mtllib none.mtl\nf 1 2 3\n"), HasSubstr("none.mtl"));
  EXPECT_THAT(obj("f 1/1 2/x 3/1\n"), HasSubstr("line 5"));
  EXPECT_THAT(obj("f 1/1 2/2 3/1\n"), HasSubstr("texture vertex 2 of 1"));
  EXPECT_THAT(obj("f 1/-1 2/-2 3/1\n"), HasSubstr("line 5"));
  EXPECT_EQ(obj("f 1/1 2/1 3/1\n"), "");
}

TEST(TexturePicture, PngByRowsIsThePicture) {
  const ScratchDirectory folder;
  const Image picture = painted_picture(301, 99);
  write_png_rows(picture, folder.file("p.png"));
  const Image back = read_picture(folder.file("p.png"));
  ASSERT_EQ(back.width(), 301);
  ASSERT_EQ(back.height(), 99);
  EXPECT_TRUE(std::equal(picture.data(), picture.data() + 301 * 99, back.data()));
  EXPECT_EQ(picture_size(folder.file("p.png")).width, 301U);
  EXPECT_EQ(picture_size(folder.file("p.png")).height, 99U);
  EXPECT_THROW(write_png_rows(picture, folder.file("none/p.png")), InputError);
}

TEST(Material, IsReadBackAsWritten) {
  const ScratchDirectory folder;
  write_material(folder.file("a.mtl"), "atlas", "a b.png");
  const std::vector<Material> materials = read_materials(folder.file("a.mtl"));
  ASSERT_EQ(materials.size(), 1U);
  EXPECT_EQ(materials[0].name, "atlas");
  EXPECT_EQ(materials[0].picture, folder.file("a b.png"));
  EXPECT_FALSE(materials[0].clamped);
}

}  // namespace
}  // namespace rattan
