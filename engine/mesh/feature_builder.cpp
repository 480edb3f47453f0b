// SPDX-License-Identifier: MIT
#include "engine/mesh/feature_builder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <tuple>

#include "engine/core/exact_math.h"

namespace rattan {

namespace {

/// In quad sides: what a component of creases has to be long, what a spur, and what a boundary
/// loop.
constexpr double kShortest = 4.0;
constexpr double kSpur = 1.0;
constexpr double kLongCurve = 3.0;
constexpr double kShortestLoop = 6.0;
/// Of a curve, this much has to be sharp by itself, in quad sides or as a share.
constexpr double kStrongLength = 2.0;
constexpr double kStrongShare = 0.5;
/// Edges of the scan run along its creases if it has any; the edges of noise zigzag: mean turn, in
/// radians, less half of that over two steps.
constexpr double kMostZigzag = 0.15;
/// How much more a crease bends than the surface beside it: objects with edges have 10 and much
/// more (30 where nothing is scanned), ridges and folds of carved or scanned ones 3 to 8.
constexpr double kClearContrast = 9.0;
constexpr double kFairContrast = 6.0;
constexpr double kMostContrast = 1e6;
/// If this share of all that is sharp lies on clear curves, the scan is of an object with edges
/// (two found: 0.5 and 1), else of one with relief (0 to 0.06 on ten).
constexpr double kClearShare = 0.25;
/// What is ragged has to be sharper by this than what is clear, and if there is too much of it, by
/// these angles.
constexpr double kRaggedShare = 1.1;
constexpr std::array kRaggedDegrees{0.0, 45.0, 60.0, 90.0};
/// A corner turns between points this far before and behind it, in quad sides.
constexpr double kWindow = 0.5;
constexpr double kCornerGrowth = 1.5;
constexpr double kCornerStays = 0.7;

std::uint32_t root(std::vector<std::uint32_t>& parent, std::uint32_t v) {
  while (parent[v] != v) {
    parent[v] = parent[parent[v]];
    v = parent[v];
  }
  return v;
}

void unite(std::vector<std::uint32_t>& parent, std::uint32_t a, std::uint32_t b) {
  a = root(parent, a);
  b = root(parent, b);
  parent[std::max(a, b)] = std::min(a, b);
}

double length_of(const FeatureCandidate& c) {
  return (c.p_hi.cast<double>() - c.p_lo.cast<double>()).norm();
}

double distance_to_segment(const Vec3d& p, const Vec3d& a, const Vec3d& b) {
  const Vec3d d = b - a;
  const double length2 = d.squaredNorm();
  const double t = length2 > 0.0 ? std::clamp((p - a).dot(d) / length2, 0.0, 1.0) : 0.0;
  return (a + t * d - p).norm();
}

bool before(const FeatureCandidate& x, const FeatureCandidate& y) {
  return std::tie(x.lo, x.hi, x.seen) < std::tie(y.lo, y.hi, y.seen);
}

/// Merges the halves of an edge; `complete(lo, hi)` says whether both must be there.
template <class Complete>
void merge_halves(std::vector<FeatureCandidate>& edges, const Complete& complete) {
  std::sort(edges.begin(), edges.end(), before);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < edges.size();) {
    FeatureCandidate c = edges[i];
    for (++i; i < edges.size() && edges[i].lo == c.lo && edges[i].hi == c.hi; ++i) {
      c.seen |= edges[i].seen;
      c.bend = std::min(c.bend, edges[i].bend);
      c.rest = std::max(c.rest, edges[i].rest);
      c.boundary = c.boundary || edges[i].boundary;
    }
    if (c.seen == 3 || !complete(c.lo, c.hi)) {
      edges[kept++] = c;
    }
  }
  edges.resize(kept);
}

}  // namespace

