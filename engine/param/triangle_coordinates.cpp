// SPDX-License-Identifier: MIT
#include "engine/param/triangle_coordinates.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "engine/core/errors.h"
#include "engine/core/exact_math.h"

namespace rattan {

namespace {

constexpr double kTurn = 2.0 * exact::kPi;
/// Keeps sums of periods around a triangle, times the density, inside 32 bits.
constexpr double kMostPeriods = 1 << 20;

std::int32_t nearest_period(double difference) {
  // floor() without its call.
  const double periods = std::clamp(difference / kTurn + 0.5, -kMostPeriods, kMostPeriods);
  const auto toward_zero = static_cast<std::int32_t>(periods);
  return toward_zero - (static_cast<double>(toward_zero) > periods ? 1 : 0);
}

/// Fills edges, edge_begin and side_edge.
void connect(const TileMesh& mesh, TileCoordinates& c) {
  const std::span<const LocalTriangle> triangles = mesh.triangles.span();
  const std::size_t n = c.ids.size();
  const auto lower = [&](std::uint32_t a, std::uint32_t b) { return c.ids[a] < c.ids[b]; };
  std::vector<std::uint32_t> begin(n + 1, 0);
  for (const LocalTriangle& t : triangles) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k];
      const std::uint32_t b = t[k == 2 ? 0 : k + 1];
      ++begin[(lower(a, b) ? a : b) + 1];
    }
  }
  for (std::size_t v = 0; v < n; ++v) {
    begin[v + 1] += begin[v];
  }
  struct Entry {
    std::uint32_t hi;
    std::uint32_t side;
  };
  std::vector<Entry> entries(begin[n]);
  std::vector<std::uint32_t> at(begin.begin(), begin.end() - 1);
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t a = triangles[i][k];
      const std::uint32_t b = triangles[i][k == 2 ? 0 : k + 1];
      const bool forward = lower(a, b);
      entries[at[forward ? a : b]++] = {forward ? b : a, 3 * i + k};
    }
  }
  c.side_edge.resize(3 * triangles.size());
  c.edges.clear();
  c.edges.reserve(triangles.size() + triangles.size() / 2 + 64);
  c.edge_begin.resize(n + 1);
  for (std::uint32_t v = 0; v < n; ++v) {
    c.edge_begin[v] = static_cast<std::uint32_t>(c.edges.size());
    Entry* first = entries.data() + begin[v];
    Entry* last = entries.data() + begin[v + 1];
    // A bucket holds a vertex's few sides: insertion sort beats everything else.
    for (Entry* e = first; e != last; ++e) {
      const Entry moving = *e;
      Entry* to = e;
      for (; to != first && to[-1].hi > moving.hi; --to) {
        *to = to[-1];
      }
      *to = moving;
    }
    for (const Entry* e = first; e != last; ++e) {
      if (e == first || e->hi != e[-1].hi) {
        TileEdge edge;
        edge.lo = v;
        edge.hi = e->hi;
        c.edges.push_back(edge);
      }
      TileEdge& edge = c.edges.back();
      const bool forward = triangles[e->side / 3][e->side % 3] == v;
      std::uint32_t& slot = forward ? edge.left : edge.right;
      ensure(slot == kNoSide, "a tile's triangles are manifold and consistently oriented");
      slot = e->side;
      c.side_edge[e->side] = static_cast<std::uint32_t>(c.edges.size() - 1);
    }
  }
  c.edge_begin[n] = static_cast<std::uint32_t>(c.edges.size());
}

}  // namespace

EdgeTransport compose(const EdgeTransport& outer, const EdgeTransport& inner) {
  EdgeTransport c = inner;
  quarter_turns(outer.r, c.s, c.t);
  c.s += outer.s;
  c.t += outer.t;
  c.r = (outer.r + inner.r) & 3U;
  return c;
}

EdgeTransport inverse(const EdgeTransport& transport) {
  EdgeTransport c;
  c.r = (4 - transport.r) & 3U;
  c.s = -transport.s;
  c.t = -transport.t;
  quarter_turns(c.r, c.s, c.t);
  return c;
}

PhaseAngles phase_angles(const PairValue& x) {
  const auto finite = [](const Complex& z) {
    return std::isfinite(z.real()) && std::isfinite(z.imag()) ? z : Complex(0.0F, 0.0F);
  };
  const Complex u = finite(x.u);
  const Complex v = finite(x.v);
  const std::array<double, 2> angles =
      exact::atan2(std::array<double, 2>{u.imag(), v.imag()}, {u.real(), v.real()});
  return {angles[0], angles[1]};
}

