// SPDX-License-Identifier: MIT
#include "engine/mesh/vertex_graph.h"

#include <algorithm>
#include <cmath>
#include <utility>

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
      start = 0;
      for (std::size_t k = 1; k < n; ++k) {
        if (mesh_.global_id(wedges[k].from) < mesh_.global_id(wedges[start].from)) {
          start = k;
        }
      }
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

// half_cotangent() at two apexes side by side, to the same bits.
inline Eigen::Array2d half_cotangents(const Vec3f& s, const Vec3f& t, const Vec3d& p,
                                      const Vec3d& q) {
  using Pair = Eigen::Array2d;
  const auto pair = [&](int c) {
    return Pair(static_cast<double>(s[c]), static_cast<double>(t[c]));
  };
  const Pair ux = p.x() - pair(0);
  const Pair uy = p.y() - pair(1);
  const Pair uz = p.z() - pair(2);
  const Pair vx = q.x() - pair(0);
  const Pair vy = q.y() - pair(1);
  const Pair vz = q.z() - pair(2);
  const Pair cx = uy * vz - uz * vy;
  const Pair cy = uz * vx - ux * vz;
  const Pair cz = ux * vy - uy * vx;
  const Pair twice_area = (cx * cx + cy * cy + cz * cz).sqrt();
  const Pair squares = (ux * ux + uy * uy + uz * uz) + (vx * vx + vy * vy + vz * vz);
  const Pair floor_area = 1e-6 * squares + 1e-300;
  return 0.5 * (ux * vx + uy * vy + uz * vz) / twice_area.max(floor_area);
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
        std::uint32_t back = row[j];
        while (neighbor[back] != i) {
          ++back;
        }
        weight[k] = weight[back];
      } else {
        const Vec3d a = positions[j].cast<double>();
        const Vec3f& next = positions[neighbor[k + 1 < end ? k + 1 : begin]];
        const Vec3f& before = positions[neighbor[k > begin ? k - 1 : end - 1]];
        const Eigen::Array2d halves = half_cotangents(next, before, p, a);
        double w = 0.0;
        if (!open || k + 1 < end) {
          w += halves[0];
        }
        if (!open || k > begin) {
          w += halves[1];
        }
        weight[k] = static_cast<float>(std::clamp(w, kLowestWeight, kHighestWeight));
      }
      sum += static_cast<double>(weight[k]);
    }
    diagonal[i] = static_cast<float>(sum);
  }
}

}  // namespace rattan
