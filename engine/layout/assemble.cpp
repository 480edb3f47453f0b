// SPDX-License-Identifier: MIT
#include "engine/layout/assemble.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "engine/core/errors.h"

namespace rattan::layout {

namespace {

constexpr std::uint32_t kFewestOnLoop = 3;
/// A crossing whose other line was dropped may stand for a spaced vertex this far away, in parts of
/// the edge.
constexpr double kNearby = 0.35;

/// A strand as points; segment i lies in triangle[i].
struct Polyline {
  std::vector<Vec3d> position;
  std::vector<PointKey> key;
  std::vector<std::uint64_t> triangle;
};

class Assembler {
 public:
  Assembler(Skeleton& skeleton, double side, const PolylineSource& polylines)
      : k_(skeleton), side_(side), source_(polylines) {}

  Assembly run() {
    count_parts();
    complete_boundary_loops();
    use_crossings();
    fetch();
    order_closed();
    make_vertices();
    make_faces();
    return std::move(out_);
  }

 private:
  void count_parts() {
    parts_.reserve(k_.strands.size());
    for (const Strand& s : k_.strands) {
      const double length = static_cast<double>(s.length) / side_;
      const auto whole = static_cast<std::uint32_t>(std::min(std::floor(length + 0.5), 1e9));
      if (s.closed) {
        parts_.push_back(std::max(kFewestOnLoop, whole));
      } else {
        const bool is_long = length > (s.boundary || s.feature ? kLongBoundary : kLongInside);
        parts_.push_back(is_long ? std::max(2U, whole) : 1U);
      }
    }
  }

  /// Loops of the scan's boundary keep at least three edges.
  void complete_boundary_loops() {
    std::vector<std::uint32_t> leaving(k_.nodes.size(), kNone);  // boundary strand from a node
    for (std::uint32_t i = 0; i < k_.strands.size(); ++i) {
      if (k_.strands[i].boundary && !k_.strands[i].closed) {
        leaving[k_.start(k_.strands[i].first)] = i;
      }
    }
    std::vector<std::uint8_t> seen(k_.strands.size(), 0);
    std::vector<std::uint32_t> loop;
    for (std::uint32_t i = 0; i < k_.strands.size(); ++i) {
      if (!k_.strands[i].boundary || k_.strands[i].closed || seen[i] != 0) {
        continue;
      }
      loop.clear();
      std::uint32_t total = 0;
      for (std::uint32_t at = i; seen[at] == 0; at = leaving[k_.end(k_.strands[at].last)]) {
        seen[at] = 1;
        loop.push_back(at);
        total += parts_[at];
        ensure(leaving[k_.end(k_.strands[at].last)] != kNone, "the boundary consists of loops");
      }
      for (; total < kFewestOnLoop; ++total) {
        std::uint32_t longest = loop.front();
        for (const std::uint32_t at : loop) {
          // Lengths per part, compared without division.
          if (k_.strands[at].length * parts_[longest] > k_.strands[longest].length * parts_[at]) {
            longest = at;
          }
        }
        ++parts_[longest];
      }
    }
  }

  template <class F>
  void for_each_dart(const Strand& s, const F& f) const {
    for (std::uint32_t d = s.first;; d = k_.next_on_strand(d)) {
      f(d);
      if (d == s.last) {
        return;
      }
    }
  }

  /// Most long edges are long because lines across them were dropped: where crossings with those
  /// lie about evenly spaced, they serve, and no tile needs to be opened again.
  void use_crossings() {
    chosen_.resize(k_.strands.size());
    std::vector<std::uint32_t> nodes;
    std::vector<std::int64_t> along;
    for (std::uint32_t i = 0; i < k_.strands.size(); ++i) {
      const Strand& s = k_.strands[i];
      if (parts_[i] == 1 || s.closed || s.boundary || s.feature) {
        continue;
      }
      nodes.clear();
      along.clear();
      std::int64_t length = 0;
      for_each_dart(s, [&](std::uint32_t d) {
        length += k_.arcs[d >> 1].length;
        if (d != s.last && k_.nodes[k_.end(d)].key.in_triangle()) {
          nodes.push_back(k_.end(d));
          along.push_back(length);
        }
      });
      for (const std::uint32_t parts : {parts_[i], parts_[i] - 1, parts_[i] + 1}) {
        if (parts > 1 && choose(nodes, along, length, parts, chosen_[i])) {
          parts_[i] = parts;
          break;
        }
        chosen_[i].clear();
      }
    }
  }

