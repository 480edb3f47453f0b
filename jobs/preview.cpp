// SPDX-License-Identifier: MIT
#include "jobs/preview.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <vector>

#include "engine/core/exact_math.h"
#include "engine/field/curvature.h"
#include "engine/field/tangent_frame.h"
#include "engine/layout/base_complex.h"
#include "engine/param/phase_fields.h"
#include "engine/param/triangle_coordinates.h"
#include "io/picture/panels.h"
#include "jobs/chart_scene.h"

namespace rattan {

namespace {

constexpr Rgb kFieldSingularity = {214, 60, 46};
constexpr Rgb kPhaseSingularity = {38, 98, 178};

/// Below this fidelity (in [0, 1]) a direction of curvature is noise: the panel stays blank there.
constexpr double kLeastFidelity = 0.05;

/// One tile as the renderer wants it: owned triangles with normals, directions and phases.
class TilePart {
 public:
  TilePart(const PreviewInput& input, TileId tile, bool with_field, bool with_lines)
      : mesh_(load_tile(input.store, input.scan, tile)), is_layout_(input.charts != nullptr) {
    if (with_field) {
      frames_ = read_local(input.store, fields::kFrame, fields::kMeshHalo, tile);
      for (const VertexFrame& f : frames_) {
        directions_.push_back(f.direction);
      }
      compute_raw_directions(read_local(input.store, fields::kCurvature, fields::kMeshHalo, tile),
                             1e-3 / std::max(input.scan.mean_edge_length, 1e-30));
      compute_normals();
    }
    if (with_lines) {
      const std::vector<PairValue> phases =
          read_local(input.store, fields::kPhase, fields::kMeshHalo, tile);
      coordinates_ = tile_coordinates(mesh_, frames_, phases, input.omega);
      compute_phases();
      if (input.charts != nullptr) {
        find_singular_edges();
      }
    }
  }

  SceneMesh scene() const {
    SceneMesh s;
    s.positions = mesh_.positions.span();
    s.triangles = mesh_.triangles.span().first(mesh_.counts.owned);
    s.normals = normals_;
    s.directions = directions_;
    s.raw_directions = raw_directions_;
    s.corner_phases = phases_;
    s.kinds = kinds_;
    s.lines = singular_edges_;
    return s;
  }

  /// At triangles whose coordinates don't close.
  void add_poles(std::vector<Dot>& dots) const {
    for (std::uint32_t t = 0; t < kinds_.size(); ++t) {
      if (kinds_[t] == kPlainTriangle) {
        continue;
      }
      const EdgeTransport around = coordinates_.holonomy(t);
      if (around == EdgeTransport{}) {
        continue;  // folded over, no pole
      }
      const LocalTriangle& c = mesh_.triangles[t];
      const Vec3f middle =
          (mesh_.positions[c[0]] + mesh_.positions[c[1]] + mesh_.positions[c[2]]) / 3.0F;
      dots.push_back({middle, around.r != 0 ? kFieldSingularity : kPhaseSingularity, 3.0F,
                      !is_layout_ || around.r != 0});
    }
  }

 private:
  void compute_raw_directions(const std::vector<CurvatureMeasure>& curvature, double floor) {
    raw_directions_.assign(frames_.size(), Vec3f::Zero());
    for (std::size_t v = 0; v < frames_.size(); ++v) {
      const TangentFrame f = tangent_frame(frames_[v].normal.cast<double>());
      const PrincipalDirections d = principal_directions(curvature[v], f.x, f.y, floor);
      if (d.fidelity > kLeastFidelity) {
        const Complexd a = symmetry_root(unit_or(d.doubled, Complexd(1.0, 0.0)), 2);
        raw_directions_[v] = (a.real() * f.x + a.imag() * f.y).cast<float>();
      }
    }
  }

  void find_singular_edges() {
    TileSingularities where;
    count_singularities(mesh_, coordinates_, &where);
    for (const std::uint32_t e : where.edges) {
      const TileEdge& edge = coordinates_.edges[e];
      singular_edges_.push_back(
          {mesh_.positions[edge.lo], mesh_.positions[edge.hi], LineKind::kSingularEdge});
    }
  }

  void compute_normals() {
    normals_.assign(mesh_.local_vertices(), Vec3f::Zero());
    for (const LocalTriangle& t : mesh_.triangles) {
      const Vec3f n = (mesh_.positions[t[1]] - mesh_.positions[t[0]])
                          .cross(mesh_.positions[t[2]] - mesh_.positions[t[0]]);
      for (const std::uint32_t v : t) {
        normals_[v] += n;
      }
    }
    // A halo vertex sees only some of its triangles; the frame's normal is close to the whole sum.
    for (std::uint32_t v = 0; v < normals_.size(); ++v) {
      const float length = normals_[v].norm();
      normals_[v] =
          v < mesh_.extent.owned && length > 0.0F ? Vec3f(normals_[v] / length) : frames_[v].normal;
    }
  }

