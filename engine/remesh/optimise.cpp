// SPDX-License-Identifier: MIT
// Shape matching with momentum and the quadric relocation as measured by an earlier prototype; the
// tangent-plane slide between projections is what makes them cheap: closest points cost ten times
// what all the rest of a step costs.
#include "engine/remesh/optimise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "engine/core/exact_math.h"
#include "engine/core/parallel.h"
#include "engine/remesh/boundary_curve.h"
#include "engine/remesh/crease_curve.h"
#include "engine/remesh/edge_sort.h"
#include "engine/remesh/project_vertices.h"
#include "engine/remesh/quadric.h"
#include "engine/remesh/shape_pull.h"
#include "engine/remesh/vertex_motion.h"
#include "engine/remesh/vertex_stars.h"

namespace rattan {

namespace {

constexpr std::size_t kGrain = 1024;
// The last steps carry less over, so that what still swings comes to rest.
constexpr int kLastSteps = 4;
constexpr double kLastMomentum = 0.5;
// Forces change faster than matched shapes do.
constexpr double kPullMomentum = 0.8;
// Of the edge length, in one step of pulling.
constexpr double kLongestPull = 0.1;
// Relocation leaves a vertex at the mean height of the scan around it; on a smooth surface a mesh
// whose vertices stand as high again above that is nearest in the mean. The umbrella vector of a
// square of side h has length (k1 + k2) h^2 / 4 along the normal, the height is (k1 + k2) h^2 / 24.
constexpr double kLift = 1.0 / 6.0;
// Mean squared sine between the scan's normals and the vertex' where a vertex is on a crease, not
// on a smooth surface: no lift there.
constexpr double kCrease = 0.1;
constexpr int kStepsPerNormal = 2;
// Of the scan's diagonal: how far a vertex may leave its crease.
constexpr double kMostOffCrease = 0.8e-3;

/// cos and sin of 2 pi k / n for every degree n in use, and the circumradius of unit sides.
struct RegularPolygons {
  struct Polygon {
    std::vector<double> cos;
    std::vector<double> sin;
    double radius = 0.0;
  };
  std::vector<Polygon> of_degree;

  explicit RegularPolygons(const PolygonMesh& mesh) {
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
      const std::size_t n = mesh.degree(f);
      if (n >= of_degree.size()) {
        of_degree.resize(n + 1);
      }
      if (of_degree[n].cos.empty()) {
        for (std::size_t k = 0; k < n; ++k) {
          const auto turn =
              exact::sincos(2.0 * exact::kPi * static_cast<double>(k) / static_cast<double>(n));
          of_degree[n].cos.push_back(turn.cos);
          of_degree[n].sin.push_back(turn.sin);
        }
        of_degree[n].radius = 0.5 / exact::sincos(exact::kPi / static_cast<double>(n)).sin;
      }
    }
  }
};

class Optimiser {
 public:
  Optimiser(PolygonMesh& mesh, Store& store, const ScanMesh& scan, SurfaceProjector& projector,
            const OptimiseOptions& options, TaskGraph& graph)
      : mesh_(mesh),
        store_(store),
        scan_(scan),
        projector_(projector),
        options_(options),
        graph_(graph),
        stars_(mesh),
        polygons_(mesh),
        curve_(store, scan, graph),
        creases_(options.features),
        crease_(crease_vertices(mesh, creases_)) {
    const std::size_t n = mesh_.vertex_count();
    if (mesh_.scan_triangle.size() != n) {
      mesh_.scan_triangle.assign(n, kNoTriangle);
    }
    VertexMotions motions = vertex_motions(mesh_, stars_, &curve_, crease_, options.hold_curves);
    motion_ = std::move(motions.motion);
    loop_ = std::move(motions.loop);
    beside_crease_.assign(mesh_.face_count(), 0);
    for (std::size_t f = 0; f < mesh_.face_count(); ++f) {
      for (const std::uint32_t v : mesh_.face(f)) {
        beside_crease_[f] |= crease_.degree[v] > 0 ? 1 : 0;
      }
    }
    list_neighbors();
    face_normal_.resize(mesh_.face_count());
    edge_length_ = mean_edge_length(mesh_);
  }

