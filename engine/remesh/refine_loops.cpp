// SPDX-License-Identifier: MIT
#include "engine/remesh/refine_loops.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "engine/remesh/cell_map.h"
#include "engine/remesh/pair_triangles.h"
#include "engine/remesh/repair.h"
#include "engine/remesh/split_cells.h"

namespace rattan {

namespace {

/// As for creases: mean turn in radians, less half of that over two steps.
constexpr double kMostZigzag = 0.15;
/// Loops of fewer corners can't be told from a zigzag, nor matter.
constexpr std::size_t kFewCorners = 5;
constexpr std::size_t kMostRaggedCorners = 200;
/// Quads between two triangles that become quads together.
constexpr std::uint32_t kPairBetween = 3;
/// Evenly spaced vertices are tried up to so many more than there are.
constexpr std::size_t kMostMore = 24;
constexpr int kSmoothings = 3;
/// An edge of the remesh spans at most so many times its length along the loop.
constexpr double kLongestArc = 3.0;

/// Mean over the corners of a closed polygon of twice the sine of half the turn over `step` steps.
double mean_turn(const std::vector<Vec3d>& p, std::size_t step) {
  const std::size_t n = p.size();
  double sum = 0.0;
  for (std::size_t k = 0; k < n; ++k) {
    const Vec3d in = p[k] - p[(k + n - step) % n];
    const Vec3d out = p[(k + step) % n] - p[k];
    const double a = in.norm();
    const double b = out.norm();
    if (a > 0.0 && b > 0.0) {
      sum += (out / b - in / a).norm();
    }
  }
  return sum / static_cast<double>(n);
}

double distance_to_segment(const Vec3d& p, const Vec3d& a, const Vec3d& b) {
  const Vec3d d = b - a;
  const double length2 = d.squaredNorm();
  const double t = length2 > 0.0 ? std::clamp((p - a).dot(d) / length2, 0.0, 1.0) : 0.0;
  return (a + t * d - p).norm();
}

/// A closed polygon by arc length.
class Loop {
 public:
  explicit Loop(const std::vector<Vec3d>& corners) : corners_(corners), at_(corners.size() + 1) {
    at_[0] = 0.0;
    for (std::size_t k = 0; k < corners.size(); ++k) {
      at_[k + 1] = at_[k] + (corner(k + 1) - corner(k)).norm();
    }
  }
  std::size_t size() const { return corners_.size(); }
  double length() const { return at_.back(); }
  double at(std::size_t k) const {
    const std::size_t rounds = k / size();
    return at_[k % size()] + length() * static_cast<double>(rounds);
  }
  const Vec3d& corner(std::size_t k) const { return corners_[k % size()]; }

  /// s in [0, 2 length).
  Vec3d point(double s) const {
    s -= s >= length() ? length() : 0.0;
    const auto k =
        static_cast<std::size_t>(std::upper_bound(at_.begin(), at_.end(), s) - at_.begin());
    const std::size_t i = std::min(std::max<std::size_t>(k, 1), size()) - 1;
    const double l = at_[i + 1] - at_[i];
    return l > 0.0 ? Vec3d(corner(i) + (s - at_[i]) / l * (corner(i + 1) - corner(i))) : corner(i);
  }
  /// Arc length of the closest point.
  double closest(const Vec3d& p) const {
    double best = std::numeric_limits<double>::infinity();
    double s = 0.0;
    for (std::size_t k = 0; k < size(); ++k) {
      const Vec3d d = corner(k + 1) - corner(k);
      const double length2 = d.squaredNorm();
      const double t = length2 > 0.0 ? std::clamp((p - corner(k)).dot(d) / length2, 0.0, 1.0) : 0.0;
      const double off = (corner(k) + t * d - p).squaredNorm();
      if (off < best) {
        best = off;
        s = at_[k] + t * std::sqrt(length2);
      }
    }
    return s;
  }
  /// The corners inside the arc (from, to), 0 <= from < length, from <= to <= from + length.
  template <class Visit>
  void visit(double from, double to, const Visit& visit) const {
    auto k = static_cast<std::size_t>(std::upper_bound(at_.begin(), at_.end(), from) - at_.begin());
    for (; at(k) < to; ++k) {
      visit(k);
    }
  }

