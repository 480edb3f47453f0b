// SPDX-License-Identifier: MIT
#include "engine/remesh/refine_creases.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "engine/remesh/cell_map.h"
#include "engine/remesh/crease_curve.h"
#include "engine/remesh/pair_triangles.h"
#include "engine/remesh/repair.h"
#include "engine/remesh/split_cells.h"
#include "engine/remesh/split_polygon.h"
#include "engine/remesh/triangle_index.h"

namespace rattan {

namespace {

constexpr int kRounds = 6;
/// Parts of one edge in a round.
constexpr int kMostParts = 8;
/// Of the tolerance, for parts: distances are sampled.
constexpr double kPartTolerance = 0.9;
/// Of an edge, the part at each end where it isn't divided at a point that was missed.
constexpr double kEnd = 0.1;
/// Quads between two triangles that become quads together.
constexpr std::uint32_t kPairBetween = 3;
/// Of a step of irregularity in the choice of diagonals.
constexpr double kBias = 0.2;
/// Edges shorter than this many tolerances stay whole.
constexpr double kShortest = 6.0;

struct Division {
  std::uint32_t u, v;
  std::vector<Vec3d> at;  ///< from u to v
};

/// Finds the fewest points on an edge's curve so that the chords between them lie near it.
class Divider {
 public:
  Divider(const CreaseCurve& creases, double tolerance)
      : creases_(creases), tolerance_(tolerance) {}

  /// Points between p and q, in order; none where the edge itself lies near the curve, or all of it
  /// so far off that the curve isn't its own.
  const std::vector<Vec3d>& divide(const Vec3d& p, const Vec3d& q, std::uint32_t curve) {
    points_.clear();
    const double length = (q - p).norm();
    const double off = distance(p, q, curve);
    if (off <= tolerance_ || off >= 0.5 * length || length <= kShortest * tolerance_) {
      return points_;
    }
    for (int parts = 2; parts <= kMostParts; ++parts) {
      place(p, q, curve, parts);
      if (length <= kShortest * tolerance_ * parts || near(p, q, curve)) {
        break;
      }
    }
    return points_;
  }

 private:
  /// Bent outwards by half the height of the arcs, as optimise() does.
  void place(const Vec3d& p, const Vec3d& q, std::uint32_t curve, int parts) {
    on_.assign(1, p);
    for (int k = 1; k < parts; ++k) {
      on_.push_back(creases_.closest(p + static_cast<double>(k) / parts * (q - p), curve));
    }
    on_.push_back(q);
    points_.clear();
    for (std::size_t k = 1; k + 1 < on_.size(); ++k) {
      const Vec3d chord = on_[k + 1] - on_[k - 1];
      Vec3d umbrella = 0.5 * (on_[k - 1] + on_[k + 1]) - on_[k];
      umbrella -= umbrella.dot(chord) / std::max(chord.squaredNorm(), 1e-300) * chord;
      const double out = 0.125 * umbrella.norm();
      const double most = 0.5 * tolerance_;
      points_.push_back(on_[k] - 0.125 * std::min(1.0, most / std::max(out, 1e-300)) * umbrella);
    }
  }

  bool near(const Vec3d& p, const Vec3d& q, std::uint32_t curve) const {
    for (std::size_t k = 0; k <= points_.size(); ++k) {
      const Vec3d& from = k == 0 ? p : points_[k - 1];
      const Vec3d& to = k == points_.size() ? q : points_[k];
      if (distance(from, to, curve) > kPartTolerance * tolerance_) {
        return false;
      }
    }
    return true;
  }

  double distance(const Vec3d& p, const Vec3d& q, std::uint32_t curve) const {
    double off = 0.0;
    for (const double t : {0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875}) {
      const Vec3d x = p + t * (q - p);
      off = std::max(off, (creases_.closest(x, curve) - x).norm());
    }
    return off;
  }

