// SPDX-License-Identifier: MIT
#include "engine/mesh/repair.h"

#include <algorithm>
#include <bit>
#include <tuple>
#include <utility>

#include "engine/core/errors.h"
#include "engine/mesh/equal_lanes.h"

namespace rattan {

namespace {

/// Ascending (lowest, second, highest) rank, then the given orientation: duplicates become
/// neighbours.
template <class Index>
bool set_less(const RankTriangle<Index>& s, const RankTriangle<Index>& t) {
  return std::tuple(s[0], std::min(s[1], s[2]), std::max(s[1], s[2]), s[1]) <
         std::tuple(t[0], std::min(t[1], t[2]), std::max(t[1], t[2]), t[1]);
}

template <class Index>
bool same_set(const RankTriangle<Index>& s, const RankTriangle<Index>& t) {
  return s[0] == t[0] && std::min(s[1], s[2]) == std::min(t[1], t[2]) &&
         std::max(s[1], s[2]) == std::max(t[1], t[2]);
}

/// Counting sort by the lowest corner, which lies in [first, first + owned), then within its few
/// triangles.
template <class Index>
void sort_home(std::vector<RankTriangle<Index>>& triangles, std::uint64_t first,
               std::uint32_t owned) {
  std::vector<std::uint32_t> start(owned + 1, 0);
  for (const auto& t : triangles) {
    ++start[static_cast<std::uint32_t>(t[0] - first) + 1];
  }
  for (std::uint32_t v = 0; v < owned; ++v) {
    start[v + 1] += start[v];
  }
  std::vector<RankTriangle<Index>> sorted(triangles.size());
  std::vector<std::uint32_t> next(start.begin(), start.end() - 1);
  for (const auto& t : triangles) {
    sorted[next[static_cast<std::uint32_t>(t[0] - first)]++] = t;
  }
  for (std::uint32_t v = 0; v < owned; ++v) {
    if (start[v + 1] - start[v] > 1) {
      std::sort(sorted.begin() + start[v], sorted.begin() + start[v + 1], set_less<Index>);
    }
  }
  triangles.swap(sorted);
}

/// Of each set of duplicates keeps one, oriented as most of them are. Returns how many it dropped.
template <class Index>
std::uint64_t drop_duplicates(std::vector<RankTriangle<Index>>& sorted) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < sorted.size();) {
    std::size_t end = i + 1;
    while (end < sorted.size() && same_set(sorted[i], sorted[end])) {
      ++end;
    }
    // Within a set the orientation with the lower second corner comes first; the middle one is of
    // the majority, and of the first kind on a tie.
    sorted[kept++] = sorted[i + (end - i - 1) / 2];
    i = end;
  }
  const std::uint64_t dropped = sorted.size() - kept;
  sorted.resize(kept);
  return dropped;
}

/// One triangle at a vertex: the corners that follow and precede it.
struct Spoke {
  std::uint32_t neighbour;
  std::uint32_t side;      ///< 0: the edge leaves the vertex in its triangle, 1: it arrives
  std::uint32_t position;  ///< of the triangle in the star
  friend auto operator<=>(const Spoke&, const Spoke&) = default;
};

template <class Index>
class BlockRepairer {
 public:
  explicit BlockRepairer(RepairInput<Index> input)
      : input_(std::move(input)), first_(input_.block * input_.block_size), owned_(input_.owned) {}

  BlockRepair run() {
    collect_triangles();
    number_corners();
    build_stars();
    connect_stars();
    find_patches();
    split_vertices();
    write_triangles();
    list_border();
    settle_orientation();
    return std::move(out_);
  }

 private:
  void collect_triangles() {
    sort_home(input_.home, first_, owned_);
    std::sort(input_.others.begin(), input_.others.end(), set_less<Index>);
    out_.duplicate_triangles = drop_duplicates(input_.home);
    drop_duplicates(input_.others);
    others_ = static_cast<std::uint32_t>(input_.others.size());
    out_.home = static_cast<std::uint32_t>(input_.home.size());
    // The others' lowest vertices are of earlier blocks, so this is the global order.
    count_ = others_ + out_.home;
  }

  const RankTriangle<Index>& ranks(std::uint32_t t) const {
    return t < others_ ? input_.others[t] : input_.home[t - others_];
  }
  bool is_owned(std::uint64_t rank) const { return rank - first_ < owned_; }
  std::uint64_t rank_of(std::uint32_t local) const {
    return local < owned_ ? first_ + local : out_.foreign[local - owned_];
  }