 private:
  const std::vector<Vec3d>& corners_;
  std::vector<double> at_;  ///< of each corner and the end
};

/// A closed polygon near a loop, with the place on the loop that each of its vertices stands for.
struct Outline {
  std::vector<double> at;  ///< ascending from the first, within a length
  std::vector<Vec3d> points;
};

/// Both ways, between each edge and its arc of the loop.
double deviation(const Loop& loop, const Outline& outline) {
  double worst = 0.0;
  const std::size_t n = outline.at.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3d& p = outline.points[i];
    const Vec3d& q = outline.points[(i + 1) % n];
    double from = outline.at[i];
    double to = i + 1 < n ? outline.at[i + 1] : outline.at[0] + loop.length();
    worst = std::max(worst, (p - loop.point(from)).norm());
    if (from >= loop.length()) {
      from -= loop.length();
      to -= loop.length();
    }
    loop.visit(from, to, [&](std::size_t k) {
      worst = std::max(worst, distance_to_segment(loop.corner(k), p, q));
    });
    // From the edge to the arc: a few points suffice, as arcs are short.
    for (const double t : {0.25, 0.5, 0.75}) {
      const Vec3d x = p + t * (q - p);
      double off = std::numeric_limits<double>::infinity();
      Vec3d last = loop.point(from);
      const auto part = [&](const Vec3d& next) {
        off = std::min(off, distance_to_segment(x, last, next));
        last = next;
      };
      loop.visit(from, to, [&](std::size_t k) { part(loop.corner(k)); });
      part(loop.point(to >= 2.0 * loop.length() ? to - loop.length() : to));
      worst = std::max(worst, off);
    }
  }
  return worst;
}

/// Vertices outside a bent loop by as much as leaves its chords inside it by as little as possible.
void bend(const Loop& loop, Outline& outline, double& best) {
  const std::size_t n = outline.at.size();
  const std::vector<Vec3d> on = outline.points;
  for (int step = 1; step <= 4; ++step) {
    Outline trial = outline;
    for (std::size_t i = 0; i < n; ++i) {
      const Vec3d umbrella = 0.5 * (on[(i + n - 1) % n] + on[(i + 1) % n]) - on[i];
      trial.points[i] = on[i] - 0.05 * step * umbrella;
    }
    const double off = deviation(loop, trial);
    if (off < best) {
      best = off;
      outline = std::move(trial);
    }
  }
}

/// Evenly spaced vertices, the first at the corner nearest to `first`.
Outline even_outline(const Loop& loop, const Vec3d& first, std::size_t count, double& off) {
  std::size_t start = 0;
  for (std::size_t k = 1; k < loop.size(); ++k) {
    if ((loop.corner(k) - first).squaredNorm() < (loop.corner(start) - first).squaredNorm()) {
      start = k;
    }
  }
  Outline outline;
  for (std::size_t i = 0; i < count; ++i) {
    outline.at.push_back(loop.at(start) +
                         loop.length() * static_cast<double>(i) / static_cast<double>(count));
    outline.points.push_back(loop.point(outline.at.back()));
  }
  off = deviation(loop, outline);
  bend(loop, outline, off);
  return outline;
}

/// The corners of the arc that its chords need (Douglas and Peucker), as places on the loop.
void divide_arc(const Loop& loop, double from, const Vec3d& p, double to, const Vec3d& q,
                double tolerance, std::vector<std::size_t>& out) {
  double worst = tolerance;
  std::size_t where = 0;
  bool any = false;
  loop.visit(from, to, [&](std::size_t k) {
    const double off = distance_to_segment(loop.corner(k), p, q);
    if (off > worst) {
      worst = off;
      where = k;
      any = true;
    }
  });
  if (!any) {
    return;
  }
  const double middle = loop.at(where);
  divide_arc(loop, from, p, middle, loop.corner(where), tolerance, out);
  out.push_back(where);
  // Arcs are told by a start in the first round.
  const double back = middle >= loop.length() ? loop.length() : 0.0;
  const std::size_t first = out.size();
  divide_arc(loop, middle - back, loop.corner(where), to - back, q, tolerance, out);
  if (back > 0.0) {
    for (std::size_t i = first; i < out.size(); ++i) {
      out[i] += loop.size();
    }
  }
}

/// Corners of the loop, at least `count` points.
Outline corner_outline(const Loop& loop, std::size_t count, double tolerance) {
  // From the two corners farthest apart, as seen from the first.
  const auto farthest = [&](std::size_t from) {
    std::size_t best = from;
    double most = -1.0;
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const double d = (loop.corner(k) - loop.corner(from)).squaredNorm();
      if (d > most) {
        most = d;
        best = k;
      }
    }
    return best;
  };
  const std::size_t a = farthest(0);
  const std::size_t b = farthest(a);
  const std::size_t low = std::min(a, b);
  const std::size_t high = std::max(a, b);
  std::vector<std::size_t> chosen{low};
  divide_arc(loop, loop.at(low), loop.corner(low), loop.at(high), loop.corner(high), tolerance,
             chosen);
  chosen.push_back(high);
  divide_arc(loop, loop.at(high), loop.corner(high), loop.at(low) + loop.length(), loop.corner(low),
             tolerance, chosen);
  Outline outline;
  for (const std::size_t k : chosen) {
    outline.at.push_back(loop.at(k));
  }
  while (outline.at.size() < std::max<std::size_t>(count, 3)) {
    std::size_t longest = 0;
    double most = -1.0;
    double middle = 0.0;
    for (std::size_t i = 0; i < outline.at.size(); ++i) {
      const double to =
          i + 1 < outline.at.size() ? outline.at[i + 1] : outline.at[0] + loop.length();
      if (to - outline.at[i] > most) {
        most = to - outline.at[i];
        longest = i;
        middle = 0.5 * (to + outline.at[i]);
      }
    }
    outline.at.insert(outline.at.begin() + static_cast<std::ptrdiff_t>(longest) + 1, middle);
  }
  for (const double s : outline.at) {
    outline.points.push_back(loop.point(s >= 2.0 * loop.length() ? s - loop.length() : s));
  }
  return outline;
}

