// SPDX-License-Identifier: MIT
// Pictures of shapes whose looks are known.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include "engine/core/errors.h"
#include "io/picture/panels.h"
#include "io/picture/polygon_scene.h"
#include "tests/io/test_meshes.h"

namespace rattan {
namespace {

using testing::ScratchDirectory;

constexpr Rgb kWhite{255, 255, 255};

int brightness(const Rgb& c) {
  return c[0] + c[1] + c[2];
}

/// Owns what a SceneMesh refers to.
struct Surface {
  std::vector<Vec3f> positions, normals, directions;
  std::vector<LocalTriangle> triangles;
  std::vector<std::array<float, 2>> phases;
  std::vector<std::uint8_t> kinds;

  SceneMesh mesh() const {
    SceneMesh m;
    m.positions = positions;
    m.triangles = triangles;
    m.normals = normals;
    m.directions = directions;
    m.corner_phases = phases;
    m.kinds = kinds;
    return m;
  }
};

Surface sphere(int n) {
  Surface s;
  const double pi = std::numbers::pi;
  for (int j = 0; j <= n; ++j) {
    for (int i = 0; i < 2 * n; ++i) {
      const double u = pi * i / n;
      const double v = pi * j / n;
      s.positions.emplace_back(std::sin(v) * std::sin(u), std::cos(v), std::sin(v) * std::cos(u));
      s.normals.push_back(s.positions.back());
    }
  }
  const auto at = [&](int i, int j) { return static_cast<std::uint32_t>(j * 2 * n + i % (2 * n)); };
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < 2 * n; ++i) {
      s.triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j + 1)});
      s.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i + 1, j)});
    }
  }
  return s;
}

/// The square [-1, 1]^2 facing z, n x n cells; theta = 2 pi * 5 x, phi = 2 pi * 3 y.
Surface square(int n) {
  Surface s;
  for (int j = 0; j <= n; ++j) {
    for (int i = 0; i <= n; ++i) {
      s.positions.emplace_back(2.0F * static_cast<float>(i) / static_cast<float>(n) - 1.0F,
                               2.0F * static_cast<float>(j) / static_cast<float>(n) - 1.0F, 0.0F);
      s.normals.emplace_back(0.0F, 0.0F, 1.0F);
      s.directions.push_back(Vec3f(1.0F, 0.4F, 0.0F).normalized());
    }
  }
  const auto at = [&](int i, int j) { return static_cast<std::uint32_t>(j * (n + 1) + i); };
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      s.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      s.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  const auto tau = static_cast<float>(2.0 * std::numbers::pi);
  for (const LocalTriangle& t : s.triangles) {
    for (const std::uint32_t v : t) {
      s.phases.push_back({tau * 5.0F * s.positions[v].x(), tau * 3.0F * s.positions[v].y()});
    }
  }
  s.kinds.assign(s.triangles.size(), kPlainTriangle);
  return s;
}

const Camera::View kFront{1, 0.0, 0.0};

Camera front_camera(const Surface& s, int width, int height) {
  Camera camera(Vec3d(-1, -1, -1), Vec3d(1, 1, 1), kFront);
  camera.include(s.positions);
  camera.fit(width, height, 0.1);
  return camera;
}

RenderOptions small(int size) {
  RenderOptions o;
  o.width = o.height = size;
  return o;
}

Image draw(const Surface& s, Look look, const RenderOptions& options,
           std::span<const Dot> dots = {}) {
  const Camera camera = front_camera(s, options.width, options.height);
  return render(single_part(s.mesh()), camera, {&look, 1}, dots, options).front();
}

/// Whether two pictures agree but for `share` of the pixels, at which they may differ freely.
::testing::AssertionResult agree(const Image& a, const Image& b, int tolerance, double share) {
  if (a.width() != b.width() || a.height() != b.height()) {
    return ::testing::AssertionFailure() << "sizes differ";
  }
  int off = 0;
  for (int y = 0; y < a.height(); ++y) {
    for (int x = 0; x < a.width(); ++x) {
      off += std::abs(brightness(a.at(x, y)) - brightness(b.at(x, y))) > 3 * tolerance ? 1 : 0;
    }
  }
  if (off > share * a.width() * a.height()) {
    return ::testing::AssertionFailure() << off << " pixels differ";
  }
  return ::testing::AssertionSuccess();
}