  const CreaseCurve& creases_;
  double tolerance_;
  std::vector<Vec3d> on_, points_;
};

/// Points of the curves that are far from the edges that follow them: the farthest of each edge.
void add_missed_points(const PolygonMesh& mesh, const FeatureSet& features,
                       const std::vector<std::uint32_t>& curves, double tolerance,
                       std::vector<Division>& out) {
  std::vector<Vec3f> ends;
  std::vector<LocalTriangle> segments;
  for (const auto& edge : mesh.feature_edges) {
    const auto i = static_cast<std::uint32_t>(ends.size());
    for (const std::uint32_t v : edge) {
      ends.push_back(mesh.positions[v].cast<float>());
    }
    segments.push_back({i, i + 1, i});
  }
  if (segments.empty()) {
    return;
  }
  const TriangleIndex index(ends, segments, 0, curves);
  std::vector<double> worst(segments.size(), tolerance);
  std::vector<Vec3d> where(segments.size(), Vec3d::Zero());
  for (const FeatureEdge& e : features.edges()) {
    if (e.boundary) {
      continue;
    }
    for (const Vec3f& end : {e.p_lo, e.p_hi}) {
      const Vec3d p = end.cast<double>();
      ClosestHit hit;
      index.closest_labelled(p, e.curve, hit);
      if (hit.triangle == kNoTriangle) {
        continue;
      }
      const auto& [u, v] = mesh.feature_edges[hit.triangle];
      const Vec3d along = mesh.positions[v] - mesh.positions[u];
      const double length2 = along.squaredNorm();
      const double t = length2 > 0.0 ? (p - mesh.positions[u]).dot(along) / length2 : 0.0;
      const double off = (mesh.positions[u] + t * along - p).norm();
      if (t > kEnd && t < 1.0 - kEnd && off > worst[hit.triangle] &&
          off < 0.5 * std::sqrt(length2)) {
        worst[hit.triangle] = off;
        where[hit.triangle] = p;
      }
    }
  }
  for (std::size_t i = 0; i < segments.size(); ++i) {
    if (worst[i] > tolerance) {
      out.push_back({mesh.feature_edges[i][0], mesh.feature_edges[i][1], {where[i]}});
    }
  }
}

std::vector<Division> find_divisions(const PolygonMesh& mesh, const CreaseCurve& creases,
                                     const FeatureSet& features, double tolerance) {
  const CreaseVertices at = crease_vertices(mesh, creases);
  Divider divider(creases, tolerance);
  std::vector<Division> out;
  std::vector<std::uint32_t> curves;  // one a feature edge
  for (const auto& [u, v] : mesh.feature_edges) {
    const Vec3d& p = mesh.positions[u];
    const Vec3d& q = mesh.positions[v];
    const std::uint32_t whole = creases.between(p, q);
    const std::uint32_t curve = at.curve[u] != kNoCurve   ? at.curve[u]
                                : at.curve[v] != kNoCurve ? at.curve[v]
                                : whole != kNoCurve       ? whole
                                                          : creases.nearest_curve(0.5 * (p + q));
    curves.push_back(curve);
    const std::vector<Vec3d>& points = divider.divide(p, q, curve);
    if (!points.empty()) {
      out.push_back({u, v, points});
    }
  }
  if (out.empty() && features.has_clear_edges()) {
    add_missed_points(mesh, features, curves, tolerance, out);
  }
  return out;
}

/// Splits the faces beside divided edges, whose new vertices will stay where they are.
void split_beside(CellMap& map, std::vector<std::uint32_t>& faces) {
  std::sort(faces.begin(), faces.end());
  faces.erase(std::unique(faces.begin(), faces.end()), faces.end());
  PolygonSplitter splitter;
  PolygonCorners corners;
  std::vector<std::uint32_t> halves;
  for (const std::uint32_t f : faces) {
    if (!map.is_cell(f) || map.degree(f) > kSplitMaxCorners / 2) {
      continue;
    }
    map.face_halves(f, halves);
    gather_corners(map, halves, {}, corners);
    corners.firm.clear();
    corners.bias.clear();
    for (std::size_t i = 0; i < halves.size(); ++i) {
      const bool firm = map.on_feature(map.origin(halves[i]));
      corners.firm.push_back(firm ? 1 : 0);
      const std::uint32_t v = map.origin(halves[i]);
      const std::uint32_t valence = map.valence(v);
      corners.bias.push_back(kBias *
                             (irregularity(map, v, valence + 1) - irregularity(map, v, valence)));
      if (firm) {  // the mean of both sides of the crease says nothing about this one
        corners.normal[i] = Vec3d::Zero();
      }
    }
    const PolygonSplit split = splitter.split(corners, false, true);
    if (split.feasible) {
      apply_split(map, halves, split);
    }
  }
}

}  // namespace

std::uint64_t refine_creases(PolygonMesh& mesh, const FeatureSet& features, double tolerance) {
  const CreaseCurve creases(&features);
  std::uint64_t added = 0;
  if (creases.empty()) {
    return added;
  }
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<Division> divisions = find_divisions(mesh, creases, features, tolerance);
    if (divisions.empty()) {
      break;
    }
    CellMap map(std::move(mesh));
    map.set_normals({});
    std::vector<std::uint32_t> faces;
    for (const Division& d : divisions) {
      std::uint32_t h = map.find_half(d.u, d.v);
      if (h == CellMap::kNone) {
        continue;
      }
      faces.push_back(map.face(h));
      faces.push_back(map.face(CellMap::twin(h)));
      for (const Vec3d& p : d.at) {
        h = map.split_edge(h, p);
        ++added;
      }
    }
    split_beside(map, faces);
    split_cells(map);
    pair_triangles(map, kPairBetween, true);
    repair(map);
    mesh = map.to_mesh();
  }
  return added;
}

}  // namespace rattan