/// For each vertex the point of the outline it becomes: in cyclic order, with the least sum of
/// squared ways.
std::vector<std::size_t> assign(const std::vector<Vec3d>& from, const std::vector<Vec3d>& to) {
  const std::size_t k = from.size();
  const std::size_t m = to.size();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::vector<std::size_t> best(k, 0);
  double least = kInfinity;
  std::vector<double> cost(k * m);
  std::vector<std::size_t> before(k * m);
  for (std::size_t turn = 0; turn < m; ++turn) {
    // The first vertex becomes point `turn`; point j of this round is turn + j.
    const auto way = [&](std::size_t i, std::size_t j) {
      return (from[i] - to[(turn + j) % m]).squaredNorm();
    };
    std::fill(cost.begin(), cost.end(), kInfinity);
    cost[0] = way(0, 0);
    for (std::size_t i = 1; i < k; ++i) {
      double lowest = kInfinity;
      std::size_t where = 0;
      for (std::size_t j = i; j + (k - i) <= m; ++j) {
        if (cost[(i - 1) * m + j - 1] < lowest) {
          lowest = cost[(i - 1) * m + j - 1];
          where = j - 1;
        }
        cost[i * m + j] = lowest + way(i, j);
        before[i * m + j] = where;
      }
    }
    std::size_t end = k - 1;
    for (std::size_t j = k - 1; j < m; ++j) {
      end = cost[(k - 1) * m + j] < cost[(k - 1) * m + end] ? j : end;
    }
    if (cost[(k - 1) * m + end] < least) {
      least = cost[(k - 1) * m + end];
      for (std::size_t i = k; i-- > 0;) {
        best[i] = (turn + end) % m;
        end = before[i * m + end];
      }
    }
  }
  return best;
}

/// The vertices around a hole, the surface on the left.
std::vector<std::uint32_t> rim(const CellMap& map, std::uint32_t hole,
                               std::vector<std::uint32_t>& halves) {
  map.face_halves(hole, halves);
  std::vector<std::uint32_t> vertices;
  for (auto h = halves.rbegin(); h != halves.rend(); ++h) {
    vertices.push_back(map.target(*h));
  }
  return vertices;
}

std::size_t loop_of(const CellMap& map, const std::vector<std::uint32_t>& vertices,
                    const BoundaryCurve& curve) {
  std::vector<std::uint32_t> votes;
  votes.reserve(vertices.size());
  for (const std::uint32_t v : vertices) {
    votes.push_back(curve.closest(map.position(v)).loop);
  }
  std::sort(votes.begin(), votes.end());
  std::uint32_t best = votes.front();
  std::ptrdiff_t most = 0;
  for (auto at = votes.begin(); at != votes.end();) {
    const auto end = std::upper_bound(at, votes.end(), *at);
    if (end - at > most) {
      most = end - at;
      best = *at;
    }
    at = end;
  }
  return best;
}

bool has_boundary(const PolygonMesh& mesh, const BoundaryLoops& loops) {
  return loops.size() > 0 && mesh.face_count() > 0;
}

