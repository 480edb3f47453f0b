// SPDX-License-Identifier: MIT
#pragma once

// Vertices in curve order and triangles in terms of it. A vertex's rank is its place in that order.

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "engine/core/parallel.h"
#include "engine/core/spool.h"
#include "engine/core/types.h"

namespace rattan {

/// Ids of [begin, end) that triangles use, one bit each.
class VertexMarks {
 public:
  VertexMarks(std::uint64_t begin, std::uint64_t end)
      : begin_(begin), size_(end - begin), bits_((size_ + 63) / 64, 0) {}
  void mark(std::uint64_t id) {
    const std::uint64_t at = id - begin_;
    if (at < size_) {
      bits_[at >> 6] |= std::uint64_t{1} << (at & 63);
    }
  }
  std::uint64_t begin() const { return begin_; }
  std::uint64_t count() const {
    std::uint64_t n = 0;
    for (const std::uint64_t word : bits_) {
      n += static_cast<std::uint64_t>(std::popcount(word));
    }
    return n;
  }
  bool operator[](std::uint64_t id) const {
    const std::uint64_t at = id - begin_;
    return (bits_[at >> 6] >> (at & 63) & 1) != 0;
  }

 private:
  std::uint64_t begin_;
  std::uint64_t size_;
  std::vector<std::uint64_t> bits_;
};

/// Replaces vertex ids by ranks, in triangles streamed from spools, with a table of bounded size:
/// one pass over the triangles per part of the table. A replaced corner carries the top bit until
/// the last pass. Index must be wide enough to spare it.
template <class Index>
class Reindexer {
 public:
  using Triangle = std::array<Index, 3>;
  static constexpr Index kReplaced = Index{1} << (8 * sizeof(Index) - 1);
  /// Corner without a rank (a vertex that was dropped), as handed to the consumer.
  static constexpr Index kAbsent = static_cast<Index>(~kReplaced);

  /// `order`: the ids of ranks 0, 1, ...; one that carries kReplaced shares the rank before it.
  /// Table of at most `memory_bytes` (at least one entry).
  Reindexer(Store& store, const Spool<Index>& order, std::uint64_t vertex_count,
            std::uint64_t memory_bytes, std::size_t block_bytes)
      : store_(store),
        order_(order),
        vertex_count_(vertex_count),
        part_(std::max<std::uint64_t>(1, memory_bytes / sizeof(Index))),
        block_bytes_(block_bytes) {}

  /// `for_each_block(f)` calls f(std::span<const Triangle>) over the triangles in order; consume
  /// gets the same blocks (std::vector<Triangle>&) with ranks for ids.
  template <class Source, class Consume>
  void run(const Source& for_each_block, const Consume& consume) {
    const std::uint64_t passes = std::max<std::uint64_t>(1, (vertex_count_ + part_ - 1) / part_);
    std::vector<Spool<Triangle>> between;  // the output of the pass before; at most one
    for (std::uint64_t pass = 0; pass < passes; ++pass) {
      const std::uint64_t begin = pass * part_;
      fill_table(begin, std::min(vertex_count_, begin + part_));
      const bool last = pass + 1 == passes;
      Spool<Triangle> out(store_, "ingest/reindexed_" + std::to_string(pass), block_bytes_);
      const auto step = [&](std::span<const Triangle> block) {
        block_.assign(block.begin(), block.end());
        replace(begin, last);
        if (last) {
          consume(block_);
        } else {
          out.append(block_);
        }
      };
      if (between.empty()) {
        for_each_block(step);
      } else {
        between.front().for_each_block(step);
      }
      between.clear();
      if (!last) {
        out.finish();
        between.push_back(std::move(out));
      }
    }
    std::vector<Index>().swap(table_);
  }

 private:
  void fill_table(std::uint64_t begin, std::uint64_t end) {
    table_.assign(static_cast<std::size_t>(end - begin), kAbsent);
    Index next = 0;
    order_.for_each_block([&](std::span<const Index> ids) {
      for (const Index id : ids) {
        next += (id & kReplaced) == 0 ? 1 : 0;
        const std::uint64_t at = (id & static_cast<Index>(~kReplaced)) - begin;
        if (at < table_.size()) {
          table_[static_cast<std::size_t>(at)] = next - 1;
        }
      }
    });
  }

  void replace(std::uint64_t begin, bool last) {
    const auto first = static_cast<Index>(begin);
    parallel_indices(block_.size(), [&](std::size_t t) {
      for (Index& corner : block_[t]) {
        const auto at = static_cast<Index>(corner - first);
        if (at < table_.size()) {
          corner = table_[at] | kReplaced;
        }
        if (last) {
          corner &= static_cast<Index>(~kReplaced);
        }
      }
    });
  }

  Store& store_;
  const Spool<Index>& order_;
  std::uint64_t vertex_count_;
  std::uint64_t part_;
  std::size_t block_bytes_;
  std::vector<Index> table_;
  std::vector<Triangle> block_;
};

}  // namespace rattan