TEST(Picture, PngComesBackAsItWas) {
  const ScratchDirectory scratch;
  Image image(37, 23);
  for (int y = 0; y < 23; ++y) {
    for (int x = 0; x < 37; ++x) {
      image.at(x, y) = {static_cast<std::uint8_t>(7 * x), static_cast<std::uint8_t>(11 * y),
                        static_cast<std::uint8_t>(x * y)};
    }
  }
  write_png(image, scratch.file("a.png"));
  const Image read = read_png(scratch.file("a.png"));
  ASSERT_EQ(read.width(), 37);
  ASSERT_EQ(read.height(), 23);
  EXPECT_TRUE(std::equal(image.data(), image.data() + 37 * 23, read.data()));
  EXPECT_EQ(scratch.names().size(), 1U);
  EXPECT_THROW(write_png(image, scratch.file("none/a.png")), InputError);
  EXPECT_THROW(read_png(scratch.file("b.png")), InputError);
}

TEST(Picture, ASphereFillsItsDisc) {
  const Image image = draw(sphere(40), Look::kPlain, small(200));
  EXPECT_EQ(image.at(0, 0), kWhite);
  EXPECT_EQ(image.at(199, 199), kWhite);
  int covered = 0;
  for (int y = 0; y < 200; ++y) {
    for (int x = 0; x < 200; ++x) {
      covered += image.at(x, y) != kWhite ? 1 : 0;
    }
  }
  // The frame is fitted to the silhouette: a disc of 0.8 of the picture, ragged by half a pixel.
  const double expected = std::numbers::pi * 80.0 * 80.0;
  EXPECT_NEAR(covered, expected, 0.02 * expected);
  // Lit from the upper left.
  EXPECT_GT(brightness(image.at(70, 60)), brightness(image.at(140, 150)) + 60);
}

TEST(Picture, PartsGiveThePictureOfTheWhole) {
  const Surface whole = sphere(32);
  std::vector<Surface> parts(5);
  for (std::size_t p = 0; p < parts.size(); ++p) {
    parts[p] = whole;
    parts[p].triangles.clear();
    for (std::size_t t = p; t < whole.triangles.size(); t += parts.size()) {
      parts[p].triangles.push_back(whole.triangles[t]);
    }
  }
  const SurfaceSource source = [&](const std::function<void(const SceneMesh&)>& use) {
    for (const Surface& part : parts) {
      use(part.mesh());
    }
  };
  const Camera camera = front_camera(whole, 160, 160);
  const Look look = Look::kPlain;
  RenderOptions options = small(160);
  const Image one = render(single_part(whole.mesh()), camera, {&look, 1}, {}, options).front();
  const Image kept = render(source, camera, {&look, 1}, {}, options).front();
  options.resident_triangles = 100;  // scenes are built again for the second pass
  const Image streamed = render(source, camera, {&look, 1}, {}, options).front();
  EXPECT_TRUE(agree(one, kept, 3, 0.002));
  EXPECT_TRUE(agree(kept, streamed, 0, 0.0));
}

TEST(Picture, ThreadsDoNotChangeIt) {
  const Surface s = sphere(24);
  Image images[2];
  for (int threads = 1; threads <= 2; ++threads) {
    const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism,
                                            static_cast<std::size_t>(threads));
    images[threads - 1] = draw(s, Look::kPlain, small(120));
  }
  EXPECT_TRUE(agree(images[0], images[1], 0, 0.0));
}

/// Dark stretches along the middle row or column of the square.
int count_lines(const Image& image, bool along_row, const Rgb& surface) {
  int lines = 0;
  bool dark = false;
  for (int i = 0; i < image.width(); ++i) {
    const int off_axis = image.height() / 2 + 9;
    const Rgb& c = along_row ? image.at(i, off_axis) : image.at(off_axis, i);
    const bool now = brightness(c) < brightness(surface) - 90;
    lines += now && !dark ? 1 : 0;
    dark = now;
  }
  return lines;
}

