// SPDX-License-Identifier: MIT
#pragma once

// A vector per vertex, given in the order of the file, brought into the order of ranks. Internal to
// ingest.

#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/spool.h"
#include "engine/mesh/external_sort.h"
#include "engine/mesh/ingest.h"
#include "engine/mesh/reindex.h"

namespace rattan {

// Scratch until the tiles are built, a chunk a block.
inline constexpr Field<VertexDirection> kRankedDirection{"ingest/direction"};

/// `ids`: those of ranks 0, 1, ... as VertexOrder leaves them; of vertices that share a rank the
/// first one's vector counts. Sorted to the order of ids, joined with the spool, sorted back.
template <class Index>
void rank_directions(Store& store, const Spool<VertexDirection>& directions,
                     const Spool<Index>& ids, const IngestOptions& options) {
  struct Wanted {
    Index id, rank;
  };
  struct ById {
    std::uint64_t operator()(const Wanted& w) const { return w.id; }
  };
  struct Found {
    Index rank;
    VertexDirection direction;
  };
  struct ByRank {
    std::uint64_t operator()(const Found& f) const { return f.rank; }
  };
  const auto memory = static_cast<std::size_t>(options.memory_bytes / 4);
  ExternalSort<Wanted, ById> wanted(store, "ingest/direction_id_run_", ById{}, memory, ids.size());
  Index rank = 0;
  ids.for_each_block([&](std::span<const Index> block) {
    for (const Index id : block) {
      if ((id & Reindexer<Index>::kReplaced) == 0) {
        wanted.push({id, rank++});
      }
    }
  });
  wanted.finish();
  ExternalSort<Found, ByRank> found(store, "ingest/direction_rank_run_", ByRank{}, memory, rank);
  SpoolReader<VertexDirection> given(directions);
  std::uint64_t at = 0;
  for (; !wanted.done(); wanted.pop()) {
    const Wanted& w = wanted.front();
    while (at < w.id) {
      const std::size_t step =
          std::min<std::uint64_t>(given.rest().size(), static_cast<std::uint64_t>(w.id) - at);
      given.skip(step);
      at += step;
    }
    found.push({w.rank, given.rest().front()});
  }
  found.finish();
  std::vector<VertexDirection> chunk;
  std::uint32_t block = 0;
  for (; !found.done(); found.pop()) {
    chunk.push_back(found.front().direction);
    if (chunk.size() == options.tile_size) {
      write(store, kRankedDirection, TileId(block++), chunk);
      chunk.clear();
    }
  }
  if (!chunk.empty()) {
    write(store, kRankedDirection, TileId(block), chunk);
  }
}

}  // namespace rattan
