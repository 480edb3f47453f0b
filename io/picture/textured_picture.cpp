// SPDX-License-Identifier: MIT
#include "io/picture/textured_picture.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/core/errors.h"
#include "io/picture/polygon_scene.h"

namespace rattan {
namespace {

constexpr double kFieldsOfPiece = 8.0;
constexpr double kLeastField = 7.0;  // pixels
constexpr double kLeastPiece = 14.0;

/// A power of two, so that in Rattan's layouts, whose charts are one or two units wide, fields go
/// on across borders.
double fitting_checks(const TexturePieces& pieces, const Camera& camera) {
  if (!(pieces.uv_area > 0.0)) {
    return 1.0;
  }
  const double side = std::sqrt(pieces.uv_area / static_cast<double>(pieces.count));
  double checks = std::exp2(std::round(std::log2(kFieldsOfPiece / side)));
  const double unit = pixels_of(std::sqrt(pieces.area / pieces.uv_area), camera);
  for (double least = 2.0 / side; checks > 1.5 * least && unit < kLeastField * checks;) {
    checks *= 0.5;
  }
  return checks;
}

}  // namespace

Image render_textured(const TexturedSurface& surface, RenderOptions options,
                      std::optional<double> checks, EdgeDrawing edges, const Camera::View* view) {
  ensure(surface.mesh.face_count() > 0, "a picture shows something");
  const Vec3d shift = -middle_of(surface.mesh);
  const PolygonScene scene(surface.mesh, shift);
  const Camera camera = camera_for(scene, options, view);
  const TexturePieces pieces = texture_pieces(surface, shift);
  options.checks = static_cast<float>(checks ? *checks : fitting_checks(pieces, camera));
  SceneMesh mesh = scene.mesh();
  mesh.corner_uv = surface.corner_uv;
  const double piece =
      std::sqrt(pieces.area / static_cast<double>(std::max<std::uint64_t>(pieces.count, 1)));
  if (edges == EdgeDrawing::kAlways || (edges == EdgeDrawing::kFit && options.texture == nullptr &&
                                        pixels_of(piece, camera) >= kLeastPiece)) {
    mesh.lines = pieces.seams;
  }
  const Look look = Look::kTexture;
  return std::move(render(single_part(mesh), camera, {&look, 1}, {}, options).front());
}

}  // namespace rattan
