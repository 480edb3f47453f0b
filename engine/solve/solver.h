// SPDX-License-Identifier: MIT
#pragma once

// The solver's front: a hierarchy built once per scan, and for each system either nested iteration
// over it (the default, out of core) or the paper's own procedure (the reference).

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "engine/core/task_graph.h"
#include "engine/core/tile_layout.h"
#include "engine/solve/system.h"

namespace rattan {

/// Aggregates of vertices, of aggregates, and so on, down to a few hundred nodes; shared by all
/// systems of one scan, each of which transports its own values through it.
class Hierarchy;
class FirstMatching;

struct HierarchyOptions {
  std::uint32_t coarsest_nodes = 300;
};

/// The level-0 graph: rows over owned vertices, one non-negative weight a half-edge (the strength
/// that decides what is aggregated).
struct GraphFields {
  Field<std::uint32_t> row_begin;
  Field<std::uint32_t> neighbor;
  Field<float> weight;
};

/// Two passes over the finest tiles, one if the first matching is known. Leaves fields
/// "solve/level<k>_..." in the store that the hierarchy needs: one hierarchy a store at a time, and
/// the store must outlive it.
std::shared_ptr<const Hierarchy> build_hierarchy(Store& store, const TileLayout& layout,
                                                 const HaloFields& halo, const GraphFields& graph,
                                                 const HierarchyOptions& options, TaskGraph& tasks,
                                                 FirstMatching* matching = nullptr);

/// Lengths of a value's complex parts; of those with one, twice the same.
using PartNorms = std::array<float, 2>;

struct SolveOptions {
  /// eps_i of the norm penalty per aggregated vertex; 0 for real systems.
  float penalty = 0.2F;
  /// Multiplies the coarse stiffness once per level: 1 for the parameterization, 0.5 for smoothing
  /// and for real systems.
  float coarse_stiffness = 1.0F;
  /// Passes over the finest level's tiles, and Gauss-Seidel sweeps in each.
  int passes = 2;
  int sweeps = 8;
  /// Random starts of a periodic system that are compared on a coarse level; on scans of a single
  /// tile, where that costs little, on the finest.
  int starts = 4;
  int starts_of_one_tile = 4;
  /// Hierarchy-preconditioned Newton-CG steps at the end.
  int newton_steps = 0;
  /// Relative residual at which CG stops (real systems; inner solves of Newton).
  float tolerance = 1e-2F;
  /// Normalise the finest solution's complex parts to unit length at the end.
  bool unit_norm = false;
  /// With unit_norm: keep the lengths that the parts had before, one pair an owned vertex; no name:
  /// don't.
  Field<PartNorms> norms{};
  /// Fill in the report's energies and gradient norm. Where the last pass can't do it on its way,
  /// this is one more.
  bool evaluate = true;
  /// Real systems: 0 for conjugate gradients on the finest level, to `tolerance`. Else nested
  /// iteration with so many corrections of the finest level, 1 + 2 cycles passes whatever the
  /// scan's size, if the hierarchy has levels enough.
  int cycles = 0;
  /// CG iterations at most (real systems; each inner solve of Newton takes at most a tenth).
  int max_iterations = 200;
};

/// What a caller makes of the solution in the pass that finishes it, one object a tile: steps as in
/// TileTask.
template <class Block>
class SolutionTask {
 public:
  virtual ~SolutionTask() = default;
  virtual void load() = 0;
  /// `owned`: the tile's solution.
  virtual void compute(std::span<const typename Block::Value> owned) = 0;
  virtual void commit() = 0;
};

/// What solve_coarse did; its answer is in the store.
struct CoarsePart {
  bool done = false;  ///< else all is left to solve_nested
  std::uint64_t setup_passes = 0;
};

/// What callers do in passes that a solve makes anyway, so that they need none of their own.
template <class Block>
struct SolveHooks {
  /// Found while the system was assembled (border_gauges.h); empty: the solve finds them in a pass.
  HaloBoard<typename Block::Coefficient> border_gauges;
  /// What was solved already.
  CoarsePart coarse;
  /// Called for every tile of the finished solution, which is not written to the store then.
  std::function<std::unique_ptr<SolutionTask<Block>>(TileId)> consume;
  /// Called before the first `consume`: the solution's mean and variance, weighted by fit, as they
  /// were before the last pass. Real blocks solved in cycles.
  std::function<void(double mean, double variance)> moments;
  /// Set by the solve if `consume` was called; else there was no pass to do it in.
  bool consumed = false;
};

struct SolveReport {
  std::string system;
  std::uint64_t unknowns = 0;      ///< real numbers solved for at the finest level
  std::uint64_t iterations = 0;    ///< CG iterations, or sweeps at the finest level
  std::uint64_t passes = 0;        ///< visits of all finest tiles, the final evaluation included
  std::uint64_t setup_passes = 0;  ///< further visits to coarsen the system
  double energy = 0.0;             ///< as in system.h, with penalty
  double energy_unit = 0.0;        ///< without penalty, complex parts set to unit length
  /// Where the last pass took it on its way, tiles see each other's border as before that pass.
  double gradient_norm = 0.0;
};

template <class A>
void members_of(A& a, SolveReport& r) {
  a(r.system);
  a(r.unknowns);
  a(r.iterations);
  a(r.passes);
  a(r.setup_passes);
  a(r.energy);
  a(r.energy_unit);
  a(r.gradient_norm);
}

/// The pass of hooks.consume for solutions that are in the store.
template <class Block>
void consume_solution(Store& store, const TileLayout& layout, Field<typename Block::Value> solution,
                      SolveHooks<Block>& hooks, TaskGraph& tasks);

/// Reads the system's fields, writes `solution` with its board (kBoardTile). Works by passes over
/// tiles; memory: a few tiles per thread plus levels small enough to hold. Scratch fields
/// "solve/..." are erased at the end. `layout` and `halo` are those of the hierarchy. Periodic
/// systems: nested iteration, then Newton steps. Real systems: conjugate gradients to `tolerance`
/// relative to the right-hand side; on components without fit the right-hand side's mean is ignored
/// and the solution's mean is zero.
template <class Block>
SolveReport solve_nested(Store& store, const TileLayout& layout, const HaloFields& halo,
                         const SystemFields<Block>& system, const Hierarchy& hierarchy,
                         const SolveOptions& options, TaskGraph& tasks,
                         SolveHooks<Block>* hooks = nullptr);

/// Whether the finest level is worth a part of its own: several tiles, no Newton steps.
bool can_solve_coarse(const Hierarchy& hierarchy, const SolveOptions& options);

/// The part of solve_nested below the finest level by itself, for callers that save work before the
/// rest; periodic systems. Takes hooks.border_gauges. Give what it returns to solve_nested;
/// meanwhile its answer is in fields "solve/..." of the store.
template <class Block>
CoarsePart solve_coarse(Store& store, const SystemFields<Block>& system, const Hierarchy& hierarchy,
                        const SolveOptions& options, TaskGraph& tasks, SolveHooks<Block>& hooks);

/// PGP 2.5: lock one vertex (periodic systems), Jacobi-preconditioned multithreaded CG for the
/// linear problem, then Newton with the penalty. For comparison on small scans.
template <class Block>
SolveReport solve_reference(Store& store, const TileLayout& layout, const HaloFields& halo,
                            const SystemFields<Block>& system, const SolveOptions& options,
                            TaskGraph& tasks);

}  // namespace rattan
