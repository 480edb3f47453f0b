// SPDX-License-Identifier: MIT
#include "engine/solve/coarsest_solver.h"

#include <algorithm>
#include <numeric>

namespace rattan {

template <class Block>
CoarsestSolver::CoarsestSolver(const SystemLevel<Block>& level) {
  const TileLayout& layout = level.level->layout;
  const auto n = static_cast<std::uint32_t>(layout.node_count);
  std::vector<std::uint32_t> up(n);
  std::iota(up.begin(), up.end(), 0U);
  const auto root = [&](std::uint32_t i) {
    while (up[i] != i) {
      up[i] = up[up[i]];
      i = up[i];
    }
    return i;
  };
  std::vector<Eigen::Triplet<double>> entries;
  std::vector<double> diagonal(n, 0.0);
  std::vector<double> fit(n, 0.0);
  count_.assign(n, 1.0);
  for (std::uint32_t t = 0; t < layout.tile_count(); ++t) {
    TileSystem<Block> tile;
    tile.load(level, TileId(t));
    const auto halo_ids = read(*level.level->store, level.level->halo.halo_ids, TileId(t));
    const auto first = static_cast<std::uint32_t>(tile.extent.first);
    for (std::uint32_t i = 0; i < tile.extent.owned; ++i) {
      const std::uint32_t a = first + i;
      diagonal[a] = static_cast<double>(tile.stiffness(i, 0)) + tile.fit_of(i);
      fit[a] = tile.fit_of(i);
      count_[a] = tile.count(i);
      for (std::uint32_t e = tile.row_begin[i]; e < tile.row_begin[i + 1]; ++e) {
        const std::uint32_t j = tile.neighbor[e];
        const auto b = j < tile.extent.owned
                           ? first + j
                           : static_cast<std::uint32_t>(halo_ids[j - tile.extent.owned]);
        // Rounding makes rows of neighbours differ in the last bit: the lower node's counts.
        if (a < b) {
          entries.emplace_back(static_cast<int>(b), static_cast<int>(a), -tile.coefficient[e].w);
          const std::uint32_t ra = root(a);
          const std::uint32_t rb = root(b);
          up[std::max(ra, rb)] = std::min(ra, rb);
        }
      }
    }
  }
  component_.resize(n);
  std::vector<std::uint32_t> first_of;
  std::vector<double> component_fit;
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t r = root(i);  // the lowest of its component, so it comes first
    if (r == i) {
      component_[i] = static_cast<std::uint32_t>(first_of.size());
      first_of.push_back(i);
      component_count_.push_back(0.0);
      component_fit.push_back(0.0);
    } else {
      component_[i] = component_[r];
    }
    component_count_[component_[i]] += count_[i];
    component_fit[component_[i]] += fit[i];
  }
  for (std::size_t c = 0; c < first_of.size(); ++c) {
    has_kernel_.push_back(component_fit[c] > 0.0 ? 0 : 1);
    if (has_kernel_[c] != 0) {
      // Grounds one node; solve() removes the mean.
      singular_ = true;
      diagonal[first_of[c]] += diagonal[first_of[c]] > 0.0 ? diagonal[first_of[c]] : 1.0;
    }
  }
  for (std::uint32_t i = 0; i < n; ++i) {
    entries.emplace_back(static_cast<int>(i), static_cast<int>(i), diagonal[i]);
  }
  Eigen::SparseMatrix<double> lower(n, n);
  lower.setFromTriplets(entries.begin(), entries.end());
  factors_.compute(lower);
}

void CoarsestSolver::solve(Eigen::MatrixXd& columns) const {
  if (factors_.info() == Eigen::Success) {
    columns = factors_.solve(columns).eval();
  } else {
    columns.setZero();  // a preconditioner may do without its coarsest level
  }
  Eigen::MatrixXd means = columns;
  for (Eigen::Index i = 0; i < means.rows(); ++i) {
    means.row(i) *= count_[static_cast<std::size_t>(i)];
  }
  component_means(means);
  columns -= means;
}

void CoarsestSolver::component_means(Eigen::MatrixXd& columns) const {
  Eigen::MatrixXd sums =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(component_count_.size()), columns.cols());
  for (Eigen::Index i = 0; i < columns.rows(); ++i) {
    sums.row(component_[static_cast<std::size_t>(i)]) += columns.row(i);
  }
  for (Eigen::Index i = 0; i < columns.rows(); ++i) {
    const std::uint32_t c = component_[static_cast<std::size_t>(i)];
    columns.row(i) = has_kernel_[c] != 0 ? Eigen::RowVectorXd(sums.row(c) / component_count_[c])
                                         : Eigen::RowVectorXd::Zero(columns.cols());
  }
}

template <class Block>
Eigen::MatrixXd CoarsestSolver::gather(const SystemLevel<Block>& level, Field<Value<Block>> field) {
  constexpr auto kReals = static_cast<Eigen::Index>(BlockOps<Block>::kReals);
  const TileLayout& layout = level.level->layout;
  Eigen::MatrixXd columns(static_cast<Eigen::Index>(layout.node_count), kReals);
  for (std::uint32_t t = 0; t < layout.tile_count(); ++t) {
    const auto values = read(*level.store, field, TileId(t));
    for (std::size_t i = 0; i < values.size(); ++i) {
      for (Eigen::Index k = 0; k < kReals; ++k) {
        columns(static_cast<Eigen::Index>(layout.tiles[t].first + i), k) =
            reals<Block>(values[i])[k];
      }
    }
  }
  return columns;
}

template <class Block>
void CoarsestSolver::scatter(const SystemLevel<Block>& level, const Eigen::MatrixXd& columns,
                             Field<Value<Block>> field, HaloBoard<Value<Block>>& board) {
  constexpr auto kReals = static_cast<Eigen::Index>(BlockOps<Block>::kReals);
  const TileLayout& layout = level.level->layout;
  board.assign(layout.border_count, zero_value<Block>());
  for (std::uint32_t t = 0; t < layout.tile_count(); ++t) {
    const TileExtent& extent = layout.tiles[t];
    std::vector<Value<Block>> values(extent.owned);
    for (std::size_t i = 0; i < values.size(); ++i) {
      for (Eigen::Index k = 0; k < kReals; ++k) {
        reals<Block>(values[i])[k] =
            static_cast<float>(columns(static_cast<Eigen::Index>(extent.first + i), k));
      }
    }
    const auto border = read(*level.level->store, level.level->halo.border, TileId(t));
    publish_border<Value<Block>>(values, border.span(), extent.border_first, board);
    write(*level.store, field, TileId(t), values);
  }
}

#define RATTAN_INSTANTIATE(Block)                                                                  \
  template CoarsestSolver::CoarsestSolver(const SystemLevel<Block>&);                              \
  template Eigen::MatrixXd CoarsestSolver::gather(const SystemLevel<Block>&, Field<Value<Block>>); \
  template void CoarsestSolver::scatter(const SystemLevel<Block>&, const Eigen::MatrixXd&,         \
                                        Field<Value<Block>>, HaloBoard<Value<Block>>&);
RATTAN_INSTANTIATE(RealBlock)
RATTAN_INSTANTIATE(Real3Block)
#undef RATTAN_INSTANTIATE

}  // namespace rattan