  OptimiseReport run() {
    refresh_normals();
    report_.inverted_before = count_inverted();
    velocity_.assign(mesh_.vertex_count(), Vec3d::Zero());
    anchor_ = checkpoint_ = mesh_.positions;
    corner_target_.resize(mesh_.corners.size());
    iterate(options_.steps, options_.momentum, [this] { advance(); });
    corner_target_ = {};
    std::fill(velocity_.begin(), velocity_.end(), Vec3d::Zero());
    pull_.resize(mesh_.corners.size());
    iterate(options_.pull_steps, std::min(options_.momentum, kPullMomentum), [this] { pull(); });
    pull_ = {};
    if (options_.relocate) {
      relocate();
    }
    bend_creases();
    untangle();
    refresh_normals();
    report_.inverted_after = count_inverted();
    return report_;
  }

 private:
  /// Steps in the tangent planes, each `step` once; ends on the scan.
  template <class Step>
  void iterate(int steps, double momentum, const Step& step) {
    for (int k = 1; k <= steps; ++k) {
      momentum_ = steps - k < kLastSteps ? std::min(kLastMomentum, momentum) : momentum;
      step();
      ++report_.steps;
      if (k % options_.steps_per_projection == 0 || k == steps) {
        project();
        revert_degraded(checkpoint_);
        checkpoint_ = mesh_.positions;
      } else if (k % kStepsPerNormal != 0) {
        continue;
      }
      anchor_ = mesh_.positions;
      refresh_normals();
    }
  }

  /// Normals that faces and vertices keep until the next call.
  void refresh_normals() {
    vertex_normal_ = vertex_normals(mesh_, stars_);
    parallel_indices(mesh_.face_count(), [&](std::size_t f) {
      if (beside_crease_[f] != 0) {
        // Normals of vertices on creases lean to the other side; a face that is folded has its
        // neighbours against it.
        Vec3d n = face_normal(f);
        for (std::uint32_t at = neighbor_begin_[f]; at < neighbor_begin_[f + 1]; ++at) {
          n += face_normal(neighbor_[at]);
        }
        const double length = n.norm();
        face_normal_[f] = length > 0.0 ? Vec3d(n / length) : face_normal_[f];
        return;
      }
      Vec3d n = Vec3d::Zero();
      for (const std::uint32_t v : mesh_.face(f)) {
        n += vertex_normal_[v];
      }
      const double length = n.norm();
      face_normal_[f] = length > 0.0 ? Vec3d(n / length) : Vec3d::Zero();
    });
  }

  /// Of faces beside creases, those across edges that aren't creases themselves.
  void list_neighbors() {
    neighbor_begin_.assign(mesh_.face_count() + 1, 0);
    if (creases_.empty()) {
      return;
    }
    std::vector<std::array<std::uint32_t, 2>> features = mesh_.feature_edges;
    for (auto& [low, high] : features) {
      if (low > high) {
        std::swap(low, high);
      }
    }
    std::sort(features.begin(), features.end());
    std::vector<std::array<std::uint32_t, 2>> pairs;
    const std::vector<FaceSide> sides = sorted_sides(mesh_);
    for (std::size_t i = 0; i + 1 < sides.size(); ++i) {
      const FaceSide& a = sides[i];
      const FaceSide& b = sides[i + 1];
      if (a.low != b.low || a.high != b.high ||
          std::binary_search(features.begin(), features.end(), std::array{a.low, a.high})) {
        continue;
      }
      for (const auto& [f, g] : {std::array{a.face, b.face}, std::array{b.face, a.face}}) {
        if (beside_crease_[f] != 0) {
          pairs.push_back({f, g});
          ++neighbor_begin_[f + 1];
        }
      }
    }
    std::sort(pairs.begin(), pairs.end());
    for (std::size_t f = 0; f < mesh_.face_count(); ++f) {
      neighbor_begin_[f + 1] += neighbor_begin_[f];
    }
    for (const auto& pair : pairs) {
      neighbor_.push_back(pair[1]);
    }
  }

