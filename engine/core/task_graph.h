// SPDX-License-Identifier: MIT
#pragma once

// The one scheduler. A pass over tiles becomes a TBB flow graph: an ordered loading node, compute
// nodes as wide as the machine, an ordered committing node, and a bound on tiles in flight. No
// other file spells out scheduling; in-memory loops use parallel.h.

#include <cstdint>
#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <string_view>

#include "engine/core/progress.h"
#include "engine/core/steps.h"
#include "engine/core/types.h"

namespace rattan {

/// What a pass does with one tile. State moves from step to step inside the returned object.
class TileTask {
 public:
  virtual ~TileTask() = default;
  /// Reads chunks. Runs one tile at a time, in tile order, ahead of compute.
  virtual void load() = 0;
  /// Runs concurrently with other tiles. Must not touch shared state.
  virtual void compute() = 0;
  /// Writes chunks, publishes borders, adds to reductions. Runs one tile at a time, in tile order.
  virtual void commit() = 0;
};

struct TaskGraphOptions {
  /// Compute width; 0 means what the current TBB arena offers.
  int threads = 0;
  /// Tiles loaded and not yet committed; the memory bound. 0 means 2 * threads + 2.
  int tiles_in_flight = 0;
};

/// What a pass goes over: the tiles of the scan, or those of something coarser.
enum class PassOver { kScan, kCoarse };

class TaskGraph {
 public:
  explicit TaskGraph(TaskGraphOptions options = {}, ProgressSink* progress = nullptr,
                     std::stop_token stop = {}, Steps* steps = nullptr);

  /// Runs `make(t)` -> load -> compute -> commit for tiles 0 .. tile_count-1. The first exception
  /// (in tile order of commit) is rethrown after the graph has drained; a stop request throws
  /// Cancelled.
  void run(std::string_view name, std::uint32_t tile_count,
           const std::function<std::unique_ptr<TileTask>(TileId)>& make,
           PassOver over = PassOver::kScan);

  /// Of the job that the passes belong to.
  Steps& steps() const {
    static PlainSteps none;
    return steps_ != nullptr ? *steps_ : none;
  }
  int threads() const { return options_.threads; }
  /// Number of passes over the scan run so far, by this graph.
  std::uint64_t passes() const { return passes_; }

 private:
  TaskGraphOptions options_;
  ProgressSink* progress_;
  std::stop_token stop_;
  Steps* steps_;
  std::uint64_t passes_ = 0;
};

/// A task made of three callables sharing a state; the usual way to write a pass.
template <class State, class Load, class Compute, class Commit>
class LambdaTileTask final : public TileTask {
 public:
  LambdaTileTask(TileId tile, const Load& load, const Compute& compute, const Commit& commit)
      : tile_(tile), load_(load), compute_(compute), commit_(commit) {}
  void load() override { load_(tile_, state_); }
  void compute() override { compute_(tile_, state_); }
  void commit() override { commit_(tile_, state_); }

 private:
  TileId tile_;
  State state_{};
  const Load& load_;
  const Compute& compute_;
  const Commit& commit_;
};

/// run_pass<State>(graph, "normals", tiles, load, compute, commit), each (TileId, State&) -> void.
template <class State, class Load, class Compute, class Commit>
void run_pass(TaskGraph& graph, std::string_view name, std::uint32_t tile_count, const Load& load,
              const Compute& compute, const Commit& commit, PassOver over = PassOver::kScan) {
  graph.run(
      name, tile_count,
      [&](TileId tile) -> std::unique_ptr<TileTask> {
        return std::make_unique<LambdaTileTask<State, Load, Compute, Commit>>(tile, load, compute,
                                                                              commit);
      },
      over);
}

}  // namespace rattan