TEST(Picture, IsoLinesAreWhereThePhasesSay) {
  RenderOptions options = small(300);
  options.line_period = 2.0 * std::numbers::pi;
  const Surface s = square(9);
  const Image plain = draw(s, Look::kPlain, options);
  const Image image = draw(s, Look::kIsoLines, options);
  const Rgb surface = plain.at(150, 150);
  // theta / 2 pi runs from -5 to 5, phi / 2 pi from -3 to 3; the borders are lines too.
  EXPECT_EQ(count_lines(image, true, surface), 11);
  EXPECT_EQ(count_lines(image, false, surface), 7);
  EXPECT_EQ(count_lines(plain, true, surface), 0);
  options.line_period *= 0.5;
  EXPECT_EQ(count_lines(draw(s, Look::kIsoLines, options), true, surface), 21);
  Surface without = s;
  for (auto& p : without.phases) {
    p = {std::nanf(""), std::nanf("")};
  }
  EXPECT_TRUE(agree(draw(without, Look::kIsoLines, options), plain, 0, 0.0));
}

TEST(Picture, FieldLinesDoNotCareWhichQuarterTurn) {
  Surface s = square(12);
  const Image image = draw(s, Look::kField, small(240));
  EXPECT_FALSE(agree(image, draw(s, Look::kPlain, small(240)), 20, 0.1));
  std::mt19937 random(5);
  for (Vec3f& d : s.directions) {
    for (unsigned turns = random() % 4; turns > 0; --turns) {
      d = Vec3f(0, 0, 1).cross(d);
    }
  }
  EXPECT_TRUE(agree(image, draw(s, Look::kField, small(240)), 40, 0.1));
}

TEST(Picture, FieldLinesFollowTheField) {
  Surface s = square(12);
  for (Vec3f& d : s.directions) {
    d = Vec3f(1, 0, 0);
  }
  const Image image = draw(s, Look::kField, small(240));
  const Image plain = draw(s, Look::kPlain, small(240));
  // Lines along rows and columns: some rows are dark nearly all along, some nearly nowhere.
  int full = 0;
  int light = 0;
  for (int y = 60; y < 180; ++y) {
    int dark = 0;
    for (int x = 60; x < 180; ++x) {
      dark += brightness(image.at(x, y)) < brightness(plain.at(x, y)) - 60 ? 1 : 0;
    }
    full += dark > 108 ? 1 : 0;
    light += dark < 48 ? 1 : 0;
  }
  EXPECT_GE(full, 8);
  EXPECT_GE(light, 60);
}

TEST(Picture, EdgesOfFacesAreDrawnAndDiagonalsAreNot) {
  PolygonMesh mesh;
  mesh.positions = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}, {0, -1, 0}, {0, 1, 0}};
  testing::add(mesh, {0, 4, 5, 3});
  testing::add(mesh, {4, 1, 2, 5});
  RenderOptions options = small(200);
  options.line_width = 2.0F;
  const Image image = render_polygons(mesh, options, &kFront);
  const Rgb face = image.at(60, 80);
  EXPECT_LT(brightness(image.at(100, 80)), brightness(face) - 200);  // the shared edge
  for (int i = 15; i < 95; ++i) {
    EXPECT_GT(brightness(image.at(i, 100)), brightness(face) - 40) << i;  // no diagonal crosses
  }
  mesh = PolygonMesh();
  mesh.positions = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
  testing::add(mesh, {0, 1, 2});
  testing::add(mesh, {0, 2, 3});
  const Image split = render_polygons(mesh, options, &kFront);
  EXPECT_LT(brightness(split.at(100, 100)), brightness(split.at(60, 80)) - 150);
  EXPECT_LT(split.at(60, 80)[0], split.at(60, 80)[2] + 40);  // a triangle mesh is not tinted
  mesh = PolygonMesh();
  mesh.positions = {{-1, -1, 0}, {0, -1, 0}, {1, -1, 0}, {1, 1, 0}, {0, 1, 0}, {-1, 1, 0}};
  testing::add(mesh, {0, 1, 4, 5});
  testing::add(mesh, {1, 2, 3});
  testing::add(mesh, {1, 3, 4});
  testing::add(mesh, {0, 5, 4, 1});
  const Image mixed = render_polygons(mesh, options, &kFront);
  EXPECT_GT(mixed.at(150, 130)[0], mixed.at(150, 130)[2] + 40);  // triangles among quads are
  EXPECT_LT(mixed.at(50, 80)[0], mixed.at(50, 80)[2] + 40);
}