void finish(CellMap& map, PolygonMesh& mesh) {
  map.set_normals({});
  split_cells(map);
  pair_triangles(map, kPairBetween);
  repair(map);
  mesh = map.to_mesh();
}

/// Moves the rim onto the outline and divides its edges; returns the vertices added.
std::uint64_t take_outline(CellMap& map, const std::vector<std::uint32_t>& vertices,
                           const Outline& outline) {
  std::vector<Vec3d> old;
  old.reserve(vertices.size());
  for (const std::uint32_t v : vertices) {
    old.push_back(map.position(v));
  }
  const std::size_t m = outline.points.size();
  const std::vector<std::size_t> becomes = assign(old, outline.points);
  std::uint64_t added = 0;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const std::uint32_t v = vertices[i];
    const std::uint32_t w = vertices[(i + 1) % vertices.size()];
    map.set_position(v, outline.points[becomes[i]]);
    map.set_corner(v);
    const std::size_t last = becomes[(i + 1) % vertices.size()];
    std::uint32_t h = map.find_half(v, w);
    for (std::size_t j = (becomes[i] + 1) % m; j != last; j = (j + 1) % m) {
      h = map.split_edge(h, outline.points[j]);
      map.set_corner(map.origin(h));
      ++added;
    }
  }
  return added;
}

/// Vertices beside moved rims may lie over the holes now: they go to the mean of their neighbours,
/// so that faces are split by shapes that the optimiser can reach.
void smooth_beside(CellMap& map, const std::vector<std::uint32_t>& rims) {
  std::vector<std::uint32_t> beside;
  for (const std::uint32_t v : rims) {
    const std::uint32_t start = map.vertex_half(v);
    std::uint32_t h = start;
    do {
      if (!map.on_curve(map.target(h)) && !map.is_corner(map.target(h))) {
        beside.push_back(map.target(h));
      }
      h = map.around(h);
    } while (h != start);
  }
  std::sort(beside.begin(), beside.end());
  beside.erase(std::unique(beside.begin(), beside.end()), beside.end());
  for (int round = 0; round < kSmoothings; ++round) {
    for (const std::uint32_t v : beside) {
      Vec3d sum = Vec3d::Zero();
      const std::uint32_t start = map.vertex_half(v);
      std::uint32_t h = start;
      do {
        sum += map.position(map.target(h));
        h = map.around(h);
      } while (h != start);
      map.set_position(v, sum / static_cast<double>(map.valence(v)));
    }
  }
}

/// Joins faces beside a hole with one edge to the inside to their neighbours: all of them, or those
/// that lie folded on these. Returns how many.
std::uint64_t merge_ears(CellMap& map, std::uint32_t hole, bool folded_only) {
  std::vector<std::uint32_t> ring;
  std::vector<std::uint32_t> halves;
  map.face_halves(hole, ring);
  std::uint64_t merged = 0;
  for (const std::uint32_t r : ring) {
    const std::uint32_t ear = map.face(CellMap::twin(r));
    map.face_halves(ear, halves);
    std::uint32_t inner = CellMap::kNone;
    std::size_t count = 0;
    for (const std::uint32_t h : halves) {
      if (!map.is_hole(map.face(CellMap::twin(h)))) {
        inner = h;
        ++count;
      }
    }
    if (count != 1 || map.is_feature(inner)) {
      continue;
    }
    const std::uint32_t beside = map.face(CellMap::twin(inner));
    if (beside != ear &&
        (!folded_only || map.face_normal(ear).dot(map.face_normal(beside)) < 0.0)) {
      map.erase_edge(inner);
      ++merged;
    }
  }
  return merged;
}

/// f(hole, its rim's vertices, number of the scan's loop) for the map's holes; those that f itself
/// makes are not visited.
template <class F>
void for_each_hole(const CellMap& map, const BoundaryCurve& curve, const F& f) {
  std::vector<std::uint32_t> halves;
  const std::uint32_t faces = map.face_count();
  for (std::uint32_t hole = 0; hole < faces; ++hole) {
    if (map.face_alive(hole) && map.is_hole(hole)) {
      const std::vector<std::uint32_t> vertices = rim(map, hole, halves);
      f(hole, vertices, loop_of(map, vertices, curve));
    }
  }
}

}  // namespace