  /// Local numbers: owned by rank, then foreign.
  void number_corners() {
    std::vector<std::uint64_t>& foreign = out_.foreign;
    for (std::uint32_t t = 0; t < count_; ++t) {
      for (const Index r : ranks(t)) {
        if (!is_owned(r)) {
          foreign.push_back(r);
        }
      }
    }
    std::sort(foreign.begin(), foreign.end());
    foreign.erase(std::unique(foreign.begin(), foreign.end()), foreign.end());
    ensure(owned_ + foreign.size() < kForeignCorner, "a tile holds fewer than 2^31 vertices");
    corners_.resize(count_);
    leaves_.assign(count_, 0);
    for (std::uint32_t t = 0; t < count_; ++t) {
      for (int c = 0; c < 3; ++c) {
        const std::uint64_t r = ranks(t)[c];
        if (is_owned(r)) {
          corners_[t][c] = static_cast<std::uint32_t>(r - first_);
        } else {
          const auto at = std::lower_bound(foreign.begin(), foreign.end(), r) - foreign.begin();
          corners_[t][c] = owned_ + static_cast<std::uint32_t>(at);
          leaves_[t] = 1;
        }
      }
    }
  }

  void build_stars() {
    star_start_.assign(owned_ + 1, 0);
    for (const LocalTriangle& t : corners_) {
      for (const std::uint32_t v : t) {
        if (v < owned_) {
          ++star_start_[v + 1];
        }
      }
    }
    for (std::uint32_t v = 0; v < owned_; ++v) {
      star_start_[v + 1] += star_start_[v];
    }
    star_.resize(star_start_[owned_]);
    std::vector<std::uint32_t> next(star_start_.begin(), star_start_.end() - 1);
    for (std::uint32_t t = 0; t < count_; ++t) {
      for (const std::uint32_t v : corners_[t]) {
        if (v < owned_) {
          star_[next[v]++] = t;
        }
      }
    }
  }

  std::span<const std::uint32_t> star(std::uint32_t v) const {
    return std::span<const std::uint32_t>(star_).subspan(star_start_[v],
                                                         star_start_[v + 1] - star_start_[v]);
  }
  /// The corners after and before v in triangle t.
  std::pair<std::uint32_t, std::uint32_t> wings(std::uint32_t t, std::uint32_t v) const {
    const LocalTriangle& c = corners_[t];
    if (c[0] == v) {
      return {c[1], c[2]};
    }
    return c[1] == v ? std::pair(c[2], c[0]) : std::pair(c[0], c[1]);
  }

  void unite(std::uint32_t s, std::uint32_t t, std::uint32_t parity) {
    if (!sets_.unite(s, t, parity)) {
      conflicts_.push_back(s);
    }
  }

  /// First look at every star: connects triangles across edges; keeps the stars that are not a
  /// single oriented fan for the second look.
  void connect_stars() {
    sets_.reset(count_);
    for (std::uint32_t v = 0; v < owned_; ++v) {
      if (star(v).empty()) {
        ++out_.isolated_vertices;
      } else if (!connect_plain_fan(v)) {
        special_.push_back(v);
      }
    }
    for (const std::uint32_t v : special_) {
      connect_special(v, false);
    }
  }

  /// False, with nothing lost, if the star is not one consistently oriented fan of at most 16.
  bool connect_plain_fan(std::uint32_t v) {
    const auto triangles = star(v);
    const auto k = static_cast<std::uint32_t>(triangles.size());
    if (k > kMostLanes) {
      return false;
    }
    Lanes leaving{};
    Lanes arriving{};
    for (std::uint32_t i = 0; i < k; ++i) {
      std::tie(leaving[i], arriving[i]) = wings(triangles[i], v);
    }
    Lanes next{};
    std::uint32_t has_previous = 0;
    std::uint32_t twice = 0;
    for (std::uint32_t i = 0; i < k; ++i) {
      const std::uint32_t follows = equal_lanes(leaving, k, arriving[i]);
      next[i] = follows != 0 ? static_cast<std::uint32_t>(std::countr_zero(follows)) : kMostLanes;
      has_previous |= follows;
      twice |=
          (equal_lanes(leaving, k, leaving[i]) | equal_lanes(arriving, k, arriving[i])) ^ (1U << i);
    }
    if (twice != 0) {
      return false;
    }
    // The first triangle of an open fan, any of a closed one.
    const std::uint32_t firsts = ~has_previous & ((1U << k) - 1U);
    const std::uint32_t start =
        firsts != 0 ? static_cast<std::uint32_t>(std::bit_width(firsts)) - 1U : 0U;
    std::uint32_t seen = 1;
    for (std::uint32_t i = next[start]; i != kMostLanes && i != start; i = next[i]) {
      ++seen;
    }
    if (seen != k) {
      return false;
    }
    for (std::uint32_t i = 0; i < k; ++i) {
      if (next[i] != kMostLanes) {
        unite(triangles[i], triangles[next[i]], 0);
      }
    }
    return true;
  }

