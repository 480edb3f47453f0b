// SPDX-License-Identifier: MIT
#include "engine/mesh/vertex_graph.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <emmintrin.h>
#include <utility>

#include "engine/mesh/equal_lanes.h"

namespace rattan {

namespace {

struct Wedge {
  std::uint32_t from;
  std::uint32_t to;
};

// Rows of more wedges than this are chained by binary search.
constexpr std::size_t kLongRow = 24;

// Puts the wedges of one vertex in order: each starts where the one before ended.
class FanChainer {
 public:
  explicit FanChainer(const TileMesh& mesh) : mesh_(mesh) {}

  // Appends the neighbours of the vertex.
  void chain(std::span<Wedge> wedges, std::vector<std::uint32_t>& neighbor) {
    if (wedges.size() <= kMostLanes) {
      chain_few(wedges, neighbor);
      return;
    }
    if (wedges.size() > kLongRow) {
      std::sort(wedges.begin(), wedges.end(),
                [](const Wedge& a, const Wedge& b) { return a.from < b.from; });
      sorted_ = true;
      ends_.resize(wedges.size());
      std::transform(wedges.begin(), wedges.end(), ends_.begin(),
                     [](const Wedge& w) { return w.to; });
      std::sort(ends_.begin(), ends_.end());
    } else {
      sorted_ = false;
    }
    const std::size_t n = wedges.size();
    std::size_t start = n;
    bool open = false;
    for (std::size_t k = 0; k < n && !open; ++k) {
      if (!is_end(wedges, wedges[k].from)) {
        start = k;
        open = true;
      }
    }
    if (!open) {
      start = lowest(wedges);
    }
    std::size_t at = start;
    for (std::size_t k = 0; k < n; ++k) {
      neighbor.push_back(wedges[at].from);
      const std::uint32_t end = wedges[at].to;
      if (k + 1 == n) {
        ensure(open || end == wedges[start].from, "the triangles of a vertex form one fan");
        if (open) {
          neighbor.push_back(end);
        }
      } else {
        at = find(wedges, end);
        ensure(at < n, "the triangles of a vertex form one fan");
      }
    }
  }

 private:
  void chain_few(std::span<const Wedge> wedges, std::vector<std::uint32_t>& neighbor) const {
    const auto n = static_cast<std::uint32_t>(wedges.size());
    Lanes from{};
    Lanes to{};
    for (std::uint32_t k = 0; k < n; ++k) {
      from[k] = wedges[k].from;
      to[k] = wedges[k].to;
    }
    Lanes next{};
    std::uint32_t ends = 0;
    for (std::uint32_t k = 0; k < n; ++k) {
      const std::uint32_t follows = equal_lanes(from, n, to[k]);
      next[k] = static_cast<std::uint32_t>(std::countr_zero(follows | 1U << kMostLanes));
      ends |= follows;
    }
    const std::uint32_t firsts = ~ends & ((1U << n) - 1U);
    const bool open = firsts != 0;
    const std::uint32_t start = open ? static_cast<std::uint32_t>(std::countr_zero(firsts))
                                     : static_cast<std::uint32_t>(lowest(wedges));
    std::uint32_t at = start;
    for (std::uint32_t k = 0; k < n; ++k) {
      ensure(at < n, "the triangles of a vertex form one fan");
      neighbor.push_back(from[at]);
      if (k + 1 == n) {
        ensure(open || to[at] == from[start], "the triangles of a vertex form one fan");
        if (open) {
          neighbor.push_back(to[at]);
        }
      }
      at = next[at];
    }
  }
  /// Which starts at the lowest global vertex.
  std::size_t lowest(std::span<const Wedge> wedges) const {
    std::size_t start = 0;
    for (std::size_t k = 1; k < wedges.size(); ++k) {
      if (mesh_.global_id(wedges[k].from) < mesh_.global_id(wedges[start].from)) {
        start = k;
      }
    }
    return start;
  }
  bool is_end(std::span<const Wedge> wedges, std::uint32_t v) const {
    if (sorted_) {
      return std::binary_search(ends_.begin(), ends_.end(), v);
    }
    bool found = false;
    for (const Wedge& w : wedges) {
      found |= w.to == v;
    }
    return found;
  }
  std::size_t find(std::span<const Wedge> wedges, std::uint32_t v) const {
    if (sorted_) {
      const auto at = std::lower_bound(wedges.begin(), wedges.end(), v,
                                       [](const Wedge& w, std::uint32_t x) { return w.from < x; });
      return at != wedges.end() && at->from == v ? static_cast<std::size_t>(at - wedges.begin())
                                                 : wedges.size();
    }
    std::size_t k = 0;
    while (k < wedges.size() && wedges[k].from != v) {
      ++k;
    }
    return k;
  }