TEST(Picture, DotsBehindTheSurfaceAreHidden) {
  const Surface s = sphere(24);
  const Rgb red{220, 30, 30};
  const Dot front{Vec3f(0, 0, 1), red, 4.0F};
  const Dot back{Vec3f(0, 0, -1), red, 4.0F};
  const Image with_front = draw(s, Look::kField, small(160), {&front, 1});
  const Image with_back = draw(s, Look::kField, small(160), {&back, 1});
  EXPECT_EQ(with_front.at(80, 80), red);
  EXPECT_NE(with_back.at(80, 80), red);
  EXPECT_TRUE(agree(with_back, draw(s, Look::kField, small(160)), 0, 0.0));
}

TEST(Picture, TheInsideShowsThroughAHole) {
  Surface s = sphere(24);
  const Image closed = draw(s, Look::kPlain, small(160));
  std::erase_if(s.triangles, [&](const LocalTriangle& t) {
    return std::all_of(t.begin(), t.end(),
                       [&](std::uint32_t v) { return s.positions[v].z() > 0.8F; });
  });
  const Image open = draw(s, Look::kPlain, small(160));
  EXPECT_LT(brightness(open.at(80, 80)), brightness(closed.at(80, 80)) - 100);
  EXPECT_NE(open.at(80, 80), kWhite);
}

TEST(Picture, StripsHoldFourLabelledPanels) {
  const ScratchDirectory scratch;
  const Surface s = square(12);
  const PolygonMesh remesh = testing::torus(30, 12);
  PanelInput input;
  input.scan = single_part(s.mesh());
  input.has_field = input.has_lines = true;
  input.remesh = &remesh;
  input.low = Vec3d(-4, -4, -1);
  input.high = Vec3d(4, 4, 1);
  RenderOptions options = small(150);
  const Image strip = render_panels(input, options);
  EXPECT_EQ(strip.width() % 4, 0);
  EXPECT_LE(strip.width(), 4 * 150);
  const int label = 29;
  EXPECT_GT(strip.height(), 75 + label);
  EXPECT_LE(strip.height(), 150 + label);
  const int panel = strip.width() / 4;
  for (int i = 0; i < 4; ++i) {
    int ink = 0;
    int drawn = 0;
    for (int y = 0; y < strip.height(); ++y) {
      for (int x = i * panel; x < (i + 1) * panel; ++x) {
        (y < strip.height() - label ? drawn : ink) += brightness(strip.at(x, y)) < 730 ? 1 : 0;
      }
    }
    EXPECT_GT(ink, 20) << "label " << i;
    EXPECT_GT(drawn, 500) << "panel " << i;
  }
  // Six stand in two rows.
  input.has_curvature = input.close_up = true;
  const Image rows = render_panels(input, options);
  EXPECT_EQ(rows.width(), 3 * panel);
  EXPECT_EQ(rows.height(), 2 * strip.height());
  input.has_curvature = input.close_up = false;
  input.scan = nullptr;
  EXPECT_EQ(render_panels(input, options).width() / 150, 1);
  write_png(strip, scratch.file("strip.png"));
  EXPECT_EQ(read_png(scratch.file("strip.png")).width(), strip.width());
}

