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
  /// The surface, called up to four times: to choose and fit the camera, then to draw. May be
  /// empty.
  SurfaceSource scan;
  bool has_field = false;          ///< the parts bring `directions`
  bool has_lines = false;          ///< the parts bring `corner_phases`
  std::vector<Dot> singularities;  ///< on the panels of field and lines
  /// May be null. Shown on its own panel.
  const PolygonMesh* remesh = nullptr;
  /// Remesh position + remesh_shift is relative to the same origin as the scan.
  Vec3d remesh_shift{0.0, 0.0, 0.0};
  bool irregular_dots = true;  ///< mark vertices of the remesh where other than four edges meet
  /// Box of everything shown, for the camera.
  Vec3d low{0.0, 0.0, 0.0};
  Vec3d high{0.0, 0.0, 0.0};
  /// Under the panels, in their order; missing ones stay blank.
  std::string scan_label = "scan";
  std::string field_label = "field";
  std::string lines_label = "iso-lines";
  std::string remesh_label = "remesh";
};

/// Panels from left to right: scan, field, iso-lines with singularities, remesh with its edges,
/// each options.width x options.height and a label. Panels without data are left out. `view` null:
/// the default view.
Image render_panels(const PanelInput& input, const RenderOptions& options,
                    const Camera::View* view = nullptr);

/// One picture of a polygon mesh with its edges, without a label; for `rattan render`.
Image render_polygons(const PolygonMesh& mesh, const RenderOptions& options,
                      const Camera::View* view = nullptr);

}  // namespace rattan
