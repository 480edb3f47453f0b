// SPDX-License-Identifier: MIT
// Thumbnails of shapes whose looks are known.

#include "io/picture/thumbnail.h"

#include <fstream>

#include <gtest/gtest.h>

#include "engine/core/errors.h"
#include "io/picture/image.h"
#include "tests/io/test_meshes.h"

namespace rattan {
namespace {

using testing::cube;
using testing::ScratchDirectory;
using testing::torus;
using testing::wavy_grid;

Image decoded(const std::string& png) {
  const ScratchDirectory scratch;
  const std::string path = scratch.file("t.png");
  std::ofstream(path, std::ios::binary) << png;
  return read_png(path);
}

int brightness(const Rgb& c) {
  return c[0] + c[1] + c[2];
}

/// Pixels that aren't the white that transparent ones are put on.
std::size_t covered(const Image& image) {
  std::size_t n = 0;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      n += image.at(x, y) != Rgb{255, 255, 255} ? 1 : 0;
    }
  }
  return n;
}

TEST(Thumbnail, ShowsTheMeshInTheMiddleOfTheSizeAskedFor) {
  const Image image = decoded(draw_thumbnail(cube()));
  ASSERT_EQ(image.width(), 320);
  ASSERT_EQ(image.height(), 240);
  EXPECT_NE(image.at(160, 120), (Rgb{255, 255, 255}));
  for (const auto& [x, y] : {std::pair{0, 0}, {319, 0}, {0, 239}, {319, 239}}) {
    EXPECT_EQ(image.at(x, y), (Rgb{255, 255, 255}));
  }
  // A cube fills a good part of the height, and so of the square about it.
  EXPECT_GT(covered(image), 240U * 240U / 3U);
  EXPECT_LT(covered(image), 240U * 240U);
  EXPECT_EQ(decoded(draw_thumbnail(cube(), {.width = 64, .height = 48})).width(), 64);
}

TEST(Thumbnail, DrawsEdgesWhereFacesAreLargeOnly) {
  const auto darkest = [](const Image& image) {
    int least = 3 * 255;
    for (int y = 0; y < image.height(); ++y) {
      for (int x = 0; x < image.width(); ++x) {
        least = std::min(least, brightness(image.at(x, y)));
      }
    }
    return least;
  };
  // A plate seen from above is bright but for its edges.
  EXPECT_LT(darkest(decoded(draw_thumbnail(wavy_grid(12, 12)))), 300);
  EXPECT_GT(darkest(decoded(draw_thumbnail(wavy_grid(400, 400)))), 330);
}

TEST(Thumbnail, TintsWhatIsNoQuadAmongQuads) {
  const auto tinted = [](const Image& image) {
    std::size_t n = 0;
    for (int y = 0; y < image.height(); ++y) {
      for (int x = 0; x < image.width(); ++x) {
        n += image.at(x, y)[0] > image.at(x, y)[2] + 60 ? 1 : 0;
      }
    }
    return n;
  };
  EXPECT_EQ(tinted(decoded(draw_thumbnail(torus(24, 12)))), 0U);
  EXPECT_GT(tinted(decoded(draw_thumbnail(torus(24, 12, 7)))), 200U);
}

TEST(Thumbnail, DoesNotMindWhereTheMeshLiesOrHowLargeItIs) {
  PolygonMesh far = cube();
  for (Vec3d& p : far.positions) {
    p = p * 1e6 + Vec3d(3e9, -7e9, 1e9);
  }
  const Image here = decoded(draw_thumbnail(cube()));
  const Image there = decoded(draw_thumbnail(far));
  std::size_t differing = 0;
  for (int y = 0; y < here.height(); ++y) {
    for (int x = 0; x < here.width(); ++x) {
      differing += std::abs(brightness(here.at(x, y)) - brightness(there.at(x, y))) > 12 ? 1 : 0;
    }
  }
  EXPECT_LT(differing, 400U);
}

TEST(Thumbnail, IsSmallAndTheSameEachTime) {
  const std::string once = draw_thumbnail(torus(100, 50, 9));
  EXPECT_EQ(once, draw_thumbnail(torus(100, 50, 9)));
  EXPECT_LT(once.size(), 60'000U);
}

TEST(Thumbnail, SurvivesMeshesWithoutArea) {
  PolygonMesh point = cube();
  for (Vec3d& p : point.positions) {
    p = Vec3d(1.0, 2.0, 3.0);
  }
  EXPECT_EQ(covered(decoded(draw_thumbnail(point))), 0U);
  PolygonMesh flat = cube();
  for (Vec3d& p : flat.positions) {
    p.z() = 0.0;
  }
  EXPECT_GT(covered(decoded(draw_thumbnail(flat))), 1000U);
}

}  // namespace
}  // namespace rattan
