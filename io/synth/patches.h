// SPDX-License-Identifier: MIT
#pragma once

// The base shapes as complexes of quadrilateral patches that share corners and edges; internal to
// io/synth. Topology is exact by construction: each patch is a grid, and the vertices on its border
// are numbered by the corner or edge they lie on.
//
// Genus 0 is a sphere, six patches of a cube. Genus G is a plate with G round tunnels: two mirrored
// sheets with G holes, rounded towards the middle plane and joined there along the holes and the
// rim.

#include <array>
#include <cstdint>
#include <vector>

#include "engine/core/types.h"

namespace rattan::synth {

enum class PatchKind : std::uint8_t { kCubeFace, kTunnelSector, kPlate, kRim, kCorner };

struct BasePoint {
  Vec3d position;
  Vec3d normal;  ///< unit, outwards
};

/// Sides are 0: v = 0, 1: u = 1, 2: v = 1, 3: u = 0, each running along growing u or v; corners are
/// (0,0), (1,0), (1,1), (0,1). u cross v points outwards.
struct Patch {
  PatchKind kind = PatchKind::kCubeFace;
  std::uint8_t side = 0;  ///< face of the cube, or quarter turns in the plane
  bool bottom = false;
  double cx = 0.0, cy = 0.0;  ///< centre of the plate's cell
  std::uint32_t nu = 1, nv = 1;
  std::array<std::uint32_t, 4> corner{};
  std::array<std::uint32_t, 4> edge{};

  std::uint64_t quads() const { return std::uint64_t{nu} * nv; }
  BasePoint evaluate(double u, double v) const;
};

/// Runs from its corner of the lower number to the higher; `patch` and `side` tell where it lies.
struct PatchEdge {
  std::uint32_t patch = 0;
  std::uint8_t side = 0;
  bool reversed = false;  ///< against the direction of that side
  std::uint32_t segments = 1;
  std::uint64_t first_vertex = 0;  ///< number of the first vertex inside the edge
};

struct PatchComplex {
  std::vector<Patch> patches;
  std::vector<PatchEdge> edges;
  std::vector<std::array<std::uint32_t, 2>> corners;  ///< patch and its corner 0..3
  std::uint64_t border_vertices = 0;                  ///< on corners and edges
  double extent = 1.0;                                ///< half the size of the base shape
  double area = 1.0;

  std::uint64_t quads() const;
  /// Number of the vertex (i, j) on the patch's border.
  std::uint64_t border_vertex(const Patch& patch, std::uint32_t i, std::uint32_t j) const;
};

/// Grids chosen so that 2 quads() <= triangles <= 4 quads(), about 0.86 triangles where it can be.
/// Throws UsageError if the genus needs more triangles.
PatchComplex make_patches(int genus, std::uint64_t triangles);

}  // namespace rattan::synth