  /// f(spokes of one edge) for every edge at v.
  template <class F>
  void for_each_edge(std::uint32_t v, const F& f) {
    const auto triangles = star(v);
    spokes_.clear();
    for (std::uint32_t i = 0; i < triangles.size(); ++i) {
      const auto [leaving, arriving] = wings(triangles[i], v);
      spokes_.push_back({leaving, 0, i});
      spokes_.push_back({arriving, 1, i});
    }
    std::sort(spokes_.begin(), spokes_.end());
    for (std::size_t i = 0; i < spokes_.size();) {
      std::size_t end = i + 1;
      while (end < spokes_.size() && spokes_[end].neighbour == spokes_[i].neighbour) {
        ++end;
      }
      f(std::span<const Spoke>(spokes_).subspan(i, end - i));
      i = end;
    }
  }

  /// An edge is whole if it has two triangles that agree or can be made to.
  bool is_whole(std::span<const std::uint32_t> triangles, std::span<const Spoke> edge) const {
    return edge.size() == 2 && (edge[0].side != edge[1].side || one_sided_.empty() ||
                                one_sided_[triangles[edge[0].position]] == 0);
  }

  void connect_special(std::uint32_t v, bool cut) {
    const auto triangles = star(v);
    for_each_edge(v, [&](std::span<const Spoke> edge) {
      if (edge.size() == 2 && (!cut || is_whole(triangles, edge))) {
        unite(triangles[edge[0].position], triangles[edge[1].position],
              edge[0].side == edge[1].side ? 1 : 0);
      }
    });
  }

  /// Border patches get numbers in the order of their first triangle.
  void number_patches() {
    patch_.assign(count_, kSettledPatch);
    for (std::uint32_t t = 0; t < count_; ++t) {
      if (leaves_[t] != 0) {
        patch_[sets_.find(t).first] = 0;
      }
    }
    std::uint32_t patches = 0;
    for (std::uint32_t t = 0; t < count_; ++t) {
      if (patch_[t] == 0 && sets_.find(t).first == t) {
        patch_[t] = patches++;
      }
    }
    out_.patches.assign(patches, {});
  }

  void find_patches() {
    number_patches();
    // Components that cannot be oriented keep the orientation they have and are cut where it
    // changes.
    std::vector<std::uint8_t> bad(count_, 0);
    bool any = false;
    for (const std::uint32_t t : conflicts_) {
      const std::uint32_t root = sets_.find(t).first;
      if (patch_[root] == kSettledPatch) {
        out_.one_sided_components += bad[root] == 0 ? 1 : 0;
        bad[root] = 1;
        any = true;
      } else {
        out_.patches[patch_[root]].conflict = true;
      }
    }
    if (!input_.fates.empty()) {
      ensure(input_.fates.size() == out_.patches.size(),
             "both rounds of repair see the same patches");
      for (std::uint32_t t = 0; t < count_; ++t) {
        if (sets_.find(t).first == t && patch_[t] != kSettledPatch &&
            input_.fates[patch_[t]].one_sided) {
          bad[t] = 1;
          any = true;
        }
      }
    }
    if (!any) {
      return;
    }
    std::vector<std::uint8_t> marks(count_);
    for (std::uint32_t t = 0; t < count_; ++t) {
      marks[t] = bad[sets_.find(t).first];
    }
    one_sided_ = std::move(marks);
    conflicts_.clear();
    sets_.reset(count_);
    std::size_t next_special = 0;
    for (std::uint32_t v = 0; v < owned_; ++v) {
      if (next_special < special_.size() && special_[next_special] == v) {
        ++next_special;
        connect_special(v, true);
      } else if (!star(v).empty()) {
        connect_plain_fan(v);
      }
    }
    number_patches();
    for (const std::uint32_t t : conflicts_) {
      const std::uint32_t patch = patch_[sets_.find(t).first];
      ensure(patch != kSettledPatch, "a patch inside a block is one-sided once only");
      out_.patches[patch].conflict = true;
    }
  }