  const TileMesh& mesh_;
  bool sorted_ = false;
  std::vector<std::uint32_t> ends_;
};

// A float of each of two points side by side.
inline __m128d both(float s, float t) {
  return _mm_cvtps_pd(_mm_unpacklo_ps(_mm_set_ss(s), _mm_set_ss(t)));
}

// half_cotangent() at two apexes side by side, to the same bits: that at `s` below, that at `t`
// above.
inline __m128d half_cotangents(const Vec3f& s, const Vec3f& t, const Vec3d& p, const Vec3d& q) {
  const __m128d x = both(s.x(), t.x());
  const __m128d y = both(s.y(), t.y());
  const __m128d z = both(s.z(), t.z());
  const __m128d ux = _mm_set1_pd(p.x()) - x;
  const __m128d uy = _mm_set1_pd(p.y()) - y;
  const __m128d uz = _mm_set1_pd(p.z()) - z;
  const __m128d vx = _mm_set1_pd(q.x()) - x;
  const __m128d vy = _mm_set1_pd(q.y()) - y;
  const __m128d vz = _mm_set1_pd(q.z()) - z;
  const __m128d cx = uy * vz - uz * vy;
  const __m128d cy = uz * vx - ux * vz;
  const __m128d cz = ux * vy - uy * vx;
  const __m128d twice_area = _mm_sqrt_pd(cx * cx + (cy * cy + cz * cz));
  const __m128d squares = (ux * ux + (uy * uy + uz * uz)) + (vx * vx + (vy * vy + vz * vz));
  const __m128d floor_area = _mm_set1_pd(1e-6) * squares + _mm_set1_pd(1e-300);
  return _mm_set1_pd(0.5) * (ux * vx + (uy * vy + uz * vz)) / _mm_max_pd(twice_area, floor_area);
}

}  // namespace

void FanView::load(Store& store, TileId tile) {
  row_begin = read(store, fields::kRowBegin, tile);
  neighbor = read(store, fields::kNeighbor, tile);
  flags = read(store, fields::kVertexFlag, tile);
}

VertexFans build_fans(const TileMesh& mesh) {
  const std::uint32_t owned = mesh.extent.owned;
  std::vector<std::uint32_t> wedge_begin(owned + 1, 0);
  for (const LocalTriangle& t : mesh.triangles) {
    for (const std::uint32_t v : t) {
      if (v < owned) {
        ++wedge_begin[v + 1];
      }
    }
  }
  for (std::uint32_t v = 0; v < owned; ++v) {
    wedge_begin[v + 1] += wedge_begin[v];
  }
  std::vector<Wedge> wedges(wedge_begin[owned]);
  std::vector<std::uint32_t> next(wedge_begin.begin(), wedge_begin.end() - 1);
  for (const LocalTriangle& t : mesh.triangles) {
    for (int c = 0; c < 3; ++c) {
      if (t[c] < owned) {
        wedges[next[t[c]]++] = {t[(c + 1) % 3], t[(c + 2) % 3]};
      }
    }
  }
  VertexFans fans;
  fans.row_begin.reserve(owned + 1);
  fans.neighbor.reserve(wedges.size() + wedges.size() / 16 + 16);
  fans.row_begin.push_back(0);
  FanChainer chainer(mesh);
  for (std::uint32_t v = 0; v < owned; ++v) {
    chainer.chain(std::span(wedges).subspan(wedge_begin[v], wedge_begin[v + 1] - wedge_begin[v]),
                  fans.neighbor);
    fans.row_begin.push_back(static_cast<std::uint32_t>(fans.neighbor.size()));
  }
  return fans;
}

void write_fans(Store& store, TileId tile, const VertexFans& fans) {
  write(store, fields::kRowBegin, tile, fans.row_begin);
  write(store, fields::kNeighbor, tile, fans.neighbor);
}

void build_vertex_graph(Store& store, const ScanMesh& mesh, TaskGraph& tasks) {
  struct State {
    TileMesh tile;
    VertexFans fans;
  };
  run_pass<State>(
      tasks, "graph", mesh.layout.tile_count(),
      [&](TileId t, State& s) { s.tile = load_tile(store, mesh, t); },
      [](TileId, State& s) { s.fans = build_fans(s.tile); },
      [&](TileId t, State& s) { write_fans(store, t, s.fans); });
}

void fan_weights(const FanView& fans, std::span<const Vec3f> positions, EdgeEnergy energy,
                 std::vector<float>& weight, std::vector<float>& diagonal) {
  const std::span<const std::uint32_t> row = fans.row_begin.span();
  const std::span<const std::uint32_t> neighbor = fans.neighbor.span();
  const std::uint32_t owned = fans.owned();
  weight.resize(neighbor.size());
  diagonal.resize(owned);
  for (std::uint32_t i = 0; i < owned; ++i) {
    const std::uint32_t begin = row[i];
    const std::uint32_t end = row[i + 1];
    const bool open = (fans.flags[i] & kOnBoundary) != 0;
    double sum = 0.0;
    if (energy == EdgeEnergy::kEdge) {
      for (std::uint32_t k = begin; k < end; ++k) {
        const bool rim = open && (k == begin || k + 1 == end);
        weight[k] = static_cast<float>(rim ? kUniformWeight : 2.0 * kUniformWeight);
        sum += static_cast<double>(weight[k]);
      }
      diagonal[i] = static_cast<float>(sum);
      continue;
    }
    const Vec3d p = positions[i].cast<double>();
    // The weight of an edge is half the cotangents of the angles at the neighbours before and
    // after. An edge to an owned vertex that comes earlier has been done from there.
    for (std::uint32_t k = begin; k < end; ++k) {
      const std::uint32_t j = neighbor[k];
      if (j < i) {
        weight[k] = weight[find_neighbor(neighbor, row[j], i)];
      } else {
        const Vec3d a = positions[j].cast<double>();
        const Vec3f& next = positions[neighbor[k + 1 < end ? k + 1 : begin]];
        const Vec3f& before = positions[neighbor[k > begin ? k - 1 : end - 1]];
        const __m128d halves = half_cotangents(next, before, p, a);
        double w = 0.0;
        if (!open || k + 1 < end) {
          w += _mm_cvtsd_f64(halves);
        }
        if (!open || k > begin) {
          w += _mm_cvtsd_f64(_mm_unpackhi_pd(halves, halves));
        }
        weight[k] = static_cast<float>(std::clamp(w, kLowestWeight, kHighestWeight));
      }
      sum += static_cast<double>(weight[k]);
    }
    diagonal[i] = static_cast<float>(sum);
  }
}

}  // namespace rattan