void FeatureBuilder::reduce_tile(std::uint64_t first, std::uint32_t owned,
                                 std::vector<FeatureCandidate>& found) const {
  const auto own = [&](std::uint64_t id) { return id >= first && id < first + owned; };
  merge_halves(found, [&](std::uint64_t lo, std::uint64_t hi) { return own(lo) && own(hi); });
  // Vertices of other tiles come last and mark what may go on there.
  std::vector<std::uint32_t> parent(std::size_t{owned} + 1);
  std::iota(parent.begin(), parent.end(), 0U);
  const auto local = [&](std::uint64_t id) {
    return own(id) ? static_cast<std::uint32_t>(id - first) : owned;
  };
  for (const FeatureCandidate& c : found) {
    unite(parent, local(c.lo), local(c.hi));
  }
  std::vector<double> length(std::size_t{owned} + 1, 0.0);
  for (const FeatureCandidate& c : found) {
    length[root(parent, local(c.lo))] += length_of(c);
  }
  const std::uint32_t outside = root(parent, owned);
  std::erase_if(found, [&](const FeatureCandidate& c) {
    const std::uint32_t r = root(parent, local(c.lo));
    return !c.boundary && r != outside && length[r] < kShortest * options_.side;
  });
}

void FeatureBuilder::drop(const std::vector<std::uint8_t>& keep) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    if (keep[i] != 0) {
      edges_[kept++] = edges_[i];
    }
  }
  edges_.resize(kept);
}

void FeatureBuilder::connect() {
  struct End {
    std::uint64_t id;
    std::uint32_t place;  // 2 * edge + which end
  };
  std::vector<End> all;
  all.reserve(2 * edges_.size());
  for (std::uint32_t e = 0; e < edges_.size(); ++e) {
    all.push_back({edges_[e].lo, 2 * e});
    all.push_back({edges_[e].hi, 2 * e + 1});
  }
  std::sort(all.begin(), all.end(), [](const End& x, const End& y) {
    return std::tie(x.id, x.place) < std::tie(y.id, y.place);
  });
  ids_.clear();
  positions_.clear();
  begin_.clear();
  around_.clear();
  ends_.resize(edges_.size());
  for (const End& end : all) {
    const std::uint32_t e = end.place >> 1;
    if (ids_.empty() || ids_.back() != end.id) {
      begin_.push_back(static_cast<std::uint32_t>(around_.size()));
      ids_.push_back(end.id);
      positions_.push_back((end.place & 1U) == 0 ? edges_[e].p_lo : edges_[e].p_hi);
    }
    ends_[e][end.place & 1U] = static_cast<std::uint32_t>(ids_.size() - 1);
    around_.push_back(e);
  }
  begin_.push_back(static_cast<std::uint32_t>(around_.size()));
}

std::vector<std::uint8_t> FeatureBuilder::plain_nodes() const {
  std::vector<std::uint8_t> node(ids_.size());
  for (std::uint32_t v = 0; v < ids_.size(); ++v) {
    const bool passed = valence(v) == 2 &&
                        edges_[around_[begin_[v]]].ragged == edges_[around_[begin_[v] + 1]].ragged;
    node[v] = passed ? 0 : 1;
  }
  return node;
}

void FeatureBuilder::trace(const std::vector<std::uint8_t>& node) {
  curves_.clear();
  walk_.clear();
  std::vector<std::uint8_t> used(edges_.size(), 0);
  const auto walk = [&](std::uint32_t from, std::uint32_t edge) {
    Curve c;
    c.first = static_cast<std::uint32_t>(walk_.size());
    c.from = from;
    c.boundary = edges_[edge].boundary;
    c.ragged = edges_[edge].ragged;
    std::uint32_t at = from;
    for (;;) {
      used[edge] = 1;
      walk_.push_back(edge);
      const double l = length(edge);
      c.length += l;
      c.strong_length += static_cast<double>(edges_[edge].bend) >= strong_ ? l : 0.0;
      at = other_end(edge, at);
      if (node[at] != 0) {
        break;
      }
      const std::uint32_t* e = around_.data() + begin_[at];
      edge = e[0] == edge ? e[1] : e[0];
      if (used[edge] != 0) {
        c.closed = true;
        break;
      }
    }
    c.to = at;
    c.count = static_cast<std::uint32_t>(walk_.size()) - c.first;
    curves_.push_back(c);
  };
  for (std::uint32_t v = 0; v < ids_.size(); ++v) {
    if (node[v] == 0) {
      continue;
    }
    for (std::uint32_t k = begin_[v]; k < begin_[v + 1]; ++k) {
      if (used[around_[k]] == 0) {
        walk(v, around_[k]);
      }
    }
  }
  for (std::uint32_t e = 0; e < edges_.size(); ++e) {
    if (used[e] == 0) {
      walk(ends_[e][0], e);
    }
  }
}