  /// copies_[v]; the class of each corner of a special star in class_.
  void split_vertices() {
    copies_.assign(owned_, 1);
    for (std::uint32_t v = 0; v < owned_; ++v) {
      if (star_start_[v + 1] == star_start_[v]) {
        copies_[v] = 0;
      }
    }
    ParityUnionFind fans;
    std::vector<std::uint32_t> number;
    for (const std::uint32_t v : special_) {
      const auto triangles = star(v);
      const auto k = static_cast<std::uint32_t>(triangles.size());
      fans.reset(k);
      for_each_edge(v, [&](std::span<const Spoke> edge) {
        if (is_whole(triangles, edge)) {
          fans.unite(edge[0].position, edge[1].position, 0);
        } else if (edge.size() > 1 && rank_of(edge[0].neighbour) > rank_of(v)) {
          ++out_.non_manifold_edges;
        }
      });
      class_start_.push_back(static_cast<std::uint32_t>(class_.size()));
      number.assign(k, 0);
      std::uint32_t classes = 0;
      for (std::uint32_t i = 0; i < k; ++i) {
        const std::uint32_t root = fans.find(i).first;
        if (root == i) {
          number[i] = classes++;
        }
        class_.push_back(number[root]);
      }
      copies_[v] = classes;
      out_.split_vertices += classes - 1;
    }
  }

  void write_triangles() {
    // `at[v]`: first copy of v.
    std::vector<std::uint32_t> at(owned_);
    std::uint64_t next = 0;
    bool identity = true;
    for (std::uint32_t v = 0; v < owned_; ++v) {
      at[v] = static_cast<std::uint32_t>(next);
      next += copies_[v];
      identity = identity && copies_[v] == 1;
    }
    ensure(next + out_.foreign.size() < kForeignCorner, "a tile holds fewer than 2^31 vertices");
    out_.vertices = static_cast<std::uint32_t>(next);
    if (!identity) {
      out_.source.reserve(out_.vertices);
      for (std::uint32_t v = 0; v < owned_; ++v) {
        out_.source.insert(out_.source.end(), copies_[v], v);
      }
    }
    out_.triangles.resize(count_);
    for (std::uint32_t t = 0; t < count_; ++t) {
      for (int c = 0; c < 3; ++c) {
        const std::uint32_t v = corners_[t][c];
        out_.triangles[t][c] = v < owned_ ? at[v] : kForeignCorner | (v - owned_);
      }
    }
    for (std::size_t s = 0; s < special_.size(); ++s) {
      const std::uint32_t v = special_[s];
      const auto triangles = star(v);
      for (std::uint32_t i = 0; i < triangles.size(); ++i) {
        const LocalTriangle& c = corners_[triangles[i]];
        const int corner = c[0] == v ? 0 : c[1] == v ? 1 : 2;
        out_.triangles[triangles[i]][corner] += class_[class_start_[s] + i];
      }
    }
  }

  void list_border() {
    for (std::uint32_t t = 0; t < count_; ++t) {
      if (leaves_[t] != 0) {
        for (const std::uint32_t v : out_.triangles[t]) {
          if (v < kForeignCorner) {
            out_.border.push_back(v);
          }
        }
      }
    }
    std::sort(out_.border.begin(), out_.border.end());
    out_.border.erase(std::unique(out_.border.begin(), out_.border.end()), out_.border.end());
    if (out_.split_vertices == 0) {
      return;
    }
    for (std::uint32_t t = 0; t < count_; ++t) {
      for (int c = 0; c < 3 && leaves_[t] != 0; ++c) {
        const std::uint32_t v = corners_[t][c];
        if (v >= owned_ || copies_[v] < 2) {
          continue;
        }
        const std::uint64_t p = ranks(t)[(c + 1) % 3];
        const std::uint64_t q = ranks(t)[(c + 2) % 3];
        const auto at =
            std::lower_bound(out_.border.begin(), out_.border.end(), out_.triangles[t][c]);
        out_.split_corners.push_back({rank_of(v), std::min(p, q), std::max(p, q),
                                      static_cast<std::uint64_t>(at - out_.border.begin())});
      }
    }
    std::sort(out_.split_corners.begin(), out_.split_corners.end(),
              [](const SplitCorner& a, const SplitCorner& b) {
                return std::tie(a.rank, a.low, a.high) < std::tie(b.rank, b.low, b.high);
              });
  }

