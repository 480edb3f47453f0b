// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include "engine/solve/system_level.h"

namespace rattan {

/// The coarsest level of a real system, gathered and factorised in double.
class CoarsestSolver {
 public:
  template <class Block>
  explicit CoarsestSolver(const SystemLevel<Block>& level);

  /// Some component has no fit: constants on it are in the kernel.
  bool singular() const { return singular_; }
  /// Solves for every column in place; columns then have zero mean on singular components.
  void solve(Eigen::MatrixXd& columns) const;
  /// Replaces sums over nodes by the mean of their component where singular, by zero elsewhere.
  void component_means(Eigen::MatrixXd& columns) const;

  template <class Block>
  static Eigen::MatrixXd gather(const SystemLevel<Block>& level, Field<Value<Block>> field);
  template <class Block>
  static void scatter(const SystemLevel<Block>& level, const Eigen::MatrixXd& columns,
                      Field<Value<Block>> field, HaloBoard<Value<Block>>& board);

 private:
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors_;
  std::vector<std::uint32_t> component_;
  std::vector<double> count_;            ///< of each node
  std::vector<double> component_count_;  ///< of each component
  std::vector<char> has_kernel_;         ///< of each component
  bool singular_ = false;
};

}  // namespace rattan