void FeatureBuilder::measure(Curve& c) const {
  std::vector<Vec3d> points{position(c.from)};
  std::uint32_t at = c.from;
  for (std::uint32_t k = 0; k < c.count; ++k) {
    at = other_end(walk_[c.first + k], at);
    points.push_back(position(at));
  }
  // Twice the sine of half the turn at each inner point, over one step and over two. Along a smooth
  // curve the latter is twice the former, along a zigzag it is near zero.
  const auto turns = [&](std::size_t step) {
    double sum = 0.0;
    std::size_t count = 0;
    for (std::size_t k = step; k + step < points.size(); ++k) {
      const Vec3d in = points[k] - points[k - step];
      const Vec3d out = points[k + step] - points[k];
      const double a = std::sqrt(in.squaredNorm());
      const double b = std::sqrt(out.squaredNorm());
      if (a > 0.0 && b > 0.0) {
        const Vec3d d = out / b - in / a;
        sum += std::sqrt(d.squaredNorm());
        ++count;
      }
    }
    return count > 0 ? sum / static_cast<double>(count) : 0.0;
  };
  double bend = 0.0;
  double rest = 0.0;
  for (std::uint32_t k = 0; k < c.count; ++k) {
    const std::uint32_t e = walk_[c.first + k];
    bend += length(e) * std::sqrt(static_cast<double>(edges_[e].bend));
    rest += length(e) * std::sqrt(static_cast<double>(edges_[e].rest));
  }
  c.contrast = rest > 0.0 ? bend / rest : kMostContrast;
  c.turn = turns(1);
  c.zigzag = c.count >= 4 ? c.turn - 0.5 * turns(2) : 0.5 * c.turn;
}

template <class Bad>
bool FeatureBuilder::drop_curves(const Bad& bad) {
  std::vector<std::uint8_t> keep(edges_.size(), 1);
  bool any = false;
  for (const Curve& c : curves_) {
    if (c.boundary || !bad(c)) {
      continue;
    }
    any = true;
    for (std::uint32_t k = 0; k < c.count; ++k) {
      keep[walk_[c.first + k]] = 0;
    }
  }
  if (any) {
    drop(keep);
  }
  return any;
}

template <class Bad>
void FeatureBuilder::drop_all(const Bad& bad) {
  for (bool again = true; again && !edges_.empty();) {
    connect();
    trace(plain_nodes());
    for (Curve& c : curves_) {
      measure(c);
    }
    again = drop_curves(bad);
  }
}

void FeatureBuilder::drop_noise() {
  const double side = options_.side;
  const auto loose = [&](const Curve& c) {
    return !c.closed && (valence(c.from) == 1 || valence(c.to) == 1);
  };
  const auto weak = [&](const Curve& c) {
    return c.strong_length < std::min(kStrongLength * side, kStrongShare * c.length);
  };
  drop_all([&](const Curve& c) { return loose(c) && c.length < kSpur * side; });
  drop_all([&](const Curve& c) {
    return (loose(c) && c.length < kSpur * side) || weak(c) || c.zigzag > kMostZigzag ||
           c.contrast < kFairContrast;
  });
  drop_all([&](const Curve& c) { return loose(c) && c.length < kLongCurve * side; });
  if (edges_.empty()) {
    return;
  }
  // Curves that leave no doubt, and what is joined to them.
  std::vector<std::uint8_t> supported(ids_.size(), 0);
  std::vector<std::uint8_t> accepted(curves_.size(), 0);
  for (bool grows = true; grows;) {
    grows = false;
    for (std::size_t i = 0; i < curves_.size(); ++i) {
      const Curve& c = curves_[i];
      if (accepted[i] != 0 || c.boundary) {
        continue;
      }
      const bool is_long = c.closed || c.length >= kLongCurve * side;
      const int ends = supported[c.from] + supported[c.to];
      if ((is_long && (c.contrast >= kClearContrast || ends > 0)) || ends == 2) {
        accepted[i] = 1;
        supported[c.from] = supported[c.to] = 1;
        grows = true;
      }
    }
  }
  if (drop_curves([&](const Curve& c) {
        return accepted[static_cast<std::size_t>(&c - curves_.data())] == 0;
      })) {
    drop_all([&](const Curve& c) { return loose(c) && c.length < kLongCurve * side; });
  }
}

