// SPDX-License-Identifier: MIT
// Based on: V. Garanzha, I. Kaporin, L. Kudryavtseva, F. Protais, N. Ray, D. Sokolov,
// "Foldover-free maps in 50 lines of code", 2021: the energy of a corner is its inverse mean ratio
// with the determinant replaced by a function of it that stays positive, the closer to it the less
// is folded. Here each vertex takes its own Newton step in its tangent plane, as patches have some
// dozens of vertices only, and the planes follow the scan.
#include "engine/remesh/untangle.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "engine/core/parallel.h"
#include "engine/layout/disjoint_sets.h"
#include "engine/remesh/crease_curve.h"
#include "engine/remesh/project_vertices.h"
#include "engine/remesh/quality.h"
#include "engine/remesh/vertex_motion.h"
#include "engine/remesh/vertex_stars.h"

namespace rattan {

namespace {

// Of the mean squared edge length: what counts as a determinant of zero, and the share of the worst
// folded one that is added.
constexpr double kLeastDeterminant = 1e-3;
constexpr double kFoldedShare = 0.2;
// Weight of even areas against right angles: without, faces shrink to nothing where that is easier.
constexpr double kAreaWeight = 0.1;
constexpr int kHalvings = 8;
// Of the edge length, in one step.
constexpr double kLongestStep = 0.5;

/// The vertices of a patch move `sweeps` times in a tangent plane, then to the scan; so often.
struct Pass {
  int rings;  ///< of faces around bad quads whose vertices move
  /// How long the mean of the unit normals at a face has to be to say where it should look.
  double agreement;
  int rounds;
  int sweeps;
};
// On tubes of three quads or so around, where normals are far from each other's, those of the scan
// say little: faces are judged by their own, and what is moved is best little.
constexpr std::array<Pass, 2> kPasses{{{2, 0.06, 12, 12}, {0, 0.75, 30, 3}}};
constexpr std::array<Pass, 2> kAnyWay{{{0, 2.0, 30, 3}, {1, 2.0, 30, 3}}};

struct Patch {
  std::vector<std::uint32_t> vertices;  ///< that may move, ascending
  std::vector<std::uint32_t> faces;     ///< with such a vertex, ascending
  double side = 0.0;                    ///< mean edge length
  double epsilon = 0.0;                 ///< an area
  bool done = false;
  // The best so far.
  std::uint64_t bad = 0;
  double worst = 0.0;
  std::vector<Vec3d> best;  ///< one a vertex
};

/// Energy of the faces around a vertex with its derivatives in a tangent plane.
struct Local {
  double energy = 0.0;
  std::array<double, 2> gradient{};
  std::array<double, 3> hessian{};  ///< xx, xy, yy; a positive part of it
};

struct Plane {
  Vec3d e;
  Vec3d g;
};

Plane plane_of(const Vec3d& n) {
  const Vec3d e = (std::abs(n.x()) < 0.7 ? Vec3d::UnitX() : Vec3d::UnitY()).cross(n).normalized();
  return {e, n.cross(e)};
}

class Untangler {
 public:
  Untangler(PolygonMesh& mesh, SurfaceProjector& projector, const UntangleOptions& options,
            TaskGraph& graph)
      : mesh_(mesh),
        projector_(projector),
        options_(options),
        graph_(graph),
        stars_(mesh),
        creases_(options.features),
        crease_(crease_vertices(mesh, creases_)) {}

  UntangleReport run() {
    UntangleReport report;
    std::vector<std::uint32_t> bad = quads_not_above(mesh_, options_.least);
    report.bad_before = report.bad_after = bad.size();
    if (bad.empty()) {
      return report;
    }
    if (mesh_.scan_triangle.size() != mesh_.vertex_count()) {
      mesh_.scan_triangle.assign(mesh_.vertex_count(), kNoTriangle);
    }
    scan_normal_.assign(mesh_.vertex_count(), Vec3d::Zero());
    normal_.assign(mesh_.face_count(), Vec3d::Zero());
    set_motions();
    for (const Pass& pass : options_.any_way ? kAnyWay : kPasses) {
      make_patches(bad, pass.rings);
      improve(pass, report);
      bad = quads_not_above(mesh_, options_.least);
      if (bad.empty()) {
        break;
      }
    }
    report.bad_after = bad.size();
    return report;
  }