  Vec3d face_normal(std::size_t f) const {
    const auto face = mesh_.face(f);
    const std::vector<Vec3d>& x = mesh_.positions;
    Vec3d n = Vec3d::Zero();
    for (std::size_t k = 1; k + 1 < face.size(); ++k) {
      n += (x[face[k]] - x[face[0]]).cross(x[face[k + 1]] - x[face[0]]);
    }
    return n;
  }

  std::uint64_t count_inverted() const {
    return parallel_sum(mesh_.face_count(), std::uint64_t{0}, [&](std::size_t b, std::size_t e) {
      std::uint64_t count = 0;
      for (std::size_t f = b; f < e; ++f) {
        count += quality(mesh_.positions, f) <= 0.0 ? 1 : 0;
      }
      return count;
    });
  }

  double quality(const std::vector<Vec3d>& x, std::size_t f) const {
    return corner_quality(x, mesh_.face(f), face_normal_[f]);
  }

  /// Corners of the regular polygon nearest to the face's, in the plane of its reference normal:
  /// with u = 2/n sum p_k cos(2 pi k / n), w likewise with sin, the first corner lies (u - n x w) /
  /// 2 off the centre.
  void match_shape(std::size_t f) {
    const auto face = mesh_.face(f);
    const std::size_t n = face.size();
    Vec3d* target = corner_target_.data() + mesh_.face_begin[f];
    const Vec3d& normal = face_normal_[f];
    const auto& polygon = polygons_.of_degree[n];
    const std::vector<Vec3d>& x = mesh_.positions;
    Vec3d centre;
    Vec3d u;
    Vec3d w;
    if (n == 4) {
      const Vec3d& p0 = x[face[0]];
      const Vec3d& p1 = x[face[1]];
      const Vec3d& p2 = x[face[2]];
      const Vec3d& p3 = x[face[3]];
      centre = 0.25 * (p0 + p1 + p2 + p3);
      u = 0.5 * (p0 - p2);
      w = 0.5 * (p1 - p3);
    } else {
      centre = u = w = Vec3d::Zero();
      for (std::size_t k = 0; k < n; ++k) {
        centre += x[face[k]];
        u += polygon.cos[k] * x[face[k]];
        w += polygon.sin[k] * x[face[k]];
      }
      centre /= static_cast<double>(n);
      u *= 2.0 / static_cast<double>(n);
      w *= 2.0 / static_cast<double>(n);
    }
    Vec3d a = 0.5 * (u - normal.dot(u) * normal - normal.cross(w));
    const double radius2 = a.squaredNorm();
    if (radius2 > 0.0) {
      const double radius = std::sqrt(radius2);
      a *= 1.0 + options_.size_weight * (polygon.radius * edge_length_ / radius - 1.0);
    }
    const Vec3d b = normal.cross(a);
    if (n == 4) {
      target[0] = centre + a;
      target[1] = centre + b;
      target[2] = centre - a;
      target[3] = centre - b;
      return;
    }
    for (std::size_t k = 0; k < n; ++k) {
      target[k] = centre + polygon.cos[k] * a + polygon.sin[k] * b;
    }
  }

  void advance() {
    parallel_indices(
        mesh_.face_count(), [&](std::size_t f) { match_shape(f); }, kGrain);
    move_all([&](std::uint32_t v) { return matched(v); });
  }

  void pull() {
    parallel_indices(
        mesh_.face_count(),
        [&](std::size_t f) {
          pull_face(mesh_.positions, mesh_.face(f), face_normal_[f], edge_length_,
                    options_.length_weight, pull_.data() + mesh_.face_begin[f]);
        },
        kGrain);
    move_all([&](std::uint32_t v) { return pulled(v); });
  }

  template <class Displacement>
  void move_all(const Displacement& displacement) {
    next_.resize(mesh_.vertex_count());
    parallel_indices(
        mesh_.vertex_count(),
        [&](std::size_t i) {
          const auto v = static_cast<std::uint32_t>(i);
          next_[v] = motion_[v] == Motion::kFixed ? mesh_.positions[v] : moved(v, displacement(v));
        },
        kGrain);
    mesh_.positions.swap(next_);
  }

