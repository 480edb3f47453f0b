// SPDX-License-Identifier: MIT
// Atlas, baked image and layout file together: what a viewer would show.

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "io/file/atomic_file.h"
#include "io/layout/bake.h"
#include "io/layout/layout_writer.h"
#include "io/layout/texture_picture.h"
#include "tests/engine/layout/memory_layout.h"
#include "tests/io/test_meshes.h"

namespace rattan {
namespace {

using testing::MemoryLayout;
using testing::ScratchDirectory;

MemoryLayout hilly_sheet(std::uint32_t n, std::uint32_t k) {
  MemoryLayout layout = testing::sheet_layout(
      n, n, k, [](std::uint32_t c) { return c % 5 == 3; },
      [](double u, double v) { return Vec3d(u, v, std::sin(u) * std::cos(v)); });
  for (const Vec3d& p : layout.position) {
    const auto byte = [](double v) { return static_cast<std::uint8_t>(std::lround(v)); };
    layout.colour.push_back(
        {byte(255 * p.x() / n), byte(255 * p.y() / n), byte(127 + 100 * p.z()), 255});
  }
  return layout;
}

class AtlasFiles : public ::testing::TestWithParam<const char*> {};

// The file is read as a textured scan; each vertex must show its colour there.
TEST_P(AtlasFiles, ShowTheScansColours) {
  const ScratchDirectory folder;
  MemoryLayout layout = hilly_sheet(5, 4);
  const AtlasPlan plan(layout.size(), split_parts(layout), {512, 4});
  AtlasSource atlas(layout, plan);
  write_png_rows(bake(atlas, plan, nullptr).image, folder.file("sheet atlas.png"));
  write_material(folder.file("sheet.mtl"), "atlas", "sheet atlas.png");
  LayoutWriteOptions options;
  options.material_file = "sheet.mtl";
  options.material = "atlas";
  options.image_file = "sheet atlas.png";
  RemeshMetadata metadata;
  metadata.origin = {1000.0, 2000.0, 4.0};
  const std::string path = folder.file(GetParam());
  write_layout(atlas, metadata, path, options);

  const TextureOutline outline = outline_textures(path);
  EXPECT_EQ(outline.textured, layout.size().triangles);
  EXPECT_EQ(outline.pixels, 512U * 512U);
  const TexturedScan scan(path, outline, Vec3d(1000.0, 2000.0, 4.0));
  double worst = 0.0;
  for (std::size_t v = 0; v < layout.position.size(); ++v) {
    const Vec3d& p = layout.position[v];
    const std::uint32_t t = scan.nearest(p);
    ASSERT_TRUE(scan.holds(t, p));
    const auto colour = scan.colour(t, scan.texture(t, p));
    for (std::size_t k = 0; k < 3; ++k) {
      worst = std::max(worst, std::abs(colour[k] - layout.colour[v][k]));
    }
  }
  EXPECT_LE(worst, 1.5);
}

INSTANTIATE_TEST_SUITE_P(Formats, AtlasFiles, ::testing::Values("sheet.obj", "sheet.ply"));

// A small chart unit takes a fine grid: else nothing folds, but pictures would shift by texels.
TEST(AtlasFiles, DracoKeepsChartsAsExactAsAlone) {
  const ScratchDirectory folder;
  MemoryLayout layout = hilly_sheet(40, 2);
  const AtlasPlan plan(layout.size(), split_parts(layout));
  AtlasSource atlas(layout, plan);
  LayoutWriteOptions options;
  options.texture_bits = static_cast<int>(plan.bits(12));
  const LayoutWriteResult result = write_layout(atlas, {}, folder.file("sheet.drc"), options);
  EXPECT_EQ(result.folded, 0U);
  EXPECT_EQ(result.texture_step, std::ldexp(1.0, -options.texture_bits));
  double least_scale = 1.0;
  for (std::uint64_t p = 0; p < plan.parts(); ++p) {
    least_scale = std::min(least_scale, plan.map(p).scale);
  }
  EXPECT_LE(result.texture_step, std::ldexp(least_scale, -12));
  EXPECT_GT(result.texture_step, std::ldexp(least_scale, -14));
}

}  // namespace
}  // namespace rattan
