// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "io/picture/panels.h"

namespace rattan {

struct PictureOptions {
  std::string path;    ///< a mesh, a scan, or a kept work directory
  std::string output;  ///< PNG
  int width = 1200;    ///< pixels; of a work directory's picture, those of one panel at most
  int height = 1200;
  ViewWish view;
  EdgeDrawing edges = EdgeDrawing::kFit;
};

/// A file is drawn from memory (about 200 bytes a face), a work directory tile by tile with the
/// panels of the preview, as far as the work came. Throws UsageError for an output that is no .png,
/// InputError, ResourceError.
void render_picture(const PictureOptions& options);

}  // namespace rattan
