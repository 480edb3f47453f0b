// SPDX-License-Identifier: MIT
#pragma once

// Systems on abstract graphs: edges with a gauge each, tiled in the order of the nodes.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "engine/core/exact_math.h"
#include "engine/core/memory_store.h"
#include "engine/solve/block_ops.h"
#include "engine/solve/solver.h"

namespace rattan::test {

/// Coefficient C_ij of the half-edge i -> j; that of j -> i is its adjoint.
template <class Block>
struct Edge {
  std::uint32_t i = 0;
  std::uint32_t j = 0;
  float weight = 1.0F;
  Coefficient<Block> coefficient;
};

template <class Block>
struct TestSystem {
  MemoryStore store;
  TileLayout layout;
  HaloFields halo{{"t/halo_ids"}, {"t/halo_slots"}, {"t/border"}};
  SystemFields<Block> fields{{"t/row_begin"}, {"t/neighbor"}, {"t/coefficient"}, {"t/diagonal"},
                             {"t/fit"},       {"t/rhs"},      {"t/solution"}};
  GraphFields graph{{"t/row_begin"}, {"t/neighbor"}, {"t/weight"}};
  std::vector<Edge<Block>> edges;
  std::uint32_t nodes = 0;

  std::vector<Value<Block>> solution() {
    std::vector<Value<Block>> out;
    for (std::uint32_t t = 0; t < layout.tile_count(); ++t) {
      const auto v = read(store, fields.solution, TileId(t));
      out.insert(out.end(), v.begin(), v.end());
    }
    return out;
  }
  /// Writes the chunks and the board.
  void set_solution(const std::vector<Value<Block>>& x) {
    HaloBoard<Value<Block>> board(layout.border_count);
    for (std::uint32_t t = 0; t < layout.tile_count(); ++t) {
      const TileExtent& e = layout.tiles[t];
      const std::span<const Value<Block>> owned(x.data() + e.first, e.owned);
      write(store, fields.solution, TileId(t), owned);
      publish_border(owned, read(store, halo.border, TileId(t)).span(), e.border_first, board);
    }
    write(store, fields.solution, kBoardTile, board);
  }
  HaloBoard<Value<Block>> board() {
    const auto v = read(store, fields.solution, kBoardTile);
    return {v.begin(), v.end()};
  }
};

template <class Block>
void build(TestSystem<Block>& s, std::uint32_t nodes, std::vector<Edge<Block>> edges,
           std::uint32_t tile_size, const std::vector<float>& fit = {},
           const std::vector<Value<Block>>& rhs = {}) {
  using Ops = BlockOps<Block>;
  s.nodes = nodes;
  s.edges = std::move(edges);
  std::vector<std::vector<Edge<Block>>> rows(nodes);
  for (const Edge<Block>& e : s.edges) {
    rows[e.i].push_back(e);
    rows[e.j].push_back({e.j, e.i, e.weight, Ops::adjoint(e.coefficient)});
  }
  s.layout = {};
  s.layout.node_count = nodes;
  for (std::uint32_t first = 0; first < nodes; first += tile_size) {
    TileExtent e;
    e.first = first;
    e.owned = std::min(tile_size, nodes - first);
    s.layout.tiles.push_back(e);
  }
  std::vector<std::vector<std::uint64_t>> halo_ids(s.layout.tile_count());
  for (std::uint32_t i = 0; i < nodes; ++i) {
    for (const auto& e : rows[i]) {
      if (e.j / tile_size != i / tile_size) {
        halo_ids[i / tile_size].push_back(e.j);
      }
    }
  }
  for (auto& ids : halo_ids) {
    std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  }
  std::vector<std::vector<std::uint32_t>> border;
  std::vector<std::vector<std::uint32_t>> slots;
  connect_halos(s.layout, halo_ids, border, slots);
  for (std::uint32_t t = 0; t < s.layout.tile_count(); ++t) {
    const TileExtent& x = s.layout.tiles[t];
    const TileId id(t);
    std::vector<std::uint32_t> begin{0};
    std::vector<std::uint32_t> neighbor;
    std::vector<float> weight;
    std::vector<Coefficient<Block>> coefficient;
    std::vector<float> diagonal;
    std::vector<float> fits;
    std::vector<Value<Block>> rhss;
    for (std::uint64_t i = x.first; i < x.first + x.owned; ++i) {
      float sum = 0.0F;
      for (const auto& e : rows[i]) {
        if (e.j / tile_size == t) {
          neighbor.push_back(static_cast<std::uint32_t>(e.j - x.first));
        } else {
          const auto at = std::lower_bound(halo_ids[t].begin(), halo_ids[t].end(), e.j);
          neighbor.push_back(x.owned + static_cast<std::uint32_t>(at - halo_ids[t].begin()));
        }
        weight.push_back(std::max(e.weight, 0.0F));
        coefficient.push_back(e.coefficient);
        sum += e.weight;
      }
      begin.push_back(static_cast<std::uint32_t>(neighbor.size()));
      diagonal.push_back(sum);
      fits.push_back(fit.empty() ? 0.0F : fit[i]);
      rhss.push_back(rhs.empty() ? zero_value<Block>() : rhs[i]);
    }
    write(s.store, s.halo.halo_ids, id, halo_ids[t]);
    write(s.store, s.halo.halo_slots, id, slots[t]);
    write(s.store, s.halo.border, id, border[t]);
    write(s.store, s.fields.row_begin, id, begin);
    write(s.store, s.fields.neighbor, id, neighbor);
    write(s.store, s.graph.weight, id, weight);
    write(s.store, s.fields.coefficient, id, coefficient);
    write(s.store, s.fields.diagonal, id, diagonal);
    write(s.store, s.fields.fit, id, fits);
    write(s.store, s.fields.rhs, id, rhss);
  }
}

inline Complex polar(double radius, double angle) {
  const exact::SinCos a = exact::sincos(angle);
  return {static_cast<float>(radius * a.cos), static_cast<float>(radius * a.sin)};
}

/// C = w T for angles that suit the block (those it has no use for are ignored).
template <class Block>
Coefficient<Block> make_coefficient(float w, double delta, double delta_perp, std::uint32_t r) {
  if constexpr (std::is_same_v<Block, PairBlock>) {
    return {polar(w, -delta), polar(w, -delta_perp), r};
  } else if constexpr (std::is_same_v<Block, ComplexBlock>) {
    return {polar(w, -delta)};
  } else {
    return {w};
  }
}

/// Order of nodes of a width x height grid along a Z curve, so that tiles are patches.
inline std::vector<std::uint32_t> curve_order(std::uint32_t width, std::uint32_t height) {
  const auto spread = [](std::uint64_t v) {
    std::uint64_t out = 0;
    for (int b = 0; b < 16; ++b) {
      out |= ((v >> b) & 1U) << (2 * b);
    }
    return out;
  };
  std::vector<std::pair<std::uint64_t, std::uint32_t>> keys;
  for (std::uint32_t y = 0; y < height; ++y) {
    for (std::uint32_t x = 0; x < width; ++x) {
      keys.emplace_back(spread(x) | spread(y) << 1U, y * width + x);
    }
  }
  std::sort(keys.begin(), keys.end());
  std::vector<std::uint32_t> number(keys.size());
  for (std::uint32_t k = 0; k < keys.size(); ++k) {
    number[keys[k].second] = k;
  }
  return number;
}

struct GridEdge {
  std::uint32_t i, j;  ///< numbers of the nodes
  double dx, dy;       ///< from i to j
};

/// Triangulated grid (six neighbours); a torus if it wraps.
inline std::vector<GridEdge> grid_edges(std::uint32_t width, std::uint32_t height, bool wraps,
                                        const std::vector<std::uint32_t>& number) {
  std::vector<GridEdge> edges;
  for (std::uint32_t y = 0; y < height; ++y) {
    for (std::uint32_t x = 0; x < width; ++x) {
      const std::uint32_t right = x + 1;
      const std::uint32_t up = y + 1;
      const bool has_right = wraps || right < width;
      const bool has_up = wraps || up < height;
      const auto at = [&](std::uint32_t a, std::uint32_t b) {
        return number[(b % height) * width + a % width];
      };
      if (has_right) {
        edges.push_back({at(x, y), at(right, y), 1.0, 0.0});
      }
      if (has_up) {
        edges.push_back({at(x, y), at(x, up), 0.0, 1.0});
      }
      if (has_right && has_up) {
        edges.push_back({at(x, y), at(right, up), 1.0, 1.0});
      }
    }
  }
  return edges;
}

/// Quarter turns of the frames at random nodes, so that r = 0..3 all occur without any curvature.
inline std::vector<std::uint32_t> random_frames(std::uint32_t nodes, std::mt19937& random,
                                                bool turned) {
  std::vector<std::uint32_t> frames(nodes, 0);
  for (auto& f : frames) {
    f = turned ? static_cast<std::uint32_t>(random() % 4) : 0;
  }
  return frames;
}

/// The gauge change of a frame turned by `turns`: an isometry without angles.
template <class Block>
Coefficient<Block> frame_change(std::uint32_t turns) {
  Coefficient<Block> c = BlockOps<Block>::identity();
  if constexpr (std::is_same_v<Block, PairBlock>) {
    c.r = turns & 3U;
  }
  (void)turns;
  return c;
}

/// A grid whose phases advance by `step` radians per unit of x and y, plus angle noise per edge
/// (radians), seen in randomly turned frames.
template <class Block>
std::vector<Edge<Block>> phase_grid(std::uint32_t width, std::uint32_t height, bool wraps,
                                    double step_x, double step_y, double noise, std::uint32_t seed,
                                    std::vector<std::uint32_t>* frames_out = nullptr) {
  using Ops = BlockOps<Block>;
  std::mt19937 random(seed);
  const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
  const auto frames = random_frames(width * height, random, true);
  if (frames_out != nullptr) {
    *frames_out = frames;
  }
  std::vector<Edge<Block>> out;
  for (const GridEdge& g : grid_edges(width, height, wraps, curve_order(width, height))) {
    const auto w = static_cast<float>(0.2 + uniform());
    const double delta = step_x * g.dx + noise * (2.0 * uniform() - 1.0);
    const double delta_perp = step_y * g.dy + noise * (2.0 * uniform() - 1.0);
    Coefficient<Block> c = make_coefficient<Block>(w, delta, delta_perp, 0);
    c = Ops::compose(Ops::compose(frame_change<Block>(frames[g.i]), c),
                     Ops::adjoint(frame_change<Block>(frames[g.j])));
    out.push_back({g.i, g.j, w, c});
  }
  return out;
}

/// A grid with any transport on every edge: nothing closes up.
template <class Block>
std::vector<Edge<Block>> wild_grid(std::uint32_t width, std::uint32_t height, std::uint32_t seed) {
  std::mt19937 random(seed);
  const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
  std::vector<Edge<Block>> out;
  for (const GridEdge& g : grid_edges(width, height, false, curve_order(width, height))) {
    const auto w = static_cast<float>(0.2 + uniform());
    const double delta = 6.0 * uniform();
    const double delta_perp = 6.0 * uniform();
    out.push_back(
        {g.i, g.j, w,
         make_coefficient<Block>(w, delta, delta_perp, static_cast<std::uint32_t>(random() % 4))});
  }
  return out;
}

template <class Block>
std::vector<Value<Block>> random_values(std::uint32_t n, std::uint32_t seed, bool unit_norms) {
  std::mt19937 random(seed);
  std::vector<Value<Block>> x(n);
  for (auto& v : x) {
    for (std::size_t k = 0; k < BlockOps<Block>::kReals; ++k) {
      reals<Block>(v)[k] = static_cast<float>(static_cast<double>(random()) / 2147483648.0 - 1.0);
    }
    if (unit_norms) {
      normalise<Block>(v);
    }
  }
  return x;
}

/// The energy of system.h straight from the edges, in double.
template <class Block>
double edge_energy(const TestSystem<Block>& s, const std::vector<Value<Block>>& x,
                   double penalty = 0.0, const std::vector<float>& fit = {},
                   const std::vector<Value<Block>>& rhs = {}) {
  using Ops = BlockOps<Block>;
  double sum = 0.0;
  for (const Edge<Block>& e : s.edges) {
    // |x_i - T x_j|^2 w = w |x_i|^2 + w |x_j|^2 - 2 <x_i, C x_j>
    std::array<double, Ops::kReals> cx{};
    std::array<double, Ops::kReals> xj{};
    for (std::size_t k = 0; k < Ops::kReals; ++k) {
      xj[k] = reals<Block>(x[e.j])[k];
    }
    Ops::apply_add(e.coefficient, xj.data(), cx.data());
    for (std::size_t k = 0; k < Ops::kReals; ++k) {
      const double xi = reals<Block>(x[e.i])[k];
      sum += e.weight * (xi * xi + xj[k] * xj[k]) - 2.0 * xi * cx[k];
    }
  }
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!fit.empty()) {
      sum += fit[i] * dot<Block>(x[i], x[i]);
    }
    if (!rhs.empty()) {
      sum -= 2.0 * dot<Block>(rhs[i], x[i]);
    }
    for (std::size_t p = 0; Ops::kPeriodic && p < Ops::kParts; ++p) {
      const double re = reals<Block>(x[i])[2 * p];
      const double im = reals<Block>(x[i])[2 * p + 1];
      sum += penalty * (re * re + im * im - 1.0) * (re * re + im * im - 1.0);
    }
  }
  return sum;
}

}  // namespace rattan::test
