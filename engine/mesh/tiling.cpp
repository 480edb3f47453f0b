// SPDX-License-Identifier: MIT
#include "engine/mesh/tiling.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include <Eigen/Geometry>

#include "engine/core/errors.h"
#include "engine/mesh/tile_mesh.h"

namespace rattan {

namespace {

class TileBuilder {
 public:
  TileBuilder(const TileInput& input, const TileLayout& layout, const BorderTable& border,
              std::uint64_t block_size)
      : in_(input),
        layout_(layout),
        border_(border),
        block_size_(block_size),
        extent_(layout.tiles[input.tile]),
        owned_(extent_.owned) {}

  TileArrays run() {
    find_halo();
    renumber();
    flip();
    order_triangles();
    gather(in_.ranked_positions, border_.position, out_.positions);
    gather(in_.ranked_colours, border_.colour, out_.colours);
    measure();
    trace_boundary();
    return std::move(out_);
  }

 private:
  using SlotIterator = std::vector<std::uint32_t>::const_iterator;

  /// Slots of a foreign vertex before repair; several if it was split.
  std::pair<std::uint32_t, std::uint32_t> slots_of(std::uint64_t rank) const {
    const TileExtent& e = layout_.tiles[rank / block_size_];
    const auto local = static_cast<std::uint32_t>(rank % block_size_);
    const SlotIterator first = border_.rank.begin() + static_cast<std::ptrdiff_t>(e.border_first);
    const auto [begin, end] = std::equal_range(first, first + e.border, local);
    ensure(begin != end, "a vertex used by another tile is on its own tile's border");
    return {static_cast<std::uint32_t>(begin - border_.rank.begin()),
            static_cast<std::uint32_t>(end - border_.rank.begin())};
  }

  std::uint64_t id_of_slot(std::uint32_t slot) const {
    const auto after =
        std::upper_bound(layout_.tiles.begin(), layout_.tiles.end(), std::uint64_t{slot},
                         [](std::uint64_t s, const TileExtent& e) { return s < e.border_first; });
    return (after - 1)->first + border_.vertex[slot];
  }

  /// Per foreign vertex its slot, or for a split one the first of several.
  void find_halo() {
    first_slot_.reserve(in_.foreign.size());
    bool split = false;
    for (const std::uint64_t rank : in_.foreign) {
      const auto [begin, end] = slots_of(rank);
      first_slot_.push_back(begin);
      split = split || end - begin > 1;
    }
    std::vector<std::uint32_t>& slots = out_.halo_slots;
    if (!split) {
      slots = first_slot_;
    } else {
      corner_slot_.resize(in_.triangles.size());
      for (std::size_t t = 0; t < in_.triangles.size(); ++t) {
        for (int c = 0; c < 3; ++c) {
          if (in_.triangles[t][c] >= kForeignCorner) {
            corner_slot_[t][c] = slot_of_corner(t, c);
            slots.push_back(corner_slot_[t][c]);
          }
        }
      }
      std::sort(slots.begin(), slots.end());
      slots.erase(std::unique(slots.begin(), slots.end()), slots.end());
    }
    out_.halo_ids.reserve(slots.size());
    for (const std::uint32_t slot : slots) {
      out_.halo_ids.push_back(id_of_slot(slot));
    }
  }

  std::uint64_t rank_of_corner(std::uint32_t corner) const {
    if (corner >= kForeignCorner) {
      return in_.foreign[corner - kForeignCorner];
    }
    return in_.tile * block_size_ + (in_.source.empty() ? corner : in_.source[corner]);
  }

  std::uint32_t slot_of_corner(std::size_t t, int c) const {
    const std::uint32_t foreign = in_.triangles[t][c] - kForeignCorner;
    const std::uint64_t rank = in_.foreign[foreign];
    const auto [begin, end] = slots_of(rank);
    if (end - begin == 1) {
      return begin;
    }
    const std::uint64_t p = rank_of_corner(in_.triangles[t][(c + 1) % 3]);
    const std::uint64_t q = rank_of_corner(in_.triangles[t][(c + 2) % 3]);
    const auto key = std::tuple(rank, std::min(p, q), std::max(p, q));
    const auto at = std::lower_bound(
        border_.split.begin(), border_.split.end(), key,
        [](const SplitCorner& s, const auto& k) { return std::tie(s.rank, s.low, s.high) < k; });
    ensure(at != border_.split.end() && std::tuple(at->rank, at->low, at->high) == key,
           "every corner at a split border vertex has its copy");
    return static_cast<std::uint32_t>(at->copy);
  }

