// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "engine/core/types.h"
#include "io/picture/image.h"

namespace rattan {

/// What a triangle is, for its tint.
inline constexpr std::uint8_t kPlainTriangle = 0;
inline constexpr std::uint8_t kSingularTriangle = 1;  ///< of the parameterization
inline constexpr std::uint8_t kTriangleFace = 2;      ///< a triangle of the remesh
inline constexpr std::uint8_t kPolygonFace = 3;       ///< part of a face of five corners or more

/// What a line drawn on the surface is.
enum class LineKind : std::uint8_t {
  kChartBorder,
  kPartBorder,      ///< within a chart that was cut into quadrilaterals
  kSingularBorder,  ///< of a chart with a singularity
  kSingularEdge,    ///< of the parameterization
};

/// A straight line on the surface.
struct SurfaceLine {
  Vec3f from;
  Vec3f to;
  LineKind kind = LineKind::kChartBorder;
};

/// One part of a surface: a tile, or all of a small one. Arrays belong to the caller and must live
/// while the part is in use; those marked optional may be empty.
struct SceneMesh {
  std::span<const Vec3f> positions;  ///< relative to the scan's origin
  std::span<const LocalTriangle> triangles;
  std::span<const Vec3f> normals;         ///< optional, unit, a vertex each
  std::span<const Vec3f> corner_normals;  ///< optional, unit, three a triangle; instead of normals
  /// Optional, one a vertex: a direction of the field; any of its four quarter turns will do.
  std::span<const Vec3f> directions;
  /// Likewise, of the field before it was smoothed; zero where there was none.
  std::span<const Vec3f> raw_directions;
  /// Optional, three a triangle: (theta, phi) of its corners, continuous over the triangle. NaN
  /// where there are none.
  std::span<const std::array<float, 2>> corner_phases;
  std::span<const std::uint8_t> kinds;  ///< optional, one a triangle
  /// Optional, one a triangle: bit k is set if the edge from corner k to corner k + 1 is drawn.
  std::span<const std::uint8_t> edges;
  /// Optional, three a triangle: texture coordinates of its corners.
  std::span<const std::array<float, 2>> corner_uv;
  std::span<const Rgb> tints;          ///< optional, one a triangle: colour of its chart
  std::span<const SurfaceLine> lines;  ///< optional
};

/// Hands the parts of a surface to `use`, one after another, the same ones at each call. A part's
/// arrays need to last only as long as that call of `use`.
using SurfaceSource = std::function<void(const std::function<void(const SceneMesh&)>& use)>;

/// A source of one part. The mesh's arrays must outlive the source.
inline SurfaceSource single_part(const SceneMesh& mesh) {
  return [mesh](const std::function<void(const SceneMesh&)>& use) { use(mesh); };
}

/// A marker on the surface, hidden where the surface hides it.
struct Dot {
  Vec3f position;
  Rgb colour;
  float radius = 3.5F;   ///< pixels
  bool of_field = true;  ///< shown with the field, too, not only with the lines
};

/// How one picture of the surface looks.
enum class Look {
  kPlain,     ///< the surface alone
  kRawField,  ///< with lines that follow `raw_directions`
  kField,     ///< with lines that follow `directions`
  kIsoLines,  ///< with the lines theta, phi = k * line_period, singular triangles and edges
  kEdges,     ///< with `edges`, faces that are not quads tinted
  kCharts,    ///< with `tints` and the borders of charts
  kTexture    ///< with a checkerboard or a picture by `corner_uv`, and the borders of charts
};

}  // namespace rattan
