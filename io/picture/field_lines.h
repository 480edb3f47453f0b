// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "io/picture/camera.h"
#include "io/picture/samples.h"

namespace rattan {

/// Opacity, a pixel each, of evenly spaced lines that follow `directions` (one of the grid's) both
/// ways over the visible surface, `spacing` pixels apart and `width` wide.
std::vector<float> trace_field_lines(const SampleGrid& grid, const std::vector<Vec3f>& directions,
                                     const Camera& camera, float spacing, float width);

}  // namespace rattan
