// SPDX-License-Identifier: MIT
#pragma once

// Points spread evenly over a surface by area, one triangle at a time: each triangle decides by its
// number alone, so a surface may come in parts and in any order.

#include <cstdint>
#include <vector>

#include "engine/core/types.h"

namespace rattan {

double triangle_area(const Vec3d& a, const Vec3d& b, const Vec3d& c);

/// Samples per area unit for `samples` in all; 0 if the area is not positive and finite.
double sample_density(std::uint64_t samples, double area);

/// Appends the samples of one triangle: density times its area of them on average over all
/// `number`s, never more than one off. Within the triangle they follow an additive low-discrepancy
/// sequence from a start that the number decides. The same arguments give the same points anywhere.
void sample_triangle(std::uint64_t number, const Vec3d& a, const Vec3d& b, const Vec3d& c,
                     double density, std::vector<Vec3d>& points);

}  // namespace rattan