  /// From the vertex towards the mean of its corners' targets.
  Vec3d matched(std::uint32_t v) const {
    const Vec3d& x = mesh_.positions[v];
    Vec3d target = Vec3d::Zero();
    for (std::uint32_t at = stars_.begin[v]; at < stars_.begin[v + 1]; ++at) {
      target += corner_target_[stars_.corner[at]];
    }
    target /= static_cast<double>(stars_.begin[v + 1] - stars_.begin[v]);
    if (motion_[v] == Motion::kBoundary || motion_[v] == Motion::kAlongCrease) {
      const auto& [before, after] =
          motion_[v] == Motion::kBoundary ? stars_.boundary[v] : crease_.neighbors[v];
      target = 0.5 * target + 0.25 * (mesh_.positions[before] + mesh_.positions[after]);
    }
    return options_.step_length * (target - x);
  }

  /// Where the forces of the vertex' faces would balance if the others stood still.
  Vec3d pulled(std::uint32_t v) const {
    ShapePull sum;
    for (std::uint32_t at = stars_.begin[v]; at < stars_.begin[v + 1]; ++at) {
      sum.force += pull_[stars_.corner[at]].force;
      sum.stiffness += pull_[stars_.corner[at]].stiffness;
    }
    if (!(sum.stiffness > 0.0)) {
      return Vec3d::Zero();
    }
    const Vec3d d = sum.force / sum.stiffness;
    const double length = d.norm();
    const double longest = kLongestPull * edge_length_;
    return length > longest ? Vec3d(longest / length * d) : d;
  }

  Vec3d moved(std::uint32_t v, const Vec3d& displacement) {
    const Vec3d& x = mesh_.positions[v];
    Vec3d to = x + momentum_ * velocity_[v] + displacement;
    if (motion_[v] == Motion::kBoundary) {
      to = curve_.closest_on_loop(to, loop_[v]).point;
    } else if (motion_[v] == Motion::kAlongCrease) {
      to = creases_.closest(to, crease_.curve[v]);
    } else {
      const Vec3d& n = vertex_normal_[v];
      to -= n.dot(to - anchor_[v]) * n;
    }
    velocity_[v] = to - x;
    return to;
  }

  /// Vertices free to move go to their closest points; all learn their nearest triangle.
  void project() {
    std::vector<std::uint32_t> all(mesh_.vertex_count());
    for (std::uint32_t v = 0; v < all.size(); ++v) {
      all[v] = v;
    }
    project(all);
  }

  void project(const std::vector<std::uint32_t>& vertices) {
    const std::vector<SurfacePoint> found = project_vertices(mesh_, vertices, projector_, graph_);
    report_.projections += vertices.size();
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      const std::uint32_t v = vertices[i];
      if (found[i].found()) {
        if (motion_[v] == Motion::kFree) {
          mesh_.positions[v] = found[i].point;
        }
      }
    }
  }

  /// Puts vertices back to `fallback` wherever a face that was not inverted there came out below
  /// the least Jacobian and worse. Ends, as faces of put-back vertices alone are as they were.
  void revert_degraded(const std::vector<Vec3d>& fallback) {
    std::vector<std::uint8_t> suspect(mesh_.face_count());
    parallel_indices(
        mesh_.face_count(), [&](std::size_t f) { suspect[f] = degraded(f, fallback); }, kGrain);
    std::vector<std::uint32_t> queue;
    for (std::uint32_t f = 0; f < suspect.size(); ++f) {
      if (suspect[f] != 0) {
        queue.push_back(f);
      }
    }
    std::vector<std::uint32_t> around;
    while (!queue.empty()) {
      around.clear();
      for (const std::uint32_t f : queue) {
        for (const std::uint32_t v : mesh_.face(f)) {
          if (mesh_.positions[v] != fallback[v]) {
            mesh_.positions[v] = fallback[v];
            velocity_[v] = Vec3d::Zero();
            ++report_.reverted;
            const auto faces = stars_.faces(v);
            around.insert(around.end(), faces.begin(), faces.end());
          }
        }
      }
      std::sort(around.begin(), around.end());
      around.erase(std::unique(around.begin(), around.end()), around.end());
      queue.clear();
      for (const std::uint32_t f : around) {
        if (degraded(f, fallback)) {
          queue.push_back(f);
        }
      }
    }
  }

