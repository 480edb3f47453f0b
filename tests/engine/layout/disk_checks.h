// SPDX-License-Identifier: MIT
#pragma once

// Disks to cut, and what must hold of their parts.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/layout/split_chart.h"
#include "tests/engine/layout/sample_meshes.h"

namespace rattan::testing {

struct Disk {
  std::vector<Vec3d> position;
  std::vector<std::array<std::uint32_t, 3>> triangle;
};

/// Counter-clockwise, from the lowest vertex on.
std::vector<std::uint32_t> rim_of(const Disk& disk);
/// `count` of the rim, evenly spread, from the first on.
std::vector<std::uint32_t> even_middles(const Disk& disk, std::uint32_t count);

/// Rings of `sectors` vertices around a hub, radii up to 1, in the plane.
Disk ring_disk(std::uint32_t rings, std::uint32_t sectors);
/// A triangulated polygon of `sides` vertices with `inside` vertices put in at random places and
/// edges flipped at random. On the unit circle and in it, height 0; with `folded` 3D noise of that
/// size; a share of `collapsed` vertices where a neighbour lies.
Disk random_disk(std::uint32_t sides, std::uint32_t inside, double folded, double collapsed,
                 Random& random);

/// Where each vertex of a cut disk lies in the input: shares of at most three of its vertices, in
/// ascending order.
struct Support {
  std::vector<std::uint32_t> vertex;
  std::vector<double> share;
};
std::vector<Support> supports(const Disk& disk, const SplitDisk& cut);

/// Adds test failures unless `cut` is what split_disk promises.
void expect_split(const Disk& disk, const std::vector<std::uint32_t>& middles,
                  const SplitDisk& cut);

double length_of(const SplitDisk& cut, const std::vector<std::uint32_t>& way);
/// The shortest way from the centre to middle i along edges of the input that keeps off rim and
/// spokes before; infinite if there is none. The centre must be a vertex of the input.
double edge_way(const Disk& disk, const std::vector<std::uint32_t>& middles, const SplitDisk& cut,
                std::size_t i);

}  // namespace rattan::testing