EdgeTransport edge_transport(const EdgeGauge& gauge, const PhaseAngles& lower,
                             const PhaseAngles& higher) {
  PhaseAngles far = higher;
  quarter_turns(gauge.r, far.theta, far.phi);
  const auto finite = [](double d) { return std::isfinite(d) ? d : 0.0; };
  EdgeTransport c;
  c.r = gauge.r;
  c.s = nearest_period(lower.theta + finite(gauge.delta) - far.theta);
  c.t = nearest_period(lower.phi + finite(gauge.delta_perp) - far.phi);
  return c;
}

EdgeTransport TileCoordinates::side_transport(std::uint32_t side) const {
  const TileEdge& e = edges[side_edge[side]];
  return e.left == side ? e.transport : inverse(e.transport);
}

EdgeTransport TileCoordinates::holonomy(std::uint32_t triangle) const {
  return compose(compose(side_transport(3 * triangle), side_transport(3 * triangle + 1)),
                 side_transport(3 * triangle + 2));
}

std::uint32_t TileCoordinates::find_edge(std::uint32_t a, std::uint32_t b) const {
  if (ids[b] < ids[a]) {
    std::swap(a, b);
  }
  const auto first = edges.begin() + edge_begin[a];
  const auto last = edges.begin() + edge_begin[a + 1];
  const auto e =
      std::lower_bound(first, last, b, [](const TileEdge& x, std::uint32_t v) { return x.hi < v; });
  return e != last && e->hi == b ? static_cast<std::uint32_t>(e - edges.begin()) : kNoSide;
}

TileCoordinates tile_coordinates(const TileMesh& mesh, std::span<const VertexFrame> frames,
                                 std::span<const PairValue> phases, double omega) {
  TileCoordinates c;
  const std::uint32_t n = mesh.local_vertices();
  ensure(frames.size() == n && phases.size() == n, "fields cover a tile's local vertices");
  c.ids.resize(n);
  c.angles.resize(n);
  c.pins.resize(n);
  for (std::uint32_t v = 0; v < n; ++v) {
    c.ids[v] = mesh.global_id(v);
    c.angles[v] = phase_angles(phases[v]);
    c.pins[v] = static_cast<std::uint8_t>(frames[v].pins);
  }
  connect(mesh, c);
  for (TileEdge& e : c.edges) {
    e.transport = edge_transport(edge_gauge(frames[e.lo], frames[e.hi], omega), c.angles[e.lo],
                                 c.angles[e.hi]);
  }
  return c;
}

SingularityCounts& SingularityCounts::operator+=(const SingularityCounts& o) {
  vertices += o.vertices;
  edges += o.edges;
  field_triangles += o.field_triangles;
  phase_triangles += o.phase_triangles;
  negative_triangles += o.negative_triangles;
  return *this;
}

namespace {

/// The one-rings of vertices with several open triangles: product of the transports around each.
/// `found`: told each that is open.
template <class Found>
std::uint64_t count_open_rings(const TileMesh& mesh, const TileCoordinates& c,
                               const std::vector<std::uint8_t>& open_triangles,
                               const Found& found) {
  struct RingSide {
    std::uint32_t vertex;
    std::uint32_t from;
    std::uint32_t to;
    std::uint32_t side;
  };
  std::vector<RingSide> sides;
  const std::span<const LocalTriangle> triangles = mesh.triangles.span();
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t v = triangles[i][k];
      if (v < mesh.extent.owned && open_triangles[v] >= 2) {
        sides.push_back(
            {v, triangles[i][(k + 1) % 3], triangles[i][(k + 2) % 3], 3 * i + (k + 1) % 3});
      }
    }
  }
  std::sort(sides.begin(), sides.end(), [](const RingSide& a, const RingSide& b) {
    return std::tie(a.vertex, a.from) < std::tie(b.vertex, b.from);
  });
  std::uint64_t open = 0;
  for (std::size_t first = 0; first < sides.size();) {
    std::size_t last = first;
    while (last < sides.size() && sides[last].vertex == sides[first].vertex) {
      ++last;
    }
    EdgeTransport product;
    std::size_t at = first;
    for (std::size_t step = first; step < last; ++step) {
      product = compose(product, c.side_transport(sides[at].side));
      at = static_cast<std::size_t>(
          std::lower_bound(sides.begin() + static_cast<std::ptrdiff_t>(first),
                           sides.begin() + static_cast<std::ptrdiff_t>(last), sides[at].to,
                           [](const RingSide& s, std::uint32_t v) { return s.from < v; }) -
          sides.begin());
      ensure(at < last, "the one-ring of an interior vertex is a cycle");
    }
    if (!(product == EdgeTransport{})) {
      ++open;
      found(sides[first].vertex);
    }
    first = last;
  }
  return open;
}

}  // namespace

