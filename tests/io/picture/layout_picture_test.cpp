// SPDX-License-Identifier: MIT
// Pictures of layouts whose charts are known.

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <gtest/gtest.h>

#include "engine/core/errors.h"
#include "io/layout/layout_writer.h"
#include "io/picture/panels.h"
#include "io/picture/texture.h"
#include "io/picture/textured_picture.h"
#include "io/remesh/remesh_writer.h"
#include "tests/engine/layout/memory_layout.h"
#include "tests/io/test_meshes.h"

namespace rattan {
namespace {

using testing::MemoryLayout;
using testing::ScratchDirectory;
using testing::sheet_layout;

constexpr Rgb kRose{220, 150, 150};
constexpr Rgb kSky{150, 170, 220};

/// The square [-1, 1]^2 facing z, two charts side by side, each [0, 2] x [0, 2] in texture
/// coordinates (stretched), in n x 2 n cells; a line between the charts.
struct TwoCharts {
  std::vector<Vec3f> positions;
  std::vector<LocalTriangle> triangles;
  std::vector<std::array<float, 2>> corner_uv;
  std::vector<Rgb> tints;
  std::vector<SurfaceLine> lines;

  explicit TwoCharts(int n) {
    const auto at = [&](int i, int j) { return static_cast<std::uint32_t>(j * (2 * n + 1) + i); };
    for (int j = 0; j <= 2 * n; ++j) {
      for (int i = 0; i <= 2 * n; ++i) {
        positions.emplace_back(static_cast<float>(i - n) / static_cast<float>(n),
                               static_cast<float>(j - n) / static_cast<float>(n), 0.0F);
      }
    }
    for (int j = 0; j < 2 * n; ++j) {
      for (int i = 0; i < 2 * n; ++i) {
        add({at(i, j), at(i + 1, j), at(i + 1, j + 1)}, i >= n);
        add({at(i, j), at(i + 1, j + 1), at(i, j + 1)}, i >= n);
      }
    }
    for (int j = 0; j < 2 * n; ++j) {
      lines.push_back({positions[at(n, j)], positions[at(n, j + 1)], LineKind::kChartBorder});
    }
  }
  SceneMesh mesh() const {
    SceneMesh m;
    m.positions = positions;
    m.triangles = triangles;
    m.corner_uv = corner_uv;
    m.tints = tints;
    m.lines = lines;
    return m;
  }

