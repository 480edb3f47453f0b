// SPDX-License-Identifier: MIT
#pragma once

// The vertices of a scan along the space-filling curve, in blocks; those at equal positions as one,
// where wanted. Internal to ingest.

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <type_traits>
#include <vector>

#include "engine/core/parallel.h"
#include "engine/core/spool.h"
#include "engine/mesh/curve.h"
#include "engine/mesh/external_sort.h"
#include "engine/mesh/ingest.h"
#include "engine/mesh/reindex.h"

namespace rattan {

// Scratch until the tiles are built, a chunk a block.
inline constexpr Field<Vec3f> kRankedPosition{"ingest/position"};
inline constexpr Field<Rgba> kRankedColour{"ingest/colour"};

/// Finite, and so small that its square is too.
inline bool is_usable(const Vec3d& p) {
  constexpr double kMost = 1e150;
  return std::abs(p[0]) <= kMost && std::abs(p[1]) <= kMost && std::abs(p[2]) <= kMost;
}

/// Gives every vertex that triangles use its rank: its place along the curve, ties by id, or with
/// `weld` by a hash of the position, so that equal positions, which share a rank, are neighbours.
template <class Index>
class VertexOrder {
 public:
  struct Input {
    const Spool<Vec3d>& positions;
    const Spool<Rgba>* colours;  ///< null: none
    std::uint64_t vertices;
    Vec3d box_min;
    Vec3d box_max;
    Vec3d origin;
    double unit;
    bool weld;
  };

  /// `ids` gets the ids of ranks 0, 1, ...; one with the top bit set shares the rank before it.
  VertexOrder(Store& store, const IngestOptions& options, Spool<Index>& ids)
      : store_(store), options_(options), ids_(ids) {}

  /// `for_each_block(f)` calls f(std::span<const std::array<Index, 3>>) over the triangles.
  template <class Source>
  void run(const Input& input, const Source& for_each_block) {
    if (input.weld) {
      sort<Exact>(input, for_each_block);
    } else if (input.colours != nullptr) {
      sort<Coloured>(input, for_each_block);
    } else {
      sort<Plain>(input, for_each_block);
    }
  }

  struct Survey {
    std::uint64_t used = 0;  ///< vertices that triangles use (those that repeat an index apart)
    Vec3d box_min = Vec3d::Constant(std::numeric_limits<double>::infinity());
    Vec3d box_max = Vec3d::Constant(-std::numeric_limits<double>::infinity());
  };
  /// What triangles use of the vertices; the box is of the usable ones, so that a stray vertex
  /// takes nothing from the scan's accuracy.
  template <class Source>
  Survey survey(const Spool<Vec3d>& spool, std::uint64_t vertices, const Source& for_each_block) {
    Survey s;
    SpoolReader<Vec3d> positions(spool);
    for (std::uint64_t begin = 0; begin < vertices; begin += part()) {
      const std::uint64_t end = std::min(vertices, begin + part());
      const VertexMarks& used = marks(begin, end, for_each_block);
      s.used += used.count();
      for (std::uint64_t id = begin; id < end;) {
        const std::span<const Vec3d> block = positions.rest();
        const auto count =
            static_cast<std::size_t>(std::min<std::uint64_t>(block.size(), end - id));
        for (std::size_t i = 0; i < count; ++i) {
          if (used[id + i] && is_usable(block[i])) {
            s.box_min = s.box_min.cwiseMin(block[i]);
            s.box_max = s.box_max.cwiseMax(block[i]);
          }
        }
        positions.skip(count);
        id += count;
      }
    }
    return s;
  }

  std::uint64_t ranks() const { return ranks_; }
  std::uint64_t merged() const { return merged_; }

 private:
  struct Plain {
    std::uint64_t key;
    Vec3f position;
    Index id;
  };
  struct Coloured {
    std::uint64_t key;
    Vec3f position;
    Index id;
    Rgba colour;
  };
  struct Exact {
    std::uint64_t key;
    Vec3d position;
    Index id;
    Rgba colour;
  };
  struct KeyOf {
    template <class Record>
    std::uint64_t operator()(const Record& v) const {
      return v.key;
    }
  };
  static std::uint64_t hash_of(const Exact& v) {
    std::uint64_t h = 0;
    for (int k = 0; k < 3; ++k) {
      h = (h ^ std::bit_cast<std::uint64_t>(v.position[k])) * 0x9e3779b97f4a7c15U;
      h ^= h >> 29;
    }
    return h;
  }
  struct HashOf {
    std::uint64_t operator()(const Exact& v) const { return hash_of(v); }
  };