  bool degraded(std::size_t f, const std::vector<Vec3d>& fallback) const {
    double now = quality(mesh_.positions, f);
    if (now >= options_.least_jacobian) {
      return false;
    }
    double before = quality(fallback, f);
    const bool away = now < -2.0;
    const bool was_away = before < -2.0;
    now += away ? kFacingAway : 0.0;
    before += was_away ? kFacingAway : 0.0;
    // What was inverted may move on: holding it would hold its neighbours too.
    return (away && !was_away) || (now < options_.least_jacobian && before > 0.0 && now < before);
  }

  void relocate() {
    refresh_normals();
    checkpoint_ = mesh_.positions;
    const auto quadrics =
        gather_quadrics(store_, scan_, mesh_.positions, vertex_normal_, edge_length_, graph_);
    const double longest = 0.5 * edge_length_;
    parallel_indices(mesh_.vertex_count(), [&](std::size_t v) {
      if (motion_[v] != Motion::kFree) {
        return;
      }
      Vec3d d = quadric_displacement(quadrics[v], vertex_normal_[v], options_.tangential_weight,
                                     options_.normal_weight);
      const double length = d.norm();
      if (length > longest) {
        d *= longest / length;
      }
      mesh_.positions[v] += d;
    });
    lift(quadrics);
    revert_degraded(checkpoint_);
    for (std::size_t v = 0; v < mesh_.vertex_count(); ++v) {
      report_.relocated += mesh_.positions[v] != checkpoint_[v] ? 1 : 0;
    }
  }

  void lift(const std::vector<VertexQuadric>& quadrics) {
    next_ = mesh_.positions;
    parallel_indices(mesh_.vertex_count(), [&](std::size_t v) {
      const double bent = bentness(quadrics[v], vertex_normal_[v]);
      if (motion_[v] != Motion::kFree || bent >= kCrease) {
        return;
      }
      Vec3d mean = Vec3d::Zero();
      for (std::uint32_t at = stars_.begin[v]; at < stars_.begin[v + 1]; ++at) {
        const auto face = mesh_.face(stars_.face[at]);
        const std::size_t k = stars_.corner[at] - mesh_.face_begin[stars_.face[at]];
        mean += mesh_.positions[face[k + 1 == face.size() ? 0 : k + 1]];
      }
      mean /= static_cast<double>(stars_.begin[v + 1] - stars_.begin[v]);
      const Vec3d& n = vertex_normal_[v];
      next_[v] -= kLift * (1.0 - bent / kCrease) * n.dot(mean - mesh_.positions[v]) * n;
    });
    mesh_.positions.swap(next_);
  }

  /// Chords of a bent curve lie inside it: vertices as far outside as their middles are inside
  /// leave half of the deviation. On a circle the umbrella vector is four times that of a chord.
  void bend_creases() {
    checkpoint_ = mesh_.positions;
    const double longest = kMostOffCrease * scan_.diagonal();
    for (std::uint32_t v = 0; v < mesh_.vertex_count(); ++v) {
      if (motion_[v] == Motion::kAlongCrease) {
        const auto& [before, after] = crease_.neighbors[v];
        Vec3d umbrella = 0.5 * (checkpoint_[before] + checkpoint_[after]) - checkpoint_[v];
        const Vec3d chord = checkpoint_[after] - checkpoint_[before];
        const double length2 = chord.squaredNorm();
        if (length2 > 0.0) {
          umbrella -= umbrella.dot(chord) / length2 * chord;
        }
        const double lift = 0.125 * umbrella.norm();
        mesh_.positions[v] -= 0.125 * std::min(1.0, longest / std::max(lift, 1e-300)) * umbrella;
      }
    }
    revert_degraded(checkpoint_);
  }