 private:
  void set_motions() {
    VertexMotions motions = vertex_motions(mesh_, stars_, options_.boundary, crease_, false);
    motion_ = std::move(motions.motion);
    loop_ = std::move(motions.loop);
    anchor_ = mesh_.positions;
  }

  void improve(const Pass& pass, UntangleReport& report) {
    agreement_ = pass.agreement;
    learn_normals();
    std::vector<std::pair<std::uint64_t, double>> before;
    for (Patch& p : patches_) {
      set_normals(p);
      judge(p);
      before.emplace_back(p.bad, -p.worst);
    }
    for (int round = 0; round < pass.rounds; ++round) {
      parallel_indices(
          patches_.size(), [&](std::size_t i) { relax(patches_[i], pass.sweeps); }, 1);
      project();
      bool all = true;
      for (Patch& p : patches_) {
        if (!p.done) {
          set_normals(p);
          judge(p);
          p.done = p.bad == 0 && p.worst > options_.enough;
          all = all && p.done;
        }
      }
      if (all) {
        break;
      }
    }
    for (std::size_t i = 0; i < patches_.size(); ++i) {
      const Patch& p = patches_[i];
      report.improved += std::pair(p.bad, -p.worst) < before[i] ? 1 : 0;
      for (std::size_t k = 0; k < p.vertices.size(); ++k) {
        mesh_.positions[p.vertices[k]] = p.best[k];
      }
    }
    report.patches += patches_.size();
  }

  bool leashed(std::uint32_t v) const {
    return options_.leash > 0.0 && motion_[v] != Motion::kFree;
  }
  bool moves(std::uint32_t v) const { return motion_[v] != Motion::kFixed || leashed(v); }

  Vec3d on_curve(std::uint32_t v, const Vec3d& x) const {
    return motion_[v] == Motion::kBoundary ? options_.boundary->closest_on_loop(x, loop_[v]).point
                                           : creases_.closest(x, crease_.curve[v]);
  }

  /// What holds back those that may leave their curves.
  void set_anchors(const Patch& p) {
    for (const std::uint32_t v : p.vertices) {
      if (leashed(v) && motion_[v] != Motion::kFixed) {
        anchor_[v] = on_curve(v, mesh_.positions[v]);
      }
    }
  }