  void renumber() {
    out_.triangles.assign(in_.triangles.begin(), in_.triangles.end());
    const auto& slots = out_.halo_slots;
    for (std::size_t t = 0; t < out_.triangles.size(); ++t) {
      for (int c = 0; c < 3; ++c) {
        std::uint32_t& v = out_.triangles[t][c];
        if (v < kForeignCorner) {
          continue;
        }
        if (corner_slot_.empty()) {
          v = owned_ + (v - kForeignCorner);
        } else {
          const auto at = std::lower_bound(slots.begin(), slots.end(), corner_slot_[t][c]);
          v = owned_ + static_cast<std::uint32_t>(at - slots.begin());
        }
      }
    }
  }

  void flip() {
    const std::size_t others = in_.triangles.size() - in_.home;
    if (in_.fates.empty() || (in_.patch_of.empty() && !in_.fates[0].flip)) {
      return;
    }
    for (std::size_t t = 0; t < out_.triangles.size(); ++t) {
      const std::uint32_t p = in_.patch_of.empty() ? 0 : in_.patch_of[t];
      if (p != kSettledPatch && in_.fates[p >> 1].flip != ((p & 1U) == 1)) {
        std::swap(out_.triangles[t][1], out_.triangles[t][2]);
        out_.flipped_triangles += t >= others ? 1 : 0;
      }
    }
  }

  void order_triangles() {
    auto& triangles = out_.triangles;
    const auto others = static_cast<std::ptrdiff_t>(triangles.size() - in_.home);
    // Local numbers in global order: the halo before the tile, the tile, the halo behind it.
    const auto before = static_cast<std::uint32_t>(
        std::lower_bound(out_.halo_ids.begin(), out_.halo_ids.end(), extent_.first) -
        out_.halo_ids.begin());
    const auto order = [&](std::uint32_t v) {
      if (v < owned_) {
        return before + v;
      }
      return v - owned_ < before ? v - owned_ : v;
    };
    const auto ordered = [&](const LocalTriangle& t) {
      return LocalTriangle{order(t[0]), order(t[1]), order(t[2])};
    };
    std::sort(
        triangles.begin(), triangles.begin() + others,
        [&](const LocalTriangle& s, const LocalTriangle& t) { return ordered(s) < ordered(t); });
    std::rotate(triangles.begin(), triangles.begin() + others, triangles.end());
    // Owned triangles come sorted by their lowest corner unless that was split; their other corners
    // are owned or behind the tile, so local numbers are in global order.
    const auto end = triangles.begin() + in_.home;
    const auto by_lowest = [](const LocalTriangle& s, const LocalTriangle& t) {
      return s[0] < t[0];
    };
    if (!std::is_sorted(triangles.begin(), end, by_lowest)) {
      std::sort(triangles.begin(), end);
      return;
    }
    for (auto group = triangles.begin(); group != end;) {
      auto group_end = group + 1;
      while (group_end != end && (*group_end)[0] == (*group)[0]) {
        ++group_end;
      }
      std::sort(group, group_end);
      group = group_end;
    }
  }

  template <class T>
  void gather(std::span<const T> ranked, const std::vector<T>& border, std::vector<T>& out) const {
    if (ranked.empty()) {
      return;
    }
    out.reserve(owned_ + out_.halo_slots.size());
    for (std::uint32_t v = 0; v < owned_; ++v) {
      out.push_back(ranked[in_.source.empty() ? v : in_.source[v]]);
    }
    for (const std::uint32_t slot : out_.halo_slots) {
      out.push_back(border[slot]);
    }
  }

  void measure() {
    for (std::uint32_t t = 0; t < in_.home; ++t) {
      const LocalTriangle& c = out_.triangles[t];
      const Vec3d a = out_.positions[c[0]].cast<double>();
      const Vec3d ab = out_.positions[c[1]].cast<double>() - a;
      const Vec3d ac = out_.positions[c[2]].cast<double>() - a;
      out_.area += 0.5 * ab.cross(ac).norm();
      out_.side_length += ab.norm() + ac.norm() + (ac - ab).norm();
    }
    if (owned_ > 0) {
      out_.box_min = out_.box_max = out_.positions[0];
      for (std::uint32_t v = 1; v < owned_; ++v) {
        out_.box_min = out_.box_min.cwiseMin(out_.positions[v]);
        out_.box_max = out_.box_max.cwiseMax(out_.positions[v]);
      }
    }
  }

