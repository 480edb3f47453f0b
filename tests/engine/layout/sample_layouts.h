// SPDX-License-Identifier: MIT
#pragma once

// Chart layouts on small meshes, with lines along the meshes' edges.

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <vector>

#include "engine/layout/chart_graph.h"
#include "engine/layout/chart_mesh.h"
#include "tests/engine/layout/sample_meshes.h"

namespace rattan::testing {

struct SampleLayout {
  ChartGraph graph;
  std::vector<ChartMesh> charts;
};

struct LayoutRecipe {
  IndexedMesh mesh;
  std::vector<std::uint32_t> chart;  ///< one a triangle, from 0; each must leave a disk
  /// Lines within a chart, which then meets itself along them; both ends' vertices, any order.
  std::vector<std::array<std::uint32_t, 2>> lines;
  /// Vertices on lines that are nodes though only two line edges meet there.
  std::vector<std::uint32_t> nodes;
  /// Sides that an open strand and a closed one stand for.
  std::uint32_t parts = 1;
  std::uint32_t closed_parts = 4;
  bool even_steps = false;  ///< a strand's steps are even; else unusable
  bool colours = false;
};

/// Lines are where charts meet, the boundary, and `lines`. Units as ChartGraph says.
SampleLayout make_layout(const LayoutRecipe& recipe);

/// nx times ny charts of n times n squares each on a plane, of side 1 each; vertices inside charts
/// off their places by up to `jitter` squares. With unfolded coordinates.
SampleLayout plane_layout(std::uint32_t nx, std::uint32_t ny, std::uint32_t n, double jitter,
                          std::uint64_t seed);
/// nu times nv charts of n times n quads each on a torus.
LayoutRecipe torus_layout(std::uint32_t nu, std::uint32_t nv, std::uint32_t n);
/// The eight octants: charts of three sides.
LayoutRecipe octants(int levels);
/// Two half spheres beside a closed strand.
LayoutRecipe half_spheres(int levels, std::uint32_t parts);
/// A torus cut open along two circles: one chart of four sides, which meets itself.
LayoutRecipe cut_torus(std::uint32_t nu, std::uint32_t nv);
/// A round disk of so many rings and segments, one chart with nodes in `sides` places of its rim
/// (0: none, a closed strand). `place`: of radius, 0 to 1, and angle; round and flat without.
LayoutRecipe disk_layout(std::uint32_t rings, std::uint32_t segments, std::uint32_t sides,
                         const std::function<Vec3d(double, double)>& place = nullptr);
/// A ragged disk out of a grid, one chart with `sides` nodes at random.
LayoutRecipe ragged_layout(std::uint64_t seed, std::uint32_t triangles, std::uint32_t sides);
/// Moves all vertices at random; with needles, puts some on top of others or of edges too.
void disturb(IndexedMesh& mesh, double noise, double needles, std::uint64_t seed);

/// Adds test failures unless each part of the chart is a disk mapped one-to-one to its square, no
/// thinner than the floor also when rounded, and its triangles are those of `mesh` divided.
void expect_flat(const FlatChart& chart, const ChartMesh& mesh, const ChartGraph& graph);

}  // namespace rattan::testing