  /// Vertices within reach of each other through a face move together.
  void make_patches(const std::vector<std::uint32_t>& bad, int rings) {
    patches_.clear();
    std::vector<std::uint8_t> chosen(mesh_.vertex_count(), 0);
    std::vector<std::uint32_t> faces = bad;
    std::vector<std::uint8_t> seen(mesh_.face_count(), 0);
    for (int ring = 0; ring <= rings; ++ring) {
      std::vector<std::uint32_t> next;
      for (const std::uint32_t f : faces) {
        seen[f] = 1;
        for (const std::uint32_t v : mesh_.face(f)) {
          if (chosen[v] == 0) {
            chosen[v] = 1;
            const auto around = stars_.faces(v);
            next.insert(next.end(), around.begin(), around.end());
          }
        }
      }
      faces.clear();
      for (const std::uint32_t f : next) {
        if (seen[f] == 0) {
          seen[f] = 1;
          faces.push_back(f);
        }
      }
    }
    layout::DisjointSets sets(mesh_.vertex_count());
    for (std::uint32_t f = 0; f < mesh_.face_count(); ++f) {
      std::uint32_t first = kNoVertex;
      for (const std::uint32_t v : mesh_.face(f)) {
        if (chosen[v] != 0 && moves(v)) {
          first = first == kNoVertex ? v : first;
          sets.unite(first, v);
        }
      }
    }
    std::vector<std::uint32_t> patch_of(mesh_.vertex_count(), kNoVertex);
    for (std::uint32_t v = 0; v < mesh_.vertex_count(); ++v) {
      if (chosen[v] != 0 && moves(v)) {
        std::uint32_t& at = patch_of[sets.find(v)];
        if (at == kNoVertex) {
          at = static_cast<std::uint32_t>(patches_.size());
          patches_.emplace_back();
        }
        patches_[at].vertices.push_back(v);
      }
    }
    for (Patch& p : patches_) {
      for (const std::uint32_t v : p.vertices) {
        const auto around = stars_.faces(v);
        p.faces.insert(p.faces.end(), around.begin(), around.end());
      }
      std::sort(p.faces.begin(), p.faces.end());
      p.faces.erase(std::unique(p.faces.begin(), p.faces.end()), p.faces.end());
      double sum = 0.0;
      std::size_t count = 0;
      for (const std::uint32_t f : p.faces) {
        const auto face = mesh_.face(f);
        for (std::size_t k = 0; k < face.size(); ++k) {
          sum +=
              (mesh_.positions[face[k]] - mesh_.positions[face[k == 0 ? face.size() - 1 : k - 1]])
                  .norm();
          ++count;
        }
      }
      p.side = sum / static_cast<double>(count);
    }
  }

  /// Of the scan at all corners of the patches' faces, where they stand.
  void learn_normals() {
    std::vector<std::uint32_t> vertices;
    for (const Patch& p : patches_) {
      for (const std::uint32_t f : p.faces) {
        const auto face = mesh_.face(f);
        vertices.insert(vertices.end(), face.begin(), face.end());
      }
    }
    std::sort(vertices.begin(), vertices.end());
    vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
    project(vertices, false);
  }

  void project(const std::vector<std::uint32_t>& vertices, bool move) {
    const std::vector<SurfacePoint> found = project_vertices(mesh_, vertices, projector_, graph_);
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      const std::uint32_t v = vertices[i];
      if (found[i].found()) {
        scan_normal_[v] = found[i].normal;
        if (move && (motion_[v] == Motion::kFree || leashed(v))) {
          mesh_.positions[v] = found[i].point;
        }
      }
    }
  }

  void project() {
    std::vector<std::uint32_t> vertices;
    for (const Patch& p : patches_) {
      if (!p.done) {
        vertices.insert(vertices.end(), p.vertices.begin(), p.vertices.end());
      }
    }
    project(vertices, true);
  }

  Vec3d area(std::uint32_t f) const {
    const auto face = mesh_.face(f);
    const std::vector<Vec3d>& x = mesh_.positions;
    return face.size() == 3 ? Vec3d((x[face[1]] - x[face[0]]).cross(x[face[2]] - x[face[0]]))
                            : Vec3d((x[face[2]] - x[face[0]]).cross(x[face[3]] - x[face[1]]));
  }

  /// What the face should look at: the scan at its corners, and the faces around it, whose common
  /// area vector doesn't change with what is folded inside. Zero where these disagree.
  Vec3d outward(std::uint32_t f) const {
    Vec3d n = Vec3d::Zero();
    Vec3d sum = area(f);
    double count = 1.0;
    for (const std::uint32_t v : mesh_.face(f)) {
      if (crease_.degree[v] == 0) {
        n += scan_normal_[v];
        count += 1.0;
      }
      for (const std::uint32_t g : stars_.faces(v)) {
        sum += 0.5 * area(g);
      }
    }
    const double size = sum.norm();
    if (size > 0.0) {
      n += sum / size;
    }
    const double length = n.norm();
    return length > agreement_ * count ? Vec3d(n / length) : Vec3d::Zero();
  }