  std::uint64_t part() const { return std::max<std::uint64_t>(64, options_.memory_bytes / 4 * 8); }

  /// Of the ids [begin, end). The last part asked for is kept, so a scan of one part is marked
  /// once.
  template <class Source>
  const VertexMarks& marks(std::uint64_t begin, std::uint64_t end, const Source& for_each_block) {
    if (marks_ && marks_->begin() == begin) {
      return *marks_;
    }
    marks_.emplace(begin, end);
    for_each_block([&](std::span<const std::array<Index, 3>> block) {
      for (const auto& t : block) {
        if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) {
          for (const Index v : t) {
            marks_->mark(v);
          }
        }
      }
    });
    return *marks_;
  }

  template <class Record, class Source>
  void sort(const Input& in, const Source& for_each_block) {
    ExternalSort<Record, KeyOf> sorted(store_, "ingest/vertex_run_", KeyOf{},
                                       static_cast<std::size_t>(options_.memory_bytes / 2),
                                       in.vertices);
    push_all(in, for_each_block, sorted);
    marks_.reset();
    sorted.finish();
    in_ = &in;
    if constexpr (std::is_same_v<Record, Exact>) {
      const std::size_t most = std::max<std::size_t>(
          4, static_cast<std::size_t>(options_.memory_bytes / 4 / sizeof(Exact)));
      while (!sorted.done()) {
        take_cell(sorted, most);
      }
    } else {
      for (; !sorted.done(); sorted.pop()) {
        const Record& v = sorted.front();
        if constexpr (std::is_same_v<Record, Coloured>) {
          colours_.push_back(v.colour);
        }
        emit(v.position, v.id);
      }
    }
    flush();
    ids_.finish();
  }

  template <class Record, class Source>
  void push_all(const Input& in, const Source& for_each_block,
                ExternalSort<Record, KeyOf>& sorted) {
    constexpr std::uint64_t kDropped = ~std::uint64_t{0};
    const HilbertCurve curve(in.box_min, in.box_max);
    const double per_unit = 1.0 / in.unit;
    SpoolReader<Vec3d> positions(in.positions);
    std::optional<SpoolReader<Rgba>> colours;
    if (in.colours != nullptr) {
      colours.emplace(*in.colours);
    }
    std::vector<Record> keyed;
    for (std::uint64_t begin = 0; begin < in.vertices; begin += part()) {
      const std::uint64_t end = std::min(in.vertices, begin + part());
      const VertexMarks& used = marks(begin, end, for_each_block);
      for (std::uint64_t id = begin; id < end;) {
        const std::span<const Vec3d> block = positions.rest();
        std::uint64_t most = std::min<std::uint64_t>(block.size(), end - id);
        std::span<const Rgba> tints;
        if (colours) {
          tints = colours->rest();
          most = std::min<std::uint64_t>(most, tints.size());
        }
        const auto count = static_cast<std::size_t>(most);
        keyed.resize(count);
        parallel_indices(count, [&](std::size_t i) {
          Record& r = keyed[i];
          if (!used[id + i] || !is_usable(block[i])) {
            r.key = kDropped;
            return;
          }
          r.key = curve(block[i]);
          r.id = static_cast<Index>(id + i);
          if constexpr (std::is_same_v<Record, Exact>) {
            r.position = block[i] + Vec3d::Zero();  // no negative zero
            r.colour = tints.empty() ? Rgba{} : tints[i];
          } else {
            r.position = ((block[i] - in.origin) * per_unit).template cast<float>();
          }
          if constexpr (std::is_same_v<Record, Coloured>) {
            r.colour = tints[i];
          }
        });
        std::size_t kept = 0;
        for (std::size_t i = 0; i < count; ++i) {
          if (keyed[i].key != kDropped) {
            keyed[kept++] = keyed[i];
          }
        }
        sorted.push(std::span<const Record>(keyed).first(kept));
        positions.skip(count);
        if (colours) {
          colours->skip(count);
        }
        id += count;
      }
    }
  }

