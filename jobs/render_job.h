// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "io/picture/panels.h"

namespace rattan {

inline constexpr const char* kCheckerboard = "checker";

struct PictureOptions {
  std::string path;    ///< a mesh, a scan, or a kept work directory
  std::string output;  ///< PNG
  int width = 1200;    ///< pixels; of a work directory's picture, those of one panel at most
  int height = 1200;
  ViewWish view;
  EdgeDrawing edges = EdgeDrawing::kFit;
  /// Of a file with texture coordinates: kCheckerboard, or a PNG or JPEG file. Empty: none.
  std::string texture;
  /// Fields of the checkerboard along a unit of texture coordinates; 0: about eight a chart.
  double checks = 0.0;
};

/// A file is drawn from memory (about 200 bytes a face, 500 with a texture), a work directory tile
/// by tile with the panels of the preview, as far as the work came. Throws UsageError for an output
/// that is no .png or a texture on a work directory, InputError, ResourceError.
void render_picture(const PictureOptions& options);

}  // namespace rattan
