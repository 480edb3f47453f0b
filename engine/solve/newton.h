// SPDX-License-Identifier: MIT
#pragma once

#include "engine/solve/conjugate_gradient.h"

namespace rattan {

/// Newton-CG steps on the penalised energy of the finest level, starting from its solution. The
/// Hessian's negative curvature (norms below one) is left out; the step length is the exact
/// minimiser of the energy along the step, so no step raises it.
template <class Block>
void newton_steps(SystemHierarchy<Block>& system, const SolveOptions& options, SolveReport& report,
                  TaskGraph& tasks);

/// Coefficients of the energy along a line, a quartic without its constant.
struct Quartic {
  double c1 = 0.0;
  double c2 = 0.0;
  double c3 = 0.0;
  double c4 = 0.0;
  double operator()(double t) const { return t * (c1 + t * (c2 + t * (c3 + t * c4))); }
};
/// The t > 0 of least energy on the way down from 0; 0 if the line doesn't descend.
double descend(const Quartic& q);

}  // namespace rattan
