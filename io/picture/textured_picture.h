// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include "io/layout/textured_surface.h"
#include "io/picture/panels.h"

namespace rattan {

/// A picture of a surface with its texture coordinates: options.texture, or a checkerboard of
/// `checks` fields a unit of them; by default about eight a piece that they cut the surface into,
/// or fewer where these are small. `edges`: of the pieces; by default with the checkerboard alone,
/// where there is room for them.
Image render_textured(const TexturedSurface& surface, RenderOptions options,
                      std::optional<double> checks = {}, EdgeDrawing edges = EdgeDrawing::kFit,
                      const Camera::View* view = nullptr);

}  // namespace rattan
