// SPDX-License-Identifier: MIT
#pragma once

// What texture coordinates look like on a surface: a checkerboard, or a picture.

#include <vector>

#include "io/picture/image.h"

namespace rattan {

/// Share of the light fields of a checkerboard in a rectangle of width x height about (x, y), in
/// fields. The origin is the middle of a light field, so that a board with an even number of fields
/// a chart side goes on across every border, whichever way the charts are turned.
float light_share(float x, float y, float width, float height);

/// A picture to look up at any scale, in about four bytes a pixel.
class PictureTexture {
 public:
  /// Pre: it has pixels.
  explicit PictureTexture(Image picture);
  /// At texture coordinates (v upward; the picture repeats), averaged over about `extent` of them.
  Rgb at(float u, float v, float extent) const;

 private:
  std::vector<Image> levels_;  // each half as wide and high as the one before
};

}  // namespace rattan