  /// The vertices of one cell of the curve. Nearly always these are copies of one; where a scan is
  /// tiny within its box a cell may hold all of it, so beyond `most` they are sorted outside.
  void take_cell(ExternalSort<Exact, KeyOf>& sorted, std::size_t most) {
    const std::uint64_t key = sorted.front().key;
    cell_.clear();
    bool alike = true;
    while (!sorted.done() && sorted.front().key == key && cell_.size() < most) {
      cell_.push_back(sorted.front());
      alike = alike && cell_.back().position == cell_.front().position;
      sorted.pop();
    }
    const bool whole = sorted.done() || sorted.front().key != key;
    if (whole) {
      if (!alike) {
        std::stable_sort(cell_.begin(), cell_.end(),
                         [](const Exact& a, const Exact& b) { return hash_of(a) < hash_of(b); });
      }
      std::size_t at = 0;
      while (at < cell_.size()) {
        take_hash([&] { return at < cell_.size() ? &cell_[at++] : nullptr; }, [&] { --at; });
      }
      return;
    }
    ExternalSort<Exact, HashOf> hashed(store_, "ingest/cell_run_", HashOf{},
                                       static_cast<std::size_t>(options_.memory_bytes / 4), 0);
    hashed.push(std::span<const Exact>(cell_));
    for (; !sorted.done() && sorted.front().key == key; sorted.pop()) {
      hashed.push(sorted.front());
    }
    hashed.finish();
    Exact next;
    bool held = false;
    while (held || !hashed.done()) {
      take_hash(
          [&]() -> const Exact* {
            if (held) {
              held = false;
              return &next;
            }
            if (hashed.done()) {
              return nullptr;
            }
            next = hashed.front();
            hashed.pop();
            return &next;
          },
          [&] { held = true; });
    }
  }

  /// Vertices of one hash: those at the first one's position pass through, the others (there are
  /// hardly ever any) follow by position. `put_back` returns the last one taken.
  template <class Next, class PutBack>
  void take_hash(const Next& next, const PutBack& put_back) {
    const Exact first = *next();
    const std::uint64_t hash = hash_of(first);
    std::vector<Exact> others;
    emit(first);
    while (const Exact* v = next()) {
      if (v->position == first.position) {
        emit(*v);
      } else if (hash_of(*v) == hash) {
        others.push_back(*v);
      } else {
        put_back();
        break;
      }
    }
    std::stable_sort(others.begin(), others.end(), [](const Exact& a, const Exact& b) {
      return std::lexicographical_compare(a.position.begin(), a.position.end(), b.position.begin(),
                                          b.position.end());
    });
    for (const Exact& v : others) {
      emit(v);
    }
  }

  void emit(const Exact& v) {
    if (ranks_ > 0 && v.position == last_) {
      ids_.push(v.id | Reindexer<Index>::kReplaced);
      ++merged_;
      return;
    }
    last_ = v.position;
    if (in_->colours != nullptr) {
      colours_.push_back(v.colour);
    }
    emit(((v.position - in_->origin) / in_->unit).template cast<float>(), v.id);
  }

  void emit(const Vec3f& position, Index id) {
    ids_.push(id);
    chunk_.push_back(position);
    ++ranks_;
    if (chunk_.size() == options_.tile_size) {
      flush();
    }
  }

  void flush() {
    if (chunk_.empty()) {
      return;
    }
    const TileId block(static_cast<std::uint32_t>((ranks_ - 1) / options_.tile_size));
    write(store_, kRankedPosition, block, chunk_);
    chunk_.clear();
    if (!colours_.empty()) {
      write(store_, kRankedColour, block, colours_);
      colours_.clear();
    }
  }

  Store& store_;
  const IngestOptions& options_;
  Spool<Index>& ids_;
  std::uint64_t ranks_ = 0;
  std::uint64_t merged_ = 0;
  const Input* in_ = nullptr;
  Vec3d last_ = Vec3d::Zero();
  std::optional<VertexMarks> marks_;
  std::vector<Exact> cell_;
  std::vector<Vec3f> chunk_;
  std::vector<Rgba> colours_;
};

}  // namespace rattan