  /// The least quality among the faces around a vertex.
  double star_quality(std::uint32_t v) const {
    double least = 1.0;
    for (const std::uint32_t f : stars_.faces(v)) {
      least = std::min(least, quality(mesh_.positions, f));
    }
    return least;
  }

  /// Pattern search in the tangent plane for the best star; true if it got better.
  bool search(std::uint32_t v) {
    const Vec3d& n = vertex_normal_[v];
    const Vec3d e = (std::abs(n.x()) < 0.7 ? Vec3d::UnitX() : Vec3d::UnitY()).cross(n).normalized();
    const Vec3d g = n.cross(e);
    static constexpr double kHalf = 0.70710678118654752;
    static constexpr std::array<std::array<double, 2>, 8> kDirections{{{1, 0},
                                                                       {kHalf, kHalf},
                                                                       {0, 1},
                                                                       {-kHalf, kHalf},
                                                                       {-1, 0},
                                                                       {-kHalf, -kHalf},
                                                                       {0, -1},
                                                                       {kHalf, -kHalf}}};
    double best = star_quality(v);
    const double before = best;
    Vec3d at = mesh_.positions[v];
    double step = 0.5 * edge_length_;
    for (int halvings = 0, moves = 0; halvings < 7 && moves < 20; ++moves) {
      Vec3d better = at;
      for (const auto& d : kDirections) {
        const Vec3d candidate = at + step * (d[0] * e + d[1] * g);
        mesh_.positions[v] = candidate;
        const double q = star_quality(v);
        if (q > best) {
          best = q;
          better = candidate;
        }
      }
      if (better == at) {
        step *= 0.5;
        ++halvings;
      }
      at = better;
    }
    mesh_.positions[v] = at;
    return best > before;
  }

  void untangle() {
    for (int round = 0; round < options_.untangle_rounds; ++round) {
      refresh_normals();
      std::vector<std::uint32_t> vertices;
      for (std::uint32_t f = 0; f < mesh_.face_count(); ++f) {
        if (quality(mesh_.positions, f) <= 0.0) {
          for (const std::uint32_t v : mesh_.face(f)) {
            if (motion_[v] == Motion::kFree) {
              vertices.push_back(v);
            }
          }
        }
      }
      std::sort(vertices.begin(), vertices.end());
      vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
      if (vertices.empty()) {
        return;
      }
      checkpoint_ = mesh_.positions;
      std::vector<std::uint32_t> changed;
      for (const std::uint32_t v : vertices) {
        if (search(v)) {
          changed.push_back(v);
        }
      }
      project(changed);
      revert_degraded(checkpoint_);
    }
  }

  PolygonMesh& mesh_;
  Store& store_;
  const ScanMesh& scan_;
  SurfaceProjector& projector_;
  const OptimiseOptions& options_;
  TaskGraph& graph_;
  VertexStars stars_;
  RegularPolygons polygons_;
  BoundaryCurve curve_;
  CreaseCurve creases_;
  CreaseVertices crease_;
  std::vector<std::uint8_t> beside_crease_;  ///< one a face
  std::vector<std::uint32_t> neighbor_begin_, neighbor_;
  std::vector<Motion> motion_;
  std::vector<std::uint32_t> loop_;
  std::vector<Vec3d> vertex_normal_;
  std::vector<Vec3d> face_normal_;
  std::vector<Vec3d> corner_target_;
  std::vector<ShapePull> pull_;    ///< one a corner
  std::vector<Vec3d> checkpoint_;  ///< what degraded faces go back to
  std::vector<Vec3d> anchor_;      ///< a point of each vertex' tangent plane
  std::vector<Vec3d> velocity_;
  std::vector<Vec3d> next_;
  double edge_length_ = 0.0;
  double momentum_ = 0.0;
  OptimiseReport report_;
};

}  // namespace

OptimiseReport optimise(PolygonMesh& remesh, Store& store, const ScanMesh& scan,
                        SurfaceProjector& projector, const OptimiseOptions& options,
                        TaskGraph& graph) {
  Optimiser optimiser(remesh, store, scan, projector, options, graph);
  return optimiser.run();
}

}  // namespace rattan