  /// Around a vertex with one oriented fan every neighbour follows it in one triangle and precedes
  /// it in another, but for the two on the boundary: `first` follows only, `last` precedes only.
  /// Sums of neighbours and of their squares (modulo 2^64; the differences are below 2^62) give
  /// both.
  void trace_boundary() {
    std::vector<std::uint64_t> sum(owned_, 0);
    std::vector<std::uint64_t> squares(owned_, 0);
    for (const LocalTriangle& t : out_.triangles) {
      for (int c = 0; c < 3; ++c) {
        if (t[c] < owned_) {
          const std::uint64_t x = t[(c + 1) % 3];
          const std::uint64_t y = t[(c + 2) % 3];
          sum[t[c]] += x - y;
          squares[t[c]] += x * x - y * y;
        }
      }
    }
    out_.flags.assign(owned_, 0);
    ParityUnionFind loops(0);
    std::vector<std::uint32_t> number(owned_, 0);
    std::vector<std::uint32_t> members;
    for (std::uint32_t v = 0; v < owned_; ++v) {
      if (sum[v] != 0) {
        out_.flags[v] = kOnBoundary;
        number[v] = static_cast<std::uint32_t>(members.size());
        members.push_back(v);
      }
    }
    out_.boundary_edges = members.size();
    loops.reset(static_cast<std::uint32_t>(members.size()));
    std::vector<std::pair<std::uint32_t, std::uint32_t>> crossings;  // member, halo vertex
    for (std::uint32_t m = 0; m < members.size(); ++m) {
      const auto difference = static_cast<std::int64_t>(sum[members[m]]);
      const auto total = static_cast<std::int64_t>(squares[members[m]]) / difference;
      for (const std::int64_t neighbour : {(total + difference) / 2, (total - difference) / 2}) {
        const auto w = static_cast<std::uint32_t>(neighbour);
        if (w >= owned_) {
          crossings.emplace_back(m, w);
        } else {
          loops.unite(m, number[w], 0);
        }
      }
    }
    std::vector<std::uint8_t> open(members.size(), 0);
    for (const auto& [m, w] : crossings) {
      const std::uint32_t root = loops.find(m).first;
      const std::uint64_t piece = extent_.first + members[root];
      open[root] = 1;
      out_.open_loops.emplace_back(piece, extent_.first + members[m]);
      out_.open_loops.emplace_back(piece, out_.halo_ids[w - owned_]);
    }
    for (std::uint32_t m = 0; m < members.size(); ++m) {
      out_.closed_loops += loops.find(m).first == m && open[m] == 0 ? 1 : 0;
    }
  }

  const TileInput& in_;
  const TileLayout& layout_;
  const BorderTable& border_;
  std::uint64_t block_size_;
  const TileExtent& extent_;
  std::uint32_t owned_;
  std::vector<std::uint32_t> first_slot_;
  std::vector<std::array<std::uint32_t, 3>>
      corner_slot_;  ///< only where a foreign vertex was split
  TileArrays out_;
};

}  // namespace

TileArrays build_tile(const TileInput& input, const TileLayout& layout, const BorderTable& border,
                      std::uint64_t block_size) {
  return TileBuilder(input, layout, border, block_size).run();
}

std::uint64_t count_open_loops(const std::vector<std::pair<std::uint64_t, std::uint64_t>>& pieces) {
  std::vector<std::uint64_t> ids;
  ids.reserve(2 * pieces.size());
  for (const auto& [a, b] : pieces) {
    ids.push_back(a);
    ids.push_back(b);
  }
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  ParityUnionFind loops(static_cast<std::uint32_t>(ids.size()));
  const auto number = [&](std::uint64_t id) {
    return static_cast<std::uint32_t>(std::lower_bound(ids.begin(), ids.end(), id) - ids.begin());
  };
  std::uint64_t count = ids.size();
  for (const auto& [a, b] : pieces) {
    const std::uint32_t i = number(a);
    const std::uint32_t j = number(b);
    if (loops.find(i).first != loops.find(j).first) {
      loops.unite(i, j, 0);
      --count;
    }
  }
  return count;
}

}  // namespace rattan
