// SPDX-License-Identifier: MIT
#pragma once

// Flexible conjugate gradients, preconditioned by one cycle over the hierarchy: the residual is
// restricted to all levels, the coarsest is solved, and each finer level relaxes from what the
// coarser one found. Vectors are fields; an iteration visits the tiles of its level three times.

#include <memory>

#include "engine/solve/passes.h"

namespace rattan {

/// The coarsest level of a real system: factorised, with the constants of each connected component
/// that has no fit taken out.
class CoarsestSolver;

template <class Block>
struct CgProblem {
  std::size_t level = 0;                     ///< the one to be solved on
  Field<Value<Block>> x;                     ///< the answer; starts from zero
  HaloBoard<Value<Block>>* board = nullptr;  ///< of x
  /// kLinear: the system itself. kNewton: its Newton matrix at the levels' `solution`, in the
  /// positive semidefinite form of SweepMode::kNewton.
  SweepMode mode = SweepMode::kLinear;
  float penalty = 0.0F;
  float tolerance = 1e-2F;  ///< relative residual
  int max_iterations = 100;
  const CoarsestSolver* coarsest = nullptr;  ///< real blocks
};

struct CgResult {
  std::uint64_t iterations = 0;
  std::uint64_t passes = 0;  ///< over the finest tiles
};

/// Pre: levels[problem.level].residual holds the right-hand side; it is left as the residual.
template <class Block>
CgResult conjugate_gradients(SystemHierarchy<Block>& system, const CgProblem<Block>& problem,
                             TaskGraph& tasks);

/// Solves a real system; the solution has zero mean on every component without fit.
template <class Block>
void solve_real(SystemHierarchy<Block>& system, const SolveOptions& options, SolveReport& report,
                TaskGraph& tasks);

}  // namespace rattan