  /// A face has its own normal unless that looks away from where it should.
  void set_normals(const Patch& p) {
    for (const std::uint32_t f : p.faces) {
      const Vec3d out = outward(f);
      const Vec3d own = area(f);
      const double size = own.norm();
      const bool usable = size > 1e-3 * p.side * p.side;
      const bool looks_away = !(usable && own.dot(out) >= 0.3 * size);
      if (looks_away && out.squaredNorm() > 0.0) {
        normal_[f] = out;
      } else if (size > 0.0) {
        normal_[f] = own / size;
      }
    }
  }

  void judge(Patch& p) {
    std::uint64_t bad = 0;
    double worst = 1.0;
    for (const std::uint32_t f : p.faces) {
      const double q = corner_quality(mesh_.positions, mesh_.face(f), normal_[f]);
      bad += q <= options_.least ? 1 : 0;
      worst = std::min(worst, q);
    }
    if (p.best.empty() || bad < p.bad || (bad == p.bad && worst > p.worst)) {
      p.bad = bad;
      p.worst = worst;
      p.best.resize(p.vertices.size());
      for (std::size_t i = 0; i < p.best.size(); ++i) {
        p.best[i] = mesh_.positions[p.vertices[i]];
      }
    }
  }

  void set_epsilon(Patch& p) const {
    double least = 0.0;
    for (const std::uint32_t f : p.faces) {
      const auto face = mesh_.face(f);
      const std::size_t n = face.size();
      for (std::size_t k = 0; k < n; ++k) {
        const Vec3d& at = mesh_.positions[face[k]];
        const Vec3d a = mesh_.positions[face[k + 1 == n ? 0 : k + 1]] - at;
        const Vec3d b = mesh_.positions[face[k == 0 ? n - 1 : k - 1]] - at;
        least = std::min(least, normal_[f].dot(a.cross(b)));
      }
    }
    const double zero = kLeastDeterminant * p.side * p.side;
    p.epsilon = std::sqrt(zero * zero + kFoldedShare * kFoldedShare * least * least);
  }

  void relax(Patch& p, int sweeps) {
    if (p.done) {
      return;
    }
    set_anchors(p);
    for (int sweep = 0; sweep < sweeps; ++sweep) {
      set_normals(p);
      set_epsilon(p);
      for (const std::uint32_t v : p.vertices) {
        step(p, v);
      }
    }
  }