  /// Nodes near the ends of equal parts, in order; false if one is missing.
  static bool choose(const std::vector<std::uint32_t>& nodes,
                     const std::vector<std::int64_t>& along, std::int64_t length,
                     std::uint32_t parts, std::vector<std::uint32_t>& chosen) {
    const double part = static_cast<double>(length) / parts;
    std::size_t at = 0;
    for (std::uint32_t j = 1; j < parts; ++j) {
      const auto off = [&](std::size_t n) {
        return std::abs(static_cast<double>(along[n]) - part * j);
      };
      while (at + 1 < nodes.size() && off(at + 1) < off(at)) {
        ++at;
      }
      if (at == nodes.size() || off(at) > kNearby * part) {
        return false;
      }
      chosen.push_back(nodes[at++]);
    }
    return true;
  }

  bool needs_line(std::uint32_t strand) const {
    return parts_[strand] > 1 && chosen_[strand].empty();
  }

  void fetch() {
    std::vector<ArcRequest> requests;
    for (std::uint32_t i = 0; i < k_.strands.size(); ++i) {
      if (needs_line(i)) {
        for_each_dart(k_.strands[i], [&](std::uint32_t d) {
          const SkeletonArc& a = k_.arcs[d >> 1];
          if (a.tile != kNone) {
            requests.push_back({a.tile, a.index});
          }
        });
      }
    }
    const auto before = [](const ArcRequest& x, const ArcRequest& y) {
      return std::tie(x.tile, x.arc) < std::tie(y.tile, y.arc);
    };
    std::sort(requests.begin(), requests.end(), before);
    const std::vector<std::vector<ArcPoint>> arcs =
        requests.empty() ? std::vector<std::vector<ArcPoint>>{} : source_(requests);
    ensure(arcs.size() == requests.size(), "every requested polyline came back");
    lines_.resize(k_.strands.size());
    for (std::uint32_t i = 0; i < k_.strands.size(); ++i) {
      if (!needs_line(i)) {
        continue;
      }
      Polyline& line = lines_[i];
      for_each_dart(k_.strands[i], [&](std::uint32_t d) {
        const SkeletonArc& a = k_.arcs[d >> 1];
        std::vector<ArcPoint> rim;
        const std::vector<ArcPoint>* points = &rim;
        if (a.tile != kNone) {
          const auto at = std::lower_bound(requests.begin(), requests.end(),
                                           ArcRequest{a.tile, a.index}, before);
          points = &arcs[static_cast<std::size_t>(at - requests.begin())];
        } else {
          for (const std::uint32_t n : a.node) {
            rim.push_back({k_.nodes[n].position, k_.nodes[n].key, a.triangle});
          }
        }
        append(line, *points, (d & 1U) == 0);
      });
    }
  }

  /// Adds an arc; its first point is there already unless the line is empty.
  static void append(Polyline& line, const std::vector<ArcPoint>& points, bool forward) {
    const std::size_t n = points.size();
    for (std::size_t i = 0; i < n; ++i) {
      const ArcPoint& p = points[forward ? i : n - 1 - i];
      if (i > 0) {
        line.triangle.push_back(points[forward ? i - 1 : n - 1 - i].triangle);
      } else if (!line.position.empty()) {
        continue;
      }
      line.position.push_back(p.position);
      line.key.push_back(p.key);
    }
  }

