// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include "io/picture/camera.h"
#include "io/picture/image.h"
#include "io/picture/scene.h"
#include "io/picture/texture.h"

namespace rattan {

struct RenderOptions {
  int width = 640;   ///< pixels
  int height = 640;  ///< pixels
  int samples = 3;   ///< rays a pixel are samples * samples
  /// Lines are drawn where theta or phi is a multiple of this; radians.
  double line_period = 3.14159265358979323846;
  float line_width = 1.3F;  ///< pixels
  /// Fields of a checkerboard along a unit of texture coordinates.
  float checks = 8.0F;
  const PictureTexture* texture = nullptr;  ///< instead of a checkerboard
  float field_spacing = 7.0F;               ///< pixels between neighbouring lines of the field
  ViewWish view;                            ///< changes to the default view
  std::size_t resident_triangles = 2'000'000;
  Rgb surface{216, 211, 202};
  Rgb background{255, 255, 255};
};

/// The surface once more, cut otherwise and with other arrays, and what is drawn of that.
struct Overlay {
  SurfaceSource surface;
  std::span<const Look> looks;
};

/// Bytes that render() holds for the picture itself, whatever the surface.
std::size_t render_bytes(const RenderOptions& options, std::size_t looks);

/// Pictures of one surface, one for each look, from the camera (whose frame must be fitted to width
/// and height). Part after part is put into an Embree scene and its nearest hits are kept, then
/// once more for ambient occlusion and the shadow of the key light; up to resident_triangles the
/// scenes are kept in between. Memory: render_bytes(), about 150
/// bytes a triangle of the largest part, and the kept scenes.
///
/// `dots` go on every picture but plain ones, those of the field before it was smoothed, and the
/// overlay's. The overlay's pictures come behind the others, which show what lies where and how it
/// is lit; its parts are never kept.
std::vector<Image> render(const SurfaceSource& surface, const Camera& camera,
                          std::span<const Look> looks, std::span<const Dot> dots,
                          const RenderOptions& options, const Overlay& overlay = {});

}  // namespace rattan
