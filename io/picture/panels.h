// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "engine/remesh/polygon_mesh.h"
#include "io/picture/render.h"
#include "io/picture/scene.h"

namespace rattan {

/// What a strip of pictures shows; everything but one of `scan` and `remesh` is optional.
struct PanelInput {
  /// The surface. Called up to four times: to choose and fit the camera (unless `shape` is given),
  /// then to draw. May be empty.
  SurfaceSource scan;
  /// Optional: the same parts with positions and triangles alone, where that is cheaper.
  SurfaceSource shape;
  bool has_curvature = false;      ///< the parts bring `raw_directions`
  bool has_field = false;          ///< the parts bring `directions`
  bool has_lines = false;          ///< the parts bring `corner_phases`
  std::vector<Dot> singularities;  ///< on the panels of field and lines
  /// Charts on the scan, with `tints`, `corner_uv` and `lines`: two panels. May be empty. Called
  /// twice.
  SurfaceSource charts;
  double chart_side = 0.0;  ///< a length on the scan
  int chart_units = 1;      ///< in texture coordinates
  /// May be null. Shown on its own panel.
  const PolygonMesh* remesh = nullptr;
  /// Remesh position + remesh_shift is relative to the same origin as the scan.
  Vec3d remesh_shift{0.0, 0.0, 0.0};
  bool irregular_dots = true;  ///< mark vertices of the remesh where other than four edges meet
  bool close_up = false;       ///< one more panel: the remesh around what is nearest to the eye
  /// Box of everything shown, for the camera.
  Vec3d low{0.0, 0.0, 0.0};
  Vec3d high{0.0, 0.0, 0.0};
  /// Under the panels, in their order; missing ones stay blank.
  std::string scan_label = "scan";
  std::string curvature_label = "curvature directions";
  std::string field_label = "field";
  std::string lines_label = "iso-lines";
  std::string charts_label = "charts";
  std::string texture_label = "parameterization";
  std::string remesh_label = "remesh";
  std::string close_up_label = "close-up";
};

/// Panels, in the order of PGP Figure 1: scan, field before and after smoothing, iso-lines with
/// singularities, charts, their texture coordinates, remesh with its edges, close-up; each at most
/// options.width x options.height, and a label. Panels without data are left out; up to four stand
/// in one row, more in two. `view` null: the default view.
Image render_panels(const PanelInput& input, const RenderOptions& options,
                    const Camera::View* view = nullptr);

/// Whether the edges of a mesh are drawn: kFit draws them where they leave its faces to be seen.
enum class EdgeDrawing { kFit, kAlways, kNever };

/// One picture of a polygon mesh, without a label; for `rattan render`.
Image render_polygons(const PolygonMesh& mesh, const RenderOptions& options,
                      const Camera::View* view = nullptr, EdgeDrawing edges = EdgeDrawing::kAlways);

}  // namespace rattan