  /// Closed strands start at their lowest point; inside the scan they run towards its lower
  /// neighbour.
  void order_closed() {
    std::vector<std::uint32_t> closed;
    for (std::uint32_t i = 0; i < k_.strands.size(); ++i) {
      Strand& s = k_.strands[i];
      order_.push_back(i);
      if (!s.closed) {
        continue;
      }
      ensure(i + 1 == k_.strands.size() || k_.strands[i + 1].closed, "closed strands come last");
      closed.push_back(i);
      order_.pop_back();
      Polyline& l = lines_[i];
      const std::size_t n = l.triangle.size();
      l.position.pop_back();
      l.key.pop_back();
      const auto lowest = std::min_element(l.key.begin(), l.key.end()) - l.key.begin();
      std::rotate(l.position.begin(), l.position.begin() + lowest, l.position.end());
      std::rotate(l.key.begin(), l.key.begin() + lowest, l.key.end());
      std::rotate(l.triangle.begin(), l.triangle.begin() + lowest, l.triangle.end());
      if (!s.boundary && n > 1 && l.key[n - 1] < l.key[1]) {
        std::reverse(l.position.begin() + 1, l.position.end());
        std::reverse(l.key.begin() + 1, l.key.end());
        std::reverse(l.triangle.begin(), l.triangle.end());
        std::swap(s.first, s.last);
        s.first ^= 1U;
        s.last ^= 1U;
      }
      l.position.push_back(l.position.front());
    }
    std::sort(closed.begin(), closed.end(), [&](std::uint32_t x, std::uint32_t y) {
      return lines_[x].key.front() < lines_[y].key.front();
    });
    order_.insert(order_.end(), closed.begin(), closed.end());
  }

  std::uint32_t add_vertex(const Vec3d& position, std::uint64_t triangle, std::uint8_t flags) {
    PolygonMesh& m = out_.cells.mesh;
    m.positions.push_back(position);
    m.scan_triangle.push_back(triangle);
    m.vertex_flags.push_back(flags);
    return static_cast<std::uint32_t>(m.positions.size() - 1);
  }

  void make_vertices() {
    vertex_.assign(k_.nodes.size(), kNone);
    for (const std::uint32_t n : k_.essential) {
      bool boundary = false;
      for (std::uint32_t i = k_.dart_begin[n]; i < k_.dart_begin[n + 1]; ++i) {
        boundary = boundary || k_.arcs[k_.darts[i] >> 1].right == kNone;
      }
      const bool corner = (boundary && (k_.nodes[n].flags & kCornerNode) != 0) ||
                          (k_.nodes[n].flags & kFeatureCornerNode) != 0;
      vertex_[n] = add_vertex(k_.nodes[n].position, k_.nodes[n].triangle,
                              static_cast<std::uint8_t>((boundary ? kBoundaryVertex : 0) |
                                                        (corner ? kCornerVertex : 0)));
    }
    first_vertex_.assign(k_.strands.size(), kNone);
    first_edge_.assign(k_.strands.size(), 0);
    for (const std::uint32_t i : order_) {
      const Strand& s = k_.strands[i];
      first_edge_[i] = out_.cells.edge_count;
      out_.cells.edge_count += parts_[i];
      out_.cells.edge_feature.resize(out_.cells.edge_count, s.feature ? 1 : 0);
      if (parts_[i] == 1) {
        continue;
      }
      first_vertex_[i] = static_cast<std::uint32_t>(out_.cells.mesh.vertex_count());
      for (const std::uint32_t n : chosen_[i]) {
        add_vertex(k_.nodes[n].position, k_.nodes[n].triangle, 0);
        ++out_.spaced_vertices;
      }
      if (!needs_line(i)) {
        continue;
      }
      space(lines_[i], parts_[i], s.closed, s.boundary ? kBoundaryVertex : 0);
      lines_[i] = {};
    }
    ensure(
        out_.cells.mesh.vertex_count() < kNone && 2 * std::uint64_t{out_.cells.edge_count} < kNone,
        "the output fits 32-bit numbers");
  }

  void space(const Polyline& line, std::uint32_t parts, bool closed, std::uint8_t flags) {
    const std::size_t n = line.triangle.size();
    std::vector<double> along(n + 1, 0.0);
    for (std::size_t i = 0; i < n; ++i) {
      const Vec3d d = line.position[i + 1] - line.position[i];
      along[i + 1] = along[i] + std::sqrt(d.x() * d.x() + d.y() * d.y() + d.z() * d.z());
    }
    std::size_t at = 0;
    for (std::uint32_t j = closed ? 0 : 1; j < parts; ++j) {
      const double wanted = along[n] * j / parts;
      while (at + 1 < n && along[at + 1] <= wanted) {
        ++at;
      }
      const double length = along[at + 1] - along[at];
      const double t = length > 0.0 ? std::min(1.0, (wanted - along[at]) / length) : 0.0;
      add_vertex(line.position[at] + t * (line.position[at + 1] - line.position[at]),
                 line.triangle[at], flags);
      ++out_.spaced_vertices;
    }
  }