std::uint64_t FeatureBuilder::units(double length) const {
  constexpr double kUnits = 1e6;
  return static_cast<std::uint64_t>(std::min(kUnits * length / options_.side, 1e15));
}

bool FeatureBuilder::find_clear() {
  merge_halves(edges_, [](std::uint64_t, std::uint64_t) { return true; });
  drop_noise();
  std::uint64_t clear = 0;
  for (const FeatureCandidate& c : edges_) {
    clear += !c.boundary && static_cast<double>(c.bend) >= strong_ ? units(length_of(c)) : 0;
  }
  clear_ = clear > 0 && static_cast<double>(clear) >= kClearShare * static_cast<double>(sharp_);
  if (clear_) {
    found_ = std::move(edges_);
    edges_.clear();
  }
  return clear_;
}

void FeatureBuilder::add_ragged() {
  merge_halves(edges_, [](std::uint64_t, std::uint64_t) { return true; });
  auto known = found_.begin();
  for (FeatureCandidate& c : edges_) {
    const auto ends = std::tie(c.lo, c.hi);
    while (known != found_.end() && std::tie(known->lo, known->hi) < ends) {
      ++known;
    }
    c.ragged = !c.boundary && (known == found_.end() || std::tie(known->lo, known->hi) != ends);
  }
  found_ = {};
  // The sharper ones only, if all were more than the remesh has room for.
  const std::vector<FeatureCandidate> all = edges_;
  for (const double degrees : kRaggedDegrees) {
    const double least = std::max(degrees, kRaggedShare * options_.crease_degrees);
    const double s = exact::sincos(0.5 * least / 180.0 * exact::kPi).sin;
    keep_ragged(4.0 * s * s);
    if (ragged_corners() <= options_.most_corners) {
      return;
    }
    edges_ = all;
  }
  std::erase_if(edges_, [](const FeatureCandidate& c) { return c.ragged; });
}

void FeatureBuilder::keep_ragged(double strong) {
  connect();
  trace(plain_nodes());
  // Of curves that are mostly weak only what is sharp by itself.
  std::vector<std::uint8_t> keep(edges_.size(), 1);
  for (const Curve& c : curves_) {
    const auto sharp = [&](std::uint32_t e) {
      return static_cast<double>(edges_[e].bend) >= strong;
    };
    double length_of_sharp = 0.0;
    for (std::uint32_t k = 0; k < c.count; ++k) {
      const std::uint32_t e = walk_[c.first + k];
      length_of_sharp += sharp(e) ? length(e) : 0.0;
    }
    if (c.ragged && length_of_sharp < kStrongShare * c.length) {
      for (std::uint32_t k = 0; k < c.count; ++k) {
        keep[walk_[c.first + k]] = sharp(walk_[c.first + k]) ? 1 : 0;
      }
    }
  }
  drop(keep);
  connect();
  drop_short();
}

std::size_t FeatureBuilder::ragged_corners() {
  connect();
  std::vector<std::uint8_t> corner = plain_nodes();
  divide_ragged(corner);
  std::size_t count = 0;
  for (std::uint32_t v = 0; v < ids_.size(); ++v) {
    bool ragged = false;
    for (std::uint32_t k = begin_[v]; k < begin_[v + 1]; ++k) {
      ragged = ragged || edges_[around_[k]].ragged;
    }
    count += corner[v] != 0 && ragged ? 1 : 0;
  }
  return count;
}