  void compute_phases() {
    constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
    constexpr double kPeriod = 2.0 * exact::kPi;
    phases_.assign(3 * static_cast<std::size_t>(mesh_.counts.owned), {kNone, kNone});
    kinds_.assign(mesh_.counts.owned, kPlainTriangle);
    for (std::uint32_t t = 0; t < mesh_.counts.owned; ++t) {
      if (!(coordinates_.holonomy(t) == EdgeTransport{})) {
        kinds_[t] = kSingularTriangle;
        continue;
      }
      const LocalTriangle& c = mesh_.triangles[t];
      EdgeTransport to_first;
      for (std::uint32_t k = 0; k < 3; ++k) {
        double a = coordinates_.angles[c[k]].theta;
        double b = coordinates_.angles[c[k]].phi;
        quarter_turns(to_first.r, a, b);
        phases_[3 * t + k] = {static_cast<float>(a + kPeriod * to_first.s),
                              static_cast<float>(b + kPeriod * to_first.t)};
        to_first = compose(to_first, coordinates_.side_transport(3 * t + k));
      }
      const auto& p = &phases_[3 * t];
      const float area =
          (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[2][0] - p[0][0]) * (p[1][1] - p[0][1]);
      if (area < 0.0F) {
        kinds_[t] = kSingularTriangle;
      }
    }
  }

  TileMesh mesh_;
  std::vector<VertexFrame> frames_;
  TileCoordinates coordinates_;
  std::vector<Vec3f> normals_;
  std::vector<Vec3f> directions_;
  std::vector<Vec3f> raw_directions_;
  std::vector<std::array<float, 2>> phases_;
  std::vector<std::uint8_t> kinds_;
  std::vector<SurfaceLine> singular_edges_;
  bool is_layout_;
};

}  // namespace

void write_preview(const PreviewInput& input, const std::string& path,
                   const RenderOptions& options) {
  const bool field = input.store.has_chunk(fields::kFrame.name, TileId(0)) &&
                     input.store.has_chunk(fields::kCurvature.name, TileId(0));
  const bool lines =
      field && input.omega > 0.0 && input.store.has_chunk(fields::kPhase.name, TileId(0));
  const std::uint32_t tiles = input.scan.layout.tile_count();
  const auto source = [&](bool with_field, bool with_lines) {
    return
        [&input, tiles, with_field, with_lines](const std::function<void(const SceneMesh&)>& use) {
          for (std::uint32_t t = 0; t < tiles; ++t) {
            use(TilePart(input, TileId(t), with_field, with_lines).scene());
          }
        };
  };
  PanelInput panels;
  panels.scan = source(field, lines);
  panels.shape = source(false, false);
  panels.has_curvature = panels.has_field = field;
  panels.has_lines = lines;
  for (std::uint32_t t = 0; lines && t < tiles; ++t) {
    TilePart(input, TileId(t), field, lines).add_poles(panels.singularities);
  }
  panels.remesh = input.remesh;
  panels.close_up = input.remesh != nullptr;
  panels.low = input.scan.box_min;
  panels.high = input.scan.box_max;
  panels.field_label = "smoothed field";
  panels.lines_label = "iso-lines and singularities";
  RenderOptions how = options;
  how.line_period = 2.0 * exact::kPi / input.density;
  PolygonMesh base;
  std::vector<Rgb> tints;
  if (input.charts != nullptr) {
    const ChartGraph& graph = input.charts->graph;
    tints = chart_tints(graph);
    panels.charts = [&](const std::function<void(const SceneMesh&)>& use) {
      for (std::uint32_t t = 0; t < tiles; ++t) {
        use(ChartPart(input.store, graph, tints, TileId(t)).scene());
      }
    };
    panels.chart_side = input.omega;
    panels.chart_units = static_cast<int>(graph.units);
    base = base_complex(*input.charts, *input.flat);
    panels.remesh = &base;
    // As in PGP Figure 1.
    panels.has_curvature = false;
    how.line_period = exact::kPi;
    panels.scan_label = "A  scan";
    panels.field_label = "B  smoothed directions";
    panels.lines_label = "C  iso-lines and singularities";
    panels.charts_label = "D  charts";
    panels.texture_label = "E  parameterization";
    panels.remesh_label = "F  base complex";
  }
  write_png(render_panels(panels, how), path);
}

}  // namespace rattan