TEST(Picture, GuessesWhichWayIsUp) {
  // A box standing on its z side, its bottom finely closed, the other sides round.
  Surface ball = sphere(20);
  Surface cut = ball;
  for (Vec3f& p : cut.positions) {
    p.z() = std::max(p.z(), -0.5F);
  }
  UpAxisGuess standing(Vec3d(-1, -1, -0.5), Vec3d(1, 1, 1));
  standing.add(cut.positions, cut.triangles);
  EXPECT_EQ(standing.axis(), 2);
  EXPECT_TRUE(standing.tilt().isZero(0.0));
  UpAxisGuess round(Vec3d(-1, -1, -1), Vec3d(1, 1, 1));
  round.add(ball.positions, ball.triangles);
  EXPECT_EQ(round.axis(), 1);
  EXPECT_TRUE(round.tilt().isZero(0.0));
}

TEST(Picture, SetsUprightWhatStandsAskew) {
  Surface cut = sphere(40);
  for (const Vec3d& up : {Vec3d(0.3, 0.8, 0.4), Vec3d(-0.1, -0.5, 0.9), Vec3d(0.2, 0.6, -0.5)}) {
    const Vec3d axis = up.normalized();
    Surface leaning = cut;
    for (Vec3f& p : leaning.positions) {
      const double below = std::max(0.0, -0.6 - axis.dot(p.cast<double>()));
      p += (below * axis).cast<float>();
    }
    UpAxisGuess guess(Vec3d(-1, -1, -1), Vec3d(1, 1, 1));
    guess.add(leaning.positions, leaning.triangles);
    EXPECT_LT((guess.tilt() - axis).norm(), 0.02);
    EXPECT_EQ(guess.axis(), axis.z() > axis.y() ? 2 : 1);
  }
  // Upside down it would stand on nothing.
  Surface hanging = cut;
  const Vec3f roof = Vec3f(0.0F, 0.8F, 0.6F);
  for (Vec3f& p : hanging.positions) {
    p -= std::max(0.0F, roof.dot(p) - 0.6F) * roof;
  }
  UpAxisGuess guess(Vec3d(-1, -1, -1), Vec3d(1, 1, 1));
  guess.add(hanging.positions, hanging.triangles);
  EXPECT_TRUE(guess.tilt().isZero(0.0));
}

TEST(Picture, ZoomsWithoutLeavingThePicture) {
  Camera camera(Vec3d(-1, -1, -1), Vec3d(1, 1, 1), kFront);
  const std::vector<Vec3f> corners{Vec3f(-1, -1, 0), Vec3f(1, 1, 0)};
  camera.include(corners);
  camera.fit(100, 100, 0.1);
  Camera middle = camera;
  const Vec3f point(0.2F, -0.1F, 0.0F);
  middle.zoom(point, 4.0F, 100, 100);
  const Vec3f at = middle.project(middle.to_camera(point));
  EXPECT_NEAR(at.x(), 50, 1e-2);
  EXPECT_NEAR(at.y(), 50, 1e-2);
  Camera edge = camera;
  edge.zoom(corners[1], 4.0F, 100, 100);
  // The upper right corner of both pictures shows the same.
  const Vec3f before = camera.ray(100.0F, 0.0F);
  const Vec3f after = edge.ray(100.0F, 0.0F);
  EXPECT_NEAR(before.x(), after.x(), 1e-5);
  EXPECT_NEAR(before.y(), after.y(), 1e-5);
}

TEST(Picture, TextKeepsToItsWidth) {
  Image image(400, 40);
  const std::string text = "Quads 98.5 %, 0 holes (genus 20)";
  draw_text(image, text, {10.0F, 28.0F}, 12.0F, {0, 0, 0});
  const int end = 10 + static_cast<int>(std::ceil(text_width(text, 12.0F)));
  ASSERT_LT(end, 400);
  int ink = 0;
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 400; ++x) {
      if (image.at(x, y) != kWhite) {
        ++ink;
        EXPECT_LT(x, end);
        EXPECT_GE(x, 8);
      }
    }
  }
  EXPECT_GT(ink, 500);
}

}  // namespace
}  // namespace rattan