BoundaryLoops::BoundaryLoops(const BoundaryCurve& curve, bool all) : corners_(curve.loops()) {
  for (const std::vector<Vec3d>& p : corners_) {
    double length = 0.0;
    for (std::size_t k = 0; k < p.size(); ++k) {
      length += (p[(k + 1) % p.size()] - p[k]).norm();
    }
    length_.push_back(length);
    const bool even =
        p.size() < kFewCorners || mean_turn(p, 1) - 0.5 * mean_turn(p, 2) <= kMostZigzag;
    smooth_.push_back(p.size() >= 3 && (all || even) ? 1 : 0);
    ragged_.push_back(p.size() >= 3 && all && !even ? 1 : 0);
  }
}

std::uint64_t reshape_short_loops(PolygonMesh& mesh, const BoundaryCurve& curve,
                                  const BoundaryLoops& loops, double longest, double tolerance) {
  std::uint64_t added = 0;
  if (!has_boundary(mesh, loops)) {
    return added;
  }
  CellMap map(std::move(mesh));
  std::vector<std::uint8_t> taken(loops.size(), 0);
  std::vector<std::uint32_t> rims;
  for_each_hole(
      map, curve,
      [&](std::uint32_t f, const std::vector<std::uint32_t>& vertices, std::size_t number) {
        const bool few =
            loops.length(number) < longest ||
            (loops.is_ragged(number) && loops.corners(number).size() <= kMostRaggedCorners);
        if (taken[number] != 0 || !loops.is_smooth(number) || !few) {
          return;
        }
        taken[number] = 1;
        const Loop loop(loops.corners(number));
        const std::size_t k = vertices.size();
        // What the optimiser makes of the vertices there are.
        const Vec3d first = map.position(vertices[0]);
        double off = 0.0;
        Outline best = even_outline(loop, first, k, off);
        if (off > tolerance) {
          best = corner_outline(loop, k, tolerance);
          const std::size_t most = std::min(best.points.size() - 1, k + kMostMore);
          for (std::size_t count = k + 1; count <= most; ++count) {
            Outline even = even_outline(loop, first, count, off);
            if (off <= tolerance) {
              best = std::move(even);
              break;
            }
          }
        }
        added += take_outline(map, vertices, best);
        rims.insert(rims.end(), vertices.begin(), vertices.end());
        merge_ears(map, f, false);  // they would cover a part of a round hole
      });
  smooth_beside(map, rims);
  finish(map, mesh);
  return added;
}

std::uint64_t unfold_ears(PolygonMesh& mesh) {
  CellMap map(std::move(mesh));
  std::uint64_t merged = 0;
  const std::uint32_t faces = map.face_count();
  for (std::uint32_t f = 0; f < faces; ++f) {
    if (map.face_alive(f) && map.is_hole(f)) {
      merged += merge_ears(map, f, true);
    }
  }
  if (merged > 0) {
    map.set_normals({});
    split_cells(map);
    repair(map);
  }
  mesh = map.to_mesh();
  return merged;
}

std::uint64_t refine_loops(PolygonMesh& mesh, const BoundaryCurve& curve,
                           const BoundaryLoops& loops, double tolerance) {
  std::uint64_t added = 0;
  if (!has_boundary(mesh, loops)) {
    return added;
  }
  CellMap map(std::move(mesh));
  std::vector<std::size_t> chosen;
  for_each_hole(
      map, curve,
      [&](std::uint32_t, const std::vector<std::uint32_t>& vertices, std::size_t number) {
        if (!loops.is_smooth(number)) {
          return;
        }
        const Loop loop(loops.corners(number));
        std::vector<double> at;
        at.reserve(vertices.size());
        for (const std::uint32_t v : vertices) {
          at.push_back(loop.closest(map.position(v)));
        }
        for (std::size_t i = 0; i < vertices.size(); ++i) {
          const std::uint32_t v = vertices[i];
          const std::uint32_t w = vertices[(i + 1) % vertices.size()];
          const double from = at[i] < loop.length() ? at[i] : 0.0;
          double to = at[(i + 1) % vertices.size()];
          to += to < from ? loop.length() : 0.0;
          const Vec3d p = map.position(v);
          const Vec3d q = map.position(w);
          if (to - from > kLongestArc * (q - p).norm() || to - from > 0.5 * loop.length()) {
            continue;
          }
          chosen.clear();
          divide_arc(loop, from, p, to, q, tolerance, chosen);
          std::uint32_t h = map.find_half(v, w);
          for (const std::size_t c : chosen) {
            h = map.split_edge(h, loop.corner(c));
            ++added;
          }
        }
      });
  if (added == 0) {
    mesh = map.to_mesh();
    return added;
  }
  finish(map, mesh);
  return added;
}

}  // namespace rattan
