// SPDX-License-Identifier: MIT
#pragma once

// A scan's colours as the image of a layout's atlas.

#include <cstdint>
#include <functional>
#include <string>

#include "engine/layout/atlas.h"
#include "engine/layout/layout_source.h"
#include "io/layout/textured_scan.h"
#include "io/picture/image.h"

namespace rattan {

struct BakedImage {
  Image image;
  /// Texels inside parts; each shows the surface at its centre.
  std::uint64_t texels = 0;
  /// Of these, those whose centre no triangle covers (because its texture coordinates leave gaps),
  /// filled from the nearest triangle.
  std::uint64_t uncovered = 0;
  /// Texels looked up by closest point, because no triangle of the textured scan holds their
  /// layout triangle (what repair has made).
  std::uint64_t searched = 0;
};

/// Whether colours come from the scan's textures (true), which go before, or from its vertices.
/// Throws UsageError if it has neither.
bool bakes_textures(const std::string& scan, const TextureOutline& outline, bool has_colours);

/// Memory that bake() takes: the image and what is in work. On top comes the textured scan.
std::uint64_t bake_bytes(std::uint32_t image_size);

/// Fills an image of plan.size() texels a side from the texture, or from the vertex colours where
/// it is null (pre: the layout has colours then). `atlas` is the layout with its coordinates as
/// `plan` says (AtlasSource), positions as the textured scan was given its origin. Around each part
/// its border's colours are repeated as far as the next part's own margin, what lies free has the
/// mean colour: so neither bilinear filtering nor the first levels of a mipmap mix charts.
/// `progress` is called with the charts done; may be empty. Rows come from the top, texture
/// coordinates (0, 0) lie at the lower left. Parallel, the same bytes for any number of threads.
BakedImage bake(LayoutSource& atlas, const AtlasPlan& plan, const TexturedScan* texture,
                const std::function<void(std::uint32_t)>& progress = {});

}  // namespace rattan