SingularityCounts count_singularities(const TileMesh& mesh, const TileCoordinates& c,
                                      TileSingularities* where) {
  const std::span<const LocalTriangle> triangles = mesh.triangles.span();
  const std::uint32_t owned = mesh.extent.owned;
  SingularityCounts counts;
  if (where != nullptr) {
    where->triangles.assign(mesh.counts.owned, TriangleKind::kRegular);
    where->vertices.assign(owned, 0);
    where->edges_at_vertex.assign(owned, 0);
    where->edges.clear();
  }
  const auto mark = [&](std::uint32_t triangle, TriangleKind kind) {
    if (where != nullptr) {
      where->triangles[triangle] = kind;
    }
  };
  // Open triangles around each owned vertex, saturating; boundary vertices have no ring.
  std::vector<std::uint8_t> open_around(owned, 0);
  std::vector<std::uint8_t> on_boundary(owned, 0);
  std::vector<std::uint8_t> open(triangles.size(), 0);
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    const EdgeTransport h = c.holonomy(i);
    open[i] = h == EdgeTransport{} ? 0 : 1;
    if (open[i] != 0) {
      for (const std::uint32_t v : triangles[i]) {
        if (v < owned && open_around[v] < 2) {
          ++open_around[v];
        }
      }
    }
    if (i >= mesh.counts.owned) {
      continue;
    }
    if (open[i] != 0) {
      ++(h.r != 0 ? counts.field_triangles : counts.phase_triangles);
      mark(i, h.r != 0 ? TriangleKind::kField : TriangleKind::kPhase);
      continue;
    }
    const PhaseAngles origin = c.angles[triangles[i][0]];
    const auto from_origin = [&](const EdgeTransport& t, std::uint32_t v) {
      PhaseAngles a = c.angles[v];
      quarter_turns(t.r, a.theta, a.phi);
      return PhaseAngles{a.theta + kTurn * t.s - origin.theta, a.phi + kTurn * t.t - origin.phi};
    };
    const PhaseAngles p = from_origin(c.side_transport(3 * i), triangles[i][1]);
    const PhaseAngles q = from_origin(inverse(c.side_transport(3 * i + 2)), triangles[i][2]);
    if (p.theta * q.phi - p.phi * q.theta < 0.0) {
      ++counts.negative_triangles;
      mark(i, TriangleKind::kNegative);
    }
  }

  // Coordinates spread from a triangle's first corner, so only the edge opposite to it can disagree
  // with the edge's own transport, and does if the triangle is open.
  const auto derived = [&](std::uint32_t side) {
    const EdgeTransport own = c.side_transport(side);
    if (side % 3 != 1 || open[side / 3] == 0) {
      return own;
    }
    return compose(inverse(c.side_transport(side - 1)), inverse(c.side_transport(side + 1)));
  };
  for (std::uint32_t i = 0; i < c.edges.size(); ++i) {
    const TileEdge& e = c.edges[i];
    if (e.left == kNoSide || e.right == kNoSide) {
      for (const std::uint32_t v : {e.lo, e.hi}) {
        if (v < owned) {
          on_boundary[v] = 1;
        }
      }
    } else if (e.lo < owned || (where != nullptr && e.hi < owned)) {
      const std::uint32_t l = e.left;
      const std::uint32_t r = e.right;
      if ((open[l / 3] | open[r / 3]) != 0 && !(derived(l) == inverse(derived(r)))) {
        counts.edges += e.lo < owned ? 1 : 0;
        if (where != nullptr && e.lo < owned) {
          where->edges.push_back(i);
        }
        for (const std::uint32_t v : {e.lo, e.hi}) {
          if (where != nullptr && v < owned) {
            ++where->edges_at_vertex[v];
          }
        }
      }
    }
  }
  bool several = false;
  for (std::uint32_t v = 0; v < owned; ++v) {
    if (on_boundary[v] != 0) {
      open_around[v] = 0;
    }
    if (open_around[v] == 1) {
      ++counts.vertices;
      if (where != nullptr) {
        where->vertices[v] = 1;
      }
    }
    several = several || open_around[v] >= 2;
  }
  if (several) {
    counts.vertices += count_open_rings(mesh, c, open_around, [&](std::uint32_t v) {
      if (where != nullptr) {
        where->vertices[v] = 1;
      }
    });
  }
  return counts;
}

}  // namespace rattan