  /// Turns the minority of each settled patch, describes the others for the join over blocks.
  void settle_orientation() {
    std::vector<std::uint64_t> turned(count_, 0);
    std::vector<std::uint64_t> plain(count_, 0);
    std::vector<std::uint32_t> first_parity(count_, 2);
    bool uniform = out_.patches.size() <= 1;
    for (std::uint32_t t = 0; t < count_; ++t) {
      const auto [root, parity] = sets_.find(t);
      uniform = uniform && parity == 0 && (out_.patches.empty() || patch_[root] == 0);
      if (t >= others_) {
        ++(parity == 0 ? plain : turned)[root];
        if (first_parity[root] == 2) {
          first_parity[root] = parity;
        }
      }
    }
    if (!uniform) {
      out_.patch_of.resize(count_);
    }
    for (std::uint32_t t = 0; t < count_; ++t) {
      const auto [root, parity] = sets_.find(t);
      const std::uint32_t patch = patch_[root];
      if (patch == kSettledPatch) {
        out_.settled_components += root == t ? 1 : 0;
        const bool flip_plain =
            turned[root] > plain[root] || (turned[root] == plain[root] && first_parity[root] == 1);
        if (flip_plain == (parity == 0)) {
          std::swap(out_.triangles[t][1], out_.triangles[t][2]);
          ++out_.flipped_triangles;
        }
      } else if (root == t) {
        Patch& p = out_.patches[patch];
        p.plain = plain[root];
        p.turned = turned[root];
        p.first_parity = first_parity[root] & 1U;
      }
      if (!uniform) {
        out_.patch_of[t] = patch == kSettledPatch ? kSettledPatch : patch << 1 | parity;
      }
      if (leaves_[t] != 0) {
        link(t, std::uint64_t{patch} << 1 | parity);
      }
    }
  }

  void link(std::uint32_t t, std::uint64_t patch) {
    const RankTriangle<Index>& r = ranks(t);
    const std::uint64_t me = input_.block;
    if (t < others_) {
      out_.other_links.push_back({(r[0] / input_.block_size) << 32 | me, patch});
      return;
    }
    const std::uint64_t b1 = r[1] / input_.block_size;
    const std::uint64_t b2 = r[2] / input_.block_size;
    if (b1 != me) {
      out_.home_links.push_back({me << 32 | b1, patch});
    }
    if (b2 != me && b2 != b1) {
      out_.home_links.push_back({me << 32 | b2, patch});
    }
  }

  RepairInput<Index> input_;
  std::uint64_t first_;
  std::uint32_t owned_;
  std::uint32_t others_ = 0;
  std::uint32_t count_ = 0;
  BlockRepair out_;

  std::vector<LocalTriangle> corners_;
  std::vector<std::uint8_t> leaves_;  ///< per triangle: it touches other blocks
  std::vector<std::uint32_t> star_start_;
  std::vector<std::uint32_t> star_;
  ParityUnionFind sets_;
  std::vector<std::uint32_t> conflicts_;
  std::vector<std::uint32_t> special_;   ///< vertices whose star is not one plain fan, ascending
  std::vector<std::uint32_t> patch_;     ///< per root
  std::vector<std::uint8_t> one_sided_;  ///< per triangle; empty: none
  std::vector<std::uint32_t> copies_;
  std::vector<std::uint32_t> class_start_;
  std::vector<std::uint32_t> class_;
  std::vector<Spoke> spokes_;
};

}  // namespace

template <class Index>
BlockRepair repair_block(RepairInput<Index> input) {
  return BlockRepairer<Index>(std::move(input)).run();
}

template BlockRepair repair_block(RepairInput<std::uint32_t>);
template BlockRepair repair_block(RepairInput<std::uint64_t>);

}  // namespace rattan
