// SPDX-License-Identifier: MIT
#pragma once

// Layouts made of polygon meshes: every face is a chart, its texture coordinates a grid.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/layout/chart_graph.h"
#include "engine/layout/layout_source.h"
#include "engine/remesh/polygon_mesh.h"

namespace rattan::testing {

struct NamedPolygons {
  std::string name;
  PolygonMesh mesh;
};

PolygonMesh polygon_cube();
/// Quads; every `triangle_every`-th is two triangles instead (0: none).
PolygonMesh polygon_torus(std::uint32_t n, std::uint32_t m, std::uint32_t triangle_every = 0);
/// n x m quads over a wavy height field, with a rectangular hole where asked.
PolygonMesh polygon_grid(std::uint32_t n, std::uint32_t m, bool hole = false);
/// Closed, over a regular n-gon.
PolygonMesh polygon_prism(std::uint32_t n);
/// Of every kind: closed and with boundaries, genus 0 and 1, faces of 3 to 9 corners, several
/// components.
std::vector<NamedPolygons> polygon_meshes();

/// Faces are charts, edges are strands; two units if any face has not four corners.
ChartGraph chart_graph_of(const PolygonMesh& mesh);

struct PolygonLayoutOptions {
  std::uint32_t cells = 3;  ///< of the grid, a unit
  double warp = 0.0;        ///< how unevenly points lie on strands, up to about 0.1
  bool colours = false;
  std::uint32_t vertices_at_once = 7;  ///< handed out by for_each_vertices
};

/// Parts are grids, bilinear between their corners. Vertices of strands are shared.
class PolygonLayout : public LayoutSource {
 public:
  explicit PolygonLayout(const PolygonMesh& mesh, const PolygonLayoutOptions& options = {});

  LayoutSize size() const override;
  void for_each_vertices(const std::function<void(const LayoutVertices&)>& f) override;
  void for_each_chart(const std::function<void(const LayoutChart&)>& f) override;

  ChartGraph graph;
  std::vector<FlatChart> charts;  ///< tests may spoil them
  std::vector<Vec3d> positions;
  std::vector<Rgba> colours;

 private:
  PolygonLayoutOptions options_;
};

}  // namespace rattan::testing