 private:
  void add(const LocalTriangle& t, bool right) {
    triangles.push_back(t);
    tints.push_back(right ? kSky : kRose);
    for (const std::uint32_t v : t) {
      const float x = positions[v].x();
      corner_uv.push_back({2.0F * (right ? x : x + 1.0F), positions[v].y() + 1.0F});
    }
  }
};

const Camera::View kFront{1, 0.0, 0.0};

Camera camera_of(const TwoCharts& s, int size) {
  Camera camera(Vec3d(-1, -1, -1), Vec3d(1, 1, 1), kFront);
  camera.include(s.positions);
  camera.fit(size, size, 0.1);
  return camera;
}

RenderOptions small(int size) {
  RenderOptions o;
  o.width = o.height = size;
  return o;
}

int brightness(const Rgb& c) {
  return c[0] + c[1] + c[2];
}

bool is_blue(const Rgb& c) {
  return c[2] > c[0] + 25;
}

/// Shares of the pixels of the surface that are of the board's light and dark fields.
std::array<double, 2> field_shares(const Image& image) {
  int light = 0;
  int dark = 0;
  for (int i = 0; i < image.width() * image.height(); ++i) {
    const Rgb& c = image.data()[i];
    if (c != Rgb{255, 255, 255}) {
      ++(is_blue(c) ? dark : light);
    }
  }
  const double all = std::max(light + dark, 1);
  return {light / all, dark / all};
}

TEST(LayoutPicture, BoardsAreHalfLightAndGoOnAcrossBorders) {
  double sum = 0.0;
  for (int i = 0; i < 200; ++i) {
    for (int j = 0; j < 200; ++j) {
      const float x = 0.01F * static_cast<float>(i) + 0.005F;
      const float y = 0.01F * static_cast<float>(j) + 0.005F;
      const float share = light_share(x, y, 1e-3F, 1e-3F);
      sum += share;
      // Eight fields a chart: a quarter turn about its corner, and into the next chart.
      EXPECT_NEAR(share, light_share(-y, x, 1e-3F, 1e-3F), 1e-3);
      EXPECT_NEAR(share, light_share(x + 8.0F, y, 1e-3F, 1e-3F), 1e-2);
      EXPECT_NEAR(share, light_share(8.0F - x, y, 1e-3F, 1e-3F), 1e-2);
    }
  }
  EXPECT_NEAR(sum / 40000.0, 0.5, 1e-3);
  EXPECT_NEAR(light_share(0.0F, 0.0F, 0.01F, 0.01F), 1.0, 1e-5);
  EXPECT_NEAR(light_share(1.0F, 0.0F, 0.01F, 0.01F), 0.0, 1e-5);
  // Half over the border of two fields; even grey from far.
  EXPECT_NEAR(light_share(0.5F, 0.0F, 0.2F, 0.2F), 0.5, 1e-5);
  EXPECT_NEAR(light_share(0.3F, 7.1F, 40.0F, 40.0F), 0.5, 1e-3);
}

TEST(LayoutPicture, PicturesAreLookedUpUpsideDownAndRepeat) {
  Image image(4, 2, {0, 0, 0});
  image.at(0, 0) = {200, 0, 0};
  image.at(3, 1) = {0, 100, 0};
  const PictureTexture texture(image);
  EXPECT_EQ(texture.at(0.125F, 0.75F, 0.0F), (Rgb{200, 0, 0}));
  EXPECT_EQ(texture.at(0.875F, 0.25F, 0.0F), (Rgb{0, 100, 0}));
  EXPECT_EQ(texture.at(-0.875F, 3.75F, 0.0F), (Rgb{200, 0, 0}));
  EXPECT_EQ(texture.at(0.25F, 0.75F, 0.0F), (Rgb{100, 0, 0}));
  const Rgb mean = texture.at(0.3F, 0.3F, 1.0F);
  EXPECT_NEAR(mean[0], 25, 1);
  EXPECT_NEAR(mean[1], 12, 1);
}

TEST(LayoutPicture, ChartsHaveTheirColoursAndABorder) {
  const TwoCharts s(6);
  const Look plain = Look::kPlain;
  constexpr std::array kOfCharts{Look::kCharts, Look::kTexture};
  const Camera camera = camera_of(s, 160);
  const std::vector<Image> images = render(single_part(s.mesh()), camera, {&plain, 1}, {},
                                           small(160), {single_part(s.mesh()), kOfCharts});
  ASSERT_EQ(images.size(), 3U);
  const Image& charts = images[1];
  EXPECT_GT(charts.at(50, 80)[0], charts.at(50, 80)[2] + 30);
  EXPECT_GT(charts.at(110, 80)[2], charts.at(110, 80)[0] + 30);
  for (int y = 30; y < 130; y += 7) {
    EXPECT_LT(brightness(charts.at(80, y)) + 150, brightness(charts.at(50, y)));
    EXPECT_LT(std::abs(brightness(charts.at(70, y)) - brightness(charts.at(50, y))), 30);
  }
  // In the first picture nothing of this is seen.
  EXPECT_EQ(images[0].at(80, 80), images[0].at(79, 80));
  const auto [light, dark] = field_shares(images[2]);
  EXPECT_NEAR(light, 0.5, 0.06);
  EXPECT_NEAR(dark, 0.5, 0.06);
}

TEST(LayoutPicture, BordersBehindTheSurfaceAreHidden) {
  TwoCharts s(6);
  for (SurfaceLine& line : s.lines) {
    line.from.z() = line.to.z() = -0.4F;
  }
  const Look look = Look::kCharts;
  const Image image =
      render(single_part(s.mesh()), camera_of(s, 160), {&look, 1}, {}, small(160)).front();
  for (int x = 30; x < 130; ++x) {
    EXPECT_GT(brightness(image.at(x, 80)), 250);
  }
}

TEST(LayoutPicture, SixPanels) {
  const TwoCharts s(8);
  std::vector<Vec3f> directions(s.positions.size(), Vec3f(1, 0, 0));
  std::vector<std::array<float, 2>> phases = s.corner_uv;
  SceneMesh scan = s.mesh();
  scan.directions = directions;
  scan.corner_phases = phases;
  PolygonMesh base;
  base.positions = {{-1, -1, 0}, {0, -1, 0}, {1, -1, 0}, {-1, 1, 0}, {0, 1, 0}, {1, 1, 0}};
  base.add_face(std::array{0U, 1U, 4U, 3U});
  base.add_face(std::array{1U, 2U, 5U, 4U});
  PanelInput input;
  input.scan = single_part(scan);
  input.has_field = input.has_lines = true;
  input.charts = single_part(s.mesh());
  input.chart_side = 1.0;
  input.chart_units = 2;
  input.remesh = &base;
  input.low = Vec3d(-1, -1, -0.01);
  input.high = Vec3d(1, 1, 0.01);
  RenderOptions options = small(140);
  options.line_period = 0.5;
  const Camera::View view = kFront;
  const Image strip = render_panels(input, options, &view);
  ASSERT_EQ(strip.width() % 3, 0);
  const int wide = strip.width() / 3;
  const int tall = strip.height() / 2;
  std::vector<std::vector<Rgb>> panels;
  for (int i = 0; i < 6; ++i) {
    std::vector<Rgb> pixels;
    int drawn = 0;
    for (int y = 0; y < tall - 29; ++y) {
      for (int x = 0; x < wide; ++x) {
        pixels.push_back(strip.at(i % 3 * wide + x, i / 3 * tall + y));
        drawn += pixels.back() != Rgb{255, 255, 255} ? 1 : 0;
      }
    }
    EXPECT_GT(drawn, wide * (tall - 29) / 2) << "panel " << i;
    for (const auto& other : panels) {
      EXPECT_NE(other, pixels) << "panel " << i;
    }
    panels.push_back(std::move(pixels));
  }
}

std::string write_sheet(MemoryLayout layout, const ScratchDirectory& scratch,
                        const std::string& name) {
  RemeshMetadata meta;
  meta.version = "test";
  write_layout(layout, meta, scratch.file(name));
  return scratch.file(name);
}

TEST(LayoutPicture, ReadsTextureCoordinatesOfEveryFormat) {
  const ScratchDirectory scratch;
  const auto is_split = [](std::uint32_t chart) { return chart == 1; };
  for (const char* name : {"a.obj", "a.ply", "a.drc"}) {
    SCOPED_TRACE(name);
    const std::string path = write_sheet(sheet_layout(3, 2, 4, is_split), scratch, name);
    const TexturedSurface surface = read_textured_surface(path);
    EXPECT_EQ(surface.mesh.face_count(), 6U * 2 * 8 * 8);
    ASSERT_EQ(surface.corner_uv.size(), 3 * surface.mesh.face_count());
    const TexturePieces pieces = texture_pieces(surface, Vec3d::Zero());
    // Five whole charts and four parts; each border of a chart is eight edges long.
    EXPECT_EQ(pieces.count, 9U);
    EXPECT_EQ(pieces.seams.size(), 7U * 8 + 4 * 4);
    EXPECT_NEAR(pieces.area, 6.0, 1e-3);
    EXPECT_NEAR(pieces.uv_area, 5 * 4.0 + 4 * 1.0, 1e-3);
    const Image image = render_textured(surface, small(150));
    const auto [light, dark] = field_shares(image);
    EXPECT_NEAR(light, 0.5, 0.08);
    EXPECT_NEAR(dark, 0.5, 0.08);
  }
}

TEST(LayoutPicture, ShowsAPicture) {
  const ScratchDirectory scratch;
  const TexturedSurface surface =
      read_textured_surface(write_sheet(sheet_layout(1, 1, 4), scratch, "a.obj"));
  // The sheet's coordinates are those of two by two copies of the picture.
  Image left_red(64, 64, {40, 40, 200});
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 32; ++x) {
      left_red.at(x, y) = {200, 40, 40};
    }
  }
  const PictureTexture texture(left_red);
  RenderOptions options = small(200);
  options.texture = &texture;
  const Image image = render_textured(surface, options);
  int changes = 0;
  int last = 0;
  for (int x = 30; x < 170; ++x) {
    const Rgb& c = image.at(x, 100);
    const int now = c[0] > c[2] + 60 ? 1 : c[2] > c[0] + 60 ? 2 : last;
    changes += last != 0 && now != last ? 1 : 0;
    last = now;
  }
  EXPECT_EQ(changes, 3);
}

TEST(LayoutPicture, FilesWithoutTextureCoordinatesAreRefused) {
  const ScratchDirectory scratch;
  PolygonMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  mesh.add_face(std::array{0U, 1U, 2U, 3U});
  for (const char* name : {"a.obj", "a.ply", "a.drc", "a.off"}) {
    SCOPED_TRACE(name);
    RemeshMetadata meta;
    meta.version = "test";
    write_remesh(mesh, meta, scratch.file(name), {});
    EXPECT_THROW(read_textured_surface(scratch.file(name)), InputError);
  }
  EXPECT_THROW(read_textured_surface(scratch.file("none.obj")), InputError);
}

}  // namespace
}  // namespace rattan