  /// `plane`: null for the energy alone.
  Local local(const Patch& p, std::uint32_t v, const Plane* plane) const {
    Local out;
    const double epsilon = p.epsilon;
    const double square = p.side * p.side;
    if (leashed(v)) {
      const Vec3d off = mesh_.positions[v] - anchor_[v];
      const double hold = options_.leash / (p.side * p.side);
      out.energy = hold * off.squaredNorm();
      if (plane != nullptr) {
        out.gradient = {2.0 * hold * off.dot(plane->e), 2.0 * hold * off.dot(plane->g)};
        out.hessian = {2.0 * hold, 0.0, 2.0 * hold};
      }
    }
    for (const std::uint32_t f : stars_.faces(v)) {
      const auto face = mesh_.face(f);
      const std::size_t n = face.size();
      const Vec3d& normal = normal_[f];
      for (std::size_t k = 0; k < n; ++k) {
        const std::uint32_t vq = face[k + 1 == n ? 0 : k + 1];
        const std::uint32_t vr = face[k == 0 ? n - 1 : k - 1];
        if (face[k] != v && vq != v && vr != v) {
          continue;
        }
        const Vec3d& at = mesh_.positions[face[k]];
        const Vec3d a = mesh_.positions[vq] - at;
        const Vec3d b = mesh_.positions[vr] - at;
        const double squares = a.squaredNorm() + b.squaredNorm();
        const double d = normal.dot(a.cross(b));
        const double s = std::sqrt(epsilon * epsilon + d * d);
        const double chi = d > 0.0 ? 0.5 * (d + s) : 0.5 * epsilon * epsilon / (s - d);
        const double uneven = kAreaWeight * (d * d / square + square);
        out.energy += (0.5 * squares + uneven) / chi;
        if (plane == nullptr) {
          continue;
        }
        const Vec3d dq = b.cross(normal);
        const Vec3d dr = normal.cross(a);
        Vec3d squares_by;
        Vec3d d_by;
        double bend = 2.0;
        if (vq == v) {
          squares_by = 2.0 * a;
          d_by = dq;
        } else if (vr == v) {
          squares_by = 2.0 * b;
          d_by = dr;
        } else {
          squares_by = -2.0 * (a + b);
          d_by = -(dq + dr);
          bend = 4.0;
        }
        const Vec3d g =
            0.5 / chi * squares_by +
            (2.0 * kAreaWeight * d / (square * chi) - (0.5 * squares + uneven) / (chi * s)) * d_by;
        out.gradient[0] += g.dot(plane->e);
        out.gradient[1] += g.dot(plane->g);
        const double stiff = (squares + 2.0 * uneven) / (chi * s * s);
        const double x = d_by.dot(plane->e);
        const double y = d_by.dot(plane->g);
        out.hessian[0] += 0.5 * bend / chi + stiff * x * x;
        out.hessian[1] += stiff * x * y;
        out.hessian[2] += 0.5 * bend / chi + stiff * y * y;
      }
    }
    return out;
  }

  Vec3d tangent_normal(std::uint32_t v) const {
    Vec3d n = Vec3d::Zero();
    for (const std::uint32_t f : stars_.faces(v)) {
      n += normal_[f];
    }
    const double length = n.norm();
    return length > 0.0 ? Vec3d(n / length) : Vec3d::UnitZ();
  }

  void step(const Patch& p, std::uint32_t v) {
    const Plane plane = plane_of(tangent_normal(v));
    const Local here = local(p, v, &plane);
    const auto& [xx, xy, yy] = here.hessian;
    const double det = xx * yy - xy * xy;
    if (!(det > 0.0)) {
      return;
    }
    const double x = -(yy * here.gradient[0] - xy * here.gradient[1]) / det;
    const double y = -(xx * here.gradient[1] - xy * here.gradient[0]) / det;
    Vec3d d = x * plane.e + y * plane.g;
    const double length = d.norm();
    if (!(length > 0.0)) {
      return;
    }
    if (length > kLongestStep * p.side) {
      d *= kLongestStep * p.side / length;
    }
    const Vec3d from = mesh_.positions[v];
    for (int k = 0; k < kHalvings; ++k, d *= 0.5) {
      Vec3d to = from + d;
      if (motion_[v] != Motion::kFree && !leashed(v)) {
        to = on_curve(v, to);
      }
      mesh_.positions[v] = to;
      if (local(p, v, nullptr).energy < here.energy) {
        return;
      }
    }
    mesh_.positions[v] = from;
  }

  PolygonMesh& mesh_;
  SurfaceProjector& projector_;
  const UntangleOptions& options_;
  TaskGraph& graph_;
  VertexStars stars_;
  CreaseCurve creases_;
  CreaseVertices crease_;
  std::vector<Motion> motion_;
  std::vector<std::uint32_t> loop_;
  std::vector<Vec3d> anchor_;  ///< one a vertex
  double agreement_ = 0.0;
  std::vector<Patch> patches_;
  std::vector<Vec3d> scan_normal_;  ///< one a vertex, those of the patches
  std::vector<Vec3d> normal_;       ///< one a face, likewise
};

}  // namespace

UntangleReport untangle(PolygonMesh& mesh, SurfaceProjector& projector,
                        const UntangleOptions& options, TaskGraph& graph) {
  return Untangler(mesh, projector, options, graph).run();
}

}  // namespace rattan