void FeatureBuilder::drop_short() {
  // Components of creases and loops of the boundary, each by itself.
  std::vector<double> total(ids_.size(), 0.0);
  std::vector<std::uint8_t> keep(edges_.size(), 1);
  for (const bool boundary : {false, true}) {
    std::vector<std::uint32_t> parent(ids_.size());
    std::iota(parent.begin(), parent.end(), 0U);
    for (std::uint32_t e = 0; e < edges_.size(); ++e) {
      if (edges_[e].boundary == boundary) {
        unite(parent, ends_[e][0], ends_[e][1]);
      }
    }
    std::fill(total.begin(), total.end(), 0.0);
    for (std::uint32_t e = 0; e < edges_.size(); ++e) {
      if (edges_[e].boundary == boundary) {
        total[root(parent, ends_[e][0])] += length(e);
      }
    }
    const double least = (boundary ? kShortestLoop : kShortest) * options_.side;
    for (std::uint32_t e = 0; e < edges_.size(); ++e) {
      if (edges_[e].boundary == boundary && total[root(parent, ends_[e][0])] < least) {
        keep[e] = 0;
      }
    }
  }
  drop(keep);
}

std::vector<std::uint8_t> FeatureBuilder::find_corners() const {
  std::vector<std::uint8_t> corner = plain_nodes();
  const double limit = options_.corner_degrees / 180.0 * exact::kPi;
  struct Turn {
    double angle;
    std::uint32_t vertex;
  };
  std::vector<Turn> turns;
  std::vector<std::uint8_t> candidate(ids_.size(), 0);
  // The point one window away along the curve, or its end.
  const auto away = [&](std::uint32_t v, std::uint32_t edge, double window) -> Vec3d {
    std::uint32_t at = v;
    for (std::size_t steps = 0; steps < edges_.size(); ++steps) {
      const std::uint32_t to = other_end(edge, at);
      const double l = length(edge);
      if (l >= window) {
        return position(at) + window / l * (position(to) - position(at));
      }
      window -= l;
      at = to;
      if (at == v || valence(at) != 2) {
        break;
      }
      const std::uint32_t* e = around_.data() + begin_[at];
      edge = e[0] == edge ? e[1] : e[0];
    }
    return position(at);
  };
  const double window = kWindow * options_.side;
  for (std::uint32_t v = 0; v < ids_.size(); ++v) {
    if (valence(v) != 2) {
      continue;
    }
    const std::uint32_t a = around_[begin_[v]];
    const std::uint32_t b = around_[begin_[v] + 1];
    const auto angle = [&](double reach) {
      const Vec3d in = position(v) - away(v, a, reach);
      const Vec3d out = away(v, b, reach) - position(v);
      return exact::atan2(std::sqrt(in.cross(out).squaredNorm()), in.dot(out));
    };
    // In twice the window an arc turns twice as far, a corner as far, a notch hardly.
    const double turn = angle(window);
    const double wide = turn > limit ? angle(2.0 * window) : 0.0;
    if (wide > kCornerStays * turn && wide < kCornerGrowth * turn) {
      turns.push_back({turn, v});
      candidate[v] = 1;
    }
  }
  // The sharpest first; it silences the others within its window.
  std::stable_sort(turns.begin(), turns.end(),
                   [](const Turn& x, const Turn& y) { return x.angle > y.angle; });
  for (const Turn& t : turns) {
    if (candidate[t.vertex] == 0) {
      continue;
    }
    corner[t.vertex] = 1;
    for (std::uint32_t k = begin_[t.vertex]; k < begin_[t.vertex + 1]; ++k) {
      std::uint32_t edge = around_[k];
      std::uint32_t at = t.vertex;
      double left = window;
      for (;;) {
        left -= length(edge);
        at = other_end(edge, at);
        if (left < 0.0 || at == t.vertex || valence(at) != 2) {
          break;
        }
        candidate[at] = 0;
        const std::uint32_t* e = around_.data() + begin_[at];
        edge = e[0] == edge ? e[1] : e[0];
      }
    }
  }
  return corner;
}