  /// Appends the corners of strand i in direction `dir` to the face under construction.
  void walk(std::uint32_t i, std::uint32_t dir) {
    const Strand& s = k_.strands[i];
    const std::uint32_t n = parts_[i];
    used_[2 * i + dir] = 1;
    for (std::uint32_t j = 0; j < n; ++j) {
      std::uint32_t v = 0;
      if (s.closed) {
        v = first_vertex_[i] + (dir == 0 ? j : (n - j) % n);
      } else if (j == 0) {
        v = vertex_[dir == 0 ? k_.start(s.first) : k_.end(s.last)];
      } else {
        v = first_vertex_[i] + (dir == 0 ? j - 1 : n - 1 - j);
      }
      out_.cells.mesh.corners.push_back(v);
      out_.cells.corner_edge.push_back(first_edge_[i] + (dir == 0 ? j : n - 1 - j));
    }
  }

  void close_face(std::uint32_t face) {
    ensure(face_seen_[face] == 0 && k_.euler[face] == 1, "every face is a disk");
    face_seen_[face] = 1;
    out_.cells.mesh.face_begin.push_back(out_.cells.mesh.corners.size());
    out_.cells.face_singular.push_back(k_.singular[face]);
  }

  void make_faces() {
    std::vector<std::uint32_t> strand_at(2 * k_.arcs.size(), kNone);
    for (std::uint32_t i = 0; i < k_.strands.size(); ++i) {
      if (!k_.strands[i].closed) {
        strand_at[k_.strands[i].first] = 2 * i;
        strand_at[k_.strands[i].last ^ 1U] = 2 * i + 1;
      }
    }
    used_.assign(2 * k_.strands.size(), 0);
    face_seen_.assign(k_.euler.size(), 0);
    for (const std::uint32_t n : k_.essential) {
      for (std::uint32_t place = k_.dart_begin[n]; place < k_.dart_begin[n + 1]; ++place) {
        const std::uint32_t first = k_.darts[place];
        const std::uint32_t face = k_.left(first);
        if (face == kNone || used_[strand_at[first]] != 0) {
          continue;
        }
        for (std::uint32_t d = first;;) {
          const std::uint32_t i = strand_at[d] >> 1;
          const std::uint32_t dir = strand_at[d] & 1U;
          ensure(k_.left(d) == face, "a walk around a face stays beside it");
          walk(i, dir);
          d = k_.next_around(dir == 0 ? k_.strands[i].last : k_.strands[i].first ^ 1U);
          if (d == first) {
            break;
          }
        }
        close_face(face);
      }
    }
    for (const std::uint32_t i : order_) {
      if (!k_.strands[i].closed) {
        continue;
      }
      for (std::uint32_t dir = 0; dir < 2; ++dir) {
        const std::uint32_t d = dir == 0 ? k_.strands[i].first : k_.strands[i].last ^ 1U;
        if (k_.left(d) != kNone) {
          walk(i, dir);
          close_face(k_.left(d));
        }
      }
    }
    for (std::uint32_t f = 0; f < face_seen_.size(); ++f) {
      ensure(k_.faces.find(f) != f || face_seen_[f] != 0, "every face is part of the output");
    }
  }

  Skeleton& k_;
  double side_;
  const PolylineSource& source_;
  Assembly out_;
  std::vector<std::uint32_t> parts_;                // edges of each strand
  std::vector<std::vector<std::uint32_t>> chosen_;  // crossings that serve as its spaced vertices
  std::vector<Polyline> lines_;
  std::vector<std::uint32_t> order_;         // strands in canonical order
  std::vector<std::uint32_t> vertex_;        // output vertex of each essential node
  std::vector<std::uint32_t> first_vertex_;  // of a strand's spaced vertices
  std::vector<std::uint32_t> first_edge_;
  std::vector<std::uint8_t> used_;  // strand and direction
  std::vector<std::uint8_t> face_seen_;
};

}  // namespace

Assembly assemble(Skeleton& skeleton, double side, const PolylineSource& polylines) {
  return Assembler(skeleton, side, polylines).run();
}

}  // namespace rattan::layout