// Douglas and Peucker.
void FeatureBuilder::divide(const std::vector<std::uint32_t>& path, std::size_t first,
                            std::size_t last, std::vector<std::uint8_t>& node) const {
  double worst = options_.tolerance;
  std::size_t where = 0;
  for (std::size_t i = first + 1; i < last; ++i) {
    const double off =
        distance_to_segment(position(path[i]), position(path[first]), position(path[last]));
    if (off > worst) {
      worst = off;
      where = i;
    }
  }
  if (where > 0) {
    node[path[where]] = 1;
    divide(path, first, where, node);
    divide(path, where, last, node);
  }
}

void FeatureBuilder::divide_ragged(std::vector<std::uint8_t>& node) {
  trace(node);
  std::vector<std::uint32_t> path;
  for (const Curve& c : curves_) {
    if (!c.ragged) {
      continue;
    }
    path.assign(1, c.from);
    for (std::uint32_t k = 0; k < c.count; ++k) {
      path.push_back(other_end(walk_[c.first + k], path.back()));
    }
    if (c.closed) {
      node[c.from] = 1;
    }
    divide(path, 0, path.size() - 1, node);
  }
}

void FeatureBuilder::list_followed(FeatureSet& set) const {
  set.vertices_ = ids_;
  set.first_ = begin_;
  for (std::uint32_t v = 0; v < ids_.size(); ++v) {
    for (std::uint32_t k = begin_[v]; k < begin_[v + 1]; ++k) {
      set.neighbors_.push_back(ids_[other_end(around_[k], v)]);
    }
    std::sort(set.neighbors_.begin() + begin_[v], set.neighbors_.begin() + begin_[v + 1]);
  }
  const std::vector<std::uint8_t> corner = find_corners();
  for (std::uint32_t v = 0; v < ids_.size(); ++v) {
    if (corner[v] != 0) {
      set.followed_corners_.push_back(ids_[v]);
    }
  }
}

FeatureSet FeatureBuilder::finish() {
  FeatureSet set;
  set.clear_ = clear_;
  connect();
  drop_short();
  if (edges_.empty()) {
    return set;
  }
  const std::vector<FeatureCandidate> kept = edges_;
  std::erase_if(edges_, [](const FeatureCandidate& c) { return c.ragged; });
  connect();
  list_followed(set);
  edges_ = kept;
  connect();
  std::vector<std::uint8_t> corner = plain_nodes();
  for (std::uint32_t v = 0; v < ids_.size(); ++v) {
    if (std::binary_search(set.followed_corners_.begin(), set.followed_corners_.end(), ids_[v])) {
      corner[v] = 1;
    }
  }
  divide_ragged(corner);
  trace(corner);
  set.edges_.resize(edges_.size());
  for (std::uint32_t i = 0; i < curves_.size(); ++i) {
    for (std::uint32_t k = 0; k < curves_[i].count; ++k) {
      set.edges_[walk_[curves_[i].first + k]].curve = i;
    }
  }
  set.curves_ = static_cast<std::uint32_t>(curves_.size());
  for (std::size_t e = 0; e < edges_.size(); ++e) {
    FeatureEdge& to = set.edges_[e];
    to.lo = edges_[e].lo;
    to.hi = edges_[e].hi;
    to.boundary = edges_[e].boundary;
    to.ragged = edges_[e].ragged;
    to.p_lo = edges_[e].p_lo;
    to.p_hi = edges_[e].p_hi;
    set.crease_edges_ += to.boundary ? 0 : 1;
  }
  set.all_vertices_ = ids_;
  for (std::uint32_t v = 0; v < ids_.size(); ++v) {
    if (corner[v] != 0) {
      set.corners_.push_back(ids_[v]);
    }
    // On an object with edges their ends are meant, and stay.
    if (valence(v) == 1 && !clear_) {
      set.loose_ends_.push_back(ids_[v]);
    }
  }
  return set;
}

}  // namespace rattan
