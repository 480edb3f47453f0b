// SPDX-License-Identifier: MIT
//
// Based on: Ray, Li, Levy, Sheffer, Alliez, Periodic Global Parameterization (2006), section 2.5:
// one vertex locked, Jacobi-preconditioned conjugate gradients for the quadratic form, then
// Newton's method on the penalised energy. What differs: one vertex is locked per component, Newton
// starts from the linear solution at unit norms (its norms decay exponentially away from the lock),
// inner solves stop at negative curvature, and steps go to the exact minimum along their line.

#include <algorithm>
#include <cmath>
#include <numeric>

#include "engine/core/parallel.h"
#include "engine/solve/finish.h"
#include "engine/solve/newton.h"

namespace rattan {

namespace {

constexpr double kLinearTolerance = 1e-6;
constexpr double kGradientTolerance = 1e-6;
constexpr int kMaxNewtonSteps = 60;

// The finest level in memory, in double; vectors are flat arrays of reals.
template <class Block>
class Reference {
 public:
  using Ops = BlockOps<Block>;
  static constexpr std::size_t kReals = Ops::kReals;
  using Vector = std::vector<double>;

  Reference(Store& store, const TileLayout& layout, const HaloFields& halo,
            const SystemFields<Block>& fields, double penalty)
      : n_(layout.node_count), penalty_(penalty) {
    SystemLevel<Block> level;
    Level links;
    links.layout = layout;
    links.store = &store;
    links.halo = halo;
    level.level = &links;
    level.finest = &fields;
    level.store = &store;
    level.row_begin = fields.row_begin;
    level.neighbor = fields.neighbor;
    level.coefficient = fields.coefficient;
    row_begin_.push_back(0);
    for (std::uint32_t t = 0; t < layout.tile_count(); ++t) {
      TileSystem<Block> tile;
      tile.load(level, TileId(t));
      const auto halo_ids = read(store, halo.halo_ids, TileId(t));
      for (std::uint32_t i = 0; i < tile.extent.owned; ++i) {
        for (std::uint32_t e = tile.row_begin[i]; e < tile.row_begin[i + 1]; ++e) {
          const std::uint32_t j = tile.neighbor[e];
          neighbor_.push_back(j < tile.extent.owned ? tile.extent.first + j
                                                    : halo_ids[j - tile.extent.owned]);
          coefficient_.push_back(tile.coefficient[e]);
        }
        row_begin_.push_back(neighbor_.size());
        double anchored = tile.fit_of(i);
        for (std::size_t part = 0; part < Ops::kParts; ++part) {
          diagonal_.push_back(static_cast<double>(tile.stiffness(i, part)) + tile.fit_of(i));
          anchored += diagonal_.back() - tile.diagonal[i] - tile.fit_of(i);
        }
        fit_.push_back(anchored);
        const Value<Block> b = tile.rhs_of(i);
        for (std::size_t k = 0; k < kReals; ++k) {
          rhs_.push_back(reals<Block>(b)[k]);
        }
      }
    }
    find_components();
  }

  SolveReport solve(const SolveOptions& options) {
    SolveReport report;
    report.unknowns = n_ * kReals;
    x_.assign(n_ * kReals, 0.0);
    if constexpr (!Ops::kPeriodic) {
      remove_means(rhs_);
    }
    // The locked values move to the right-hand side: solve for the difference.
    Vector b(rhs_.size());
    if constexpr (Ops::kPeriodic) {
      for (std::uint64_t i = 0; i < n_; ++i) {
        if (locked_[i] != 0) {
          for (std::size_t k = 0; k < kReals; k += 2) {
            x_[i * kReals + k] = 1.0;
          }
        }
      }
    }
    multiply(x_, nullptr, b);
    for (std::size_t k = 0; k < b.size(); ++k) {
      b[k] = rhs_[k] - b[k];
    }
    Vector step;
    report.iterations += conjugate_gradients(nullptr, b, kLinearTolerance, step);
    for (std::size_t k = 0; k < x_.size(); ++k) {
      x_[k] += step[k];
    }
    if constexpr (Ops::kPeriodic) {
      normalise_parts();
      if (options.penalty > 0.0F) {
        locked_.assign(n_, 0);  // the penalty anchors every component by itself
        newton(report);
      }
    } else {
      remove_means(x_);
    }
    report.passes = report.iterations;
    return report;
  }

  void store_solution(Store& store, const TileLayout& layout, const HaloFields& halo,
                      Field<Value<Block>> field, HaloBoard<Value<Block>>& board) const {
    board.assign(layout.border_count, zero_value<Block>());
    for (std::uint32_t t = 0; t < layout.tile_count(); ++t) {
      const TileExtent& e = layout.tiles[t];
      std::vector<Value<Block>> values(e.owned);
      for (std::uint64_t i = 0; i < e.owned; ++i) {
        for (std::size_t k = 0; k < kReals; ++k) {
          reals<Block>(values[i])[k] = static_cast<float>(x_[(e.first + i) * kReals + k]);
        }
      }
      const auto border = read(store, halo.border, TileId(t));
      publish_border<Value<Block>>(values, border.span(), e.border_first, board);
      write(store, field, TileId(t), values);
    }
  }

 private:
  void find_components() {
    std::vector<std::uint64_t> up(n_);
    std::iota(up.begin(), up.end(), std::uint64_t{0});
    const auto root = [&](std::uint64_t i) {
      while (up[i] != i) {
        up[i] = up[up[i]];
        i = up[i];
      }
      return i;
    };
    for (std::uint64_t i = 0; i < n_; ++i) {
      for (std::uint64_t e = row_begin_[i]; e < row_begin_[i + 1]; ++e) {
        const std::uint64_t a = root(i);
        const std::uint64_t b = root(neighbor_[e]);
        up[std::max(a, b)] = std::min(a, b);
      }
    }
    component_.resize(n_);
    std::vector<double> fit(n_, 0.0);
    for (std::uint64_t i = 0; i < n_; ++i) {
      component_[i] = root(i);
      fit[component_[i]] += fit_[i];
    }
    locked_.assign(n_, 0);
    for (std::uint64_t i = 0; i < n_; ++i) {
      locked_[i] = component_[i] == i && !(fit[i] > 0.0) ? 1 : 0;
    }
  }

  // out = (D - C) x, plus half the penalty's Hessian at `at`.
  void multiply(const Vector& x, const Vector* at, Vector& out) const {
    out.resize(x.size());
    parallel_indices(n_, [&](std::size_t i) {
      std::array<double, kReals> row{};
      for (std::uint64_t e = row_begin_[i]; e < row_begin_[i + 1]; ++e) {
        Ops::apply_add(coefficient_[e], &x[neighbor_[e] * kReals], row.data());
      }
      for (std::size_t k = 0; k < kReals; ++k) {
        const std::size_t at_k = i * kReals + k;
        out[at_k] = diagonal_[i * Ops::kParts + part_of<Block>(k)] * x[at_k] - row[k];
        if (Ops::kPeriodic && at != nullptr) {
          const std::size_t part = i * kReals + (k & ~std::size_t{1});
          const double* u = at->data() + part;
          const double norm2 = u[0] * u[0] + u[1] * u[1];
          const double along = u[0] * x[part] + u[1] * x[part + 1];
          out[at_k] += penalty_ * (2.0 * (norm2 - 1.0) * x[at_k] + 4.0 * along * u[k & 1U]);
        }
      }
    });
  }

  double inner(const Vector& a, const Vector& b) const {
    return parallel_sum(a.size(), 0.0, [&](std::size_t begin, std::size_t end) {
      double sum = 0.0;
      for (std::size_t k = begin; k < end; ++k) {
        sum += a[k] * b[k];
      }
      return sum;
    });
  }

  void clear_locked(Vector& v) const {
    for (std::uint64_t i = 0; i < n_; ++i) {
      if (locked_[i] != 0) {
        std::fill_n(v.begin() + static_cast<std::ptrdiff_t>(i * kReals), kReals, 0.0);
      }
    }
  }

  // Jacobi-preconditioned; stops at negative curvature with what it has (Steihaug).
  std::uint64_t conjugate_gradients(const Vector* at, Vector r, double tolerance, Vector& x) const {
    clear_locked(r);
    x.assign(r.size(), 0.0);
    Vector inverse(r.size());
    for (std::size_t k = 0; k < r.size(); ++k) {
      double d = diagonal_[k * Ops::kParts / kReals];
      if (Ops::kPeriodic && at != nullptr) {
        d += 2.0 * penalty_;  // of the order of the penalty's curvature at unit norm
      }
      inverse[k] = d > 0.0 ? 1.0 / d : 1.0;
    }
    const auto scaled = [&](Vector& z) {
      parallel_indices(r.size(), [&](std::size_t k) { z[k] = inverse[k] * r[k]; });
    };
    Vector z(r.size());
    Vector q;
    scaled(z);
    Vector p = z;
    double rz = inner(r, z);
    const double goal = tolerance * tolerance * inner(r, r);
    std::uint64_t iterations = 0;
    const std::uint64_t limit = 200 + 20 * n_;
    while (inner(r, r) > goal && iterations < limit) {
      multiply(p, at, q);
      clear_locked(q);
      const double pq = inner(p, q);
      if (!(pq > 0.0)) {
        if (iterations == 0) {
          x = p;
        }
        break;
      }
      const double alpha = rz / pq;
      parallel_indices(r.size(), [&](std::size_t k) {
        x[k] += alpha * p[k];
        r[k] -= alpha * q[k];
      });
      scaled(z);
      const double next = inner(r, z);
      const double beta = next / rz;
      parallel_indices(r.size(), [&](std::size_t k) { p[k] = z[k] + beta * p[k]; });
      rz = next;
      ++iterations;
    }
    return iterations;
  }

  void newton(SolveReport& report) {
    Vector g;
    Vector step;
    Vector product;
    for (int iteration = 0; iteration < kMaxNewtonSteps; ++iteration) {
      multiply(x_, nullptr, g);
      for (std::size_t part = 0; part < x_.size(); part += 2) {
        const double excess = x_[part] * x_[part] + x_[part + 1] * x_[part + 1] - 1.0;
        for (std::size_t k = part; k < part + 2; ++k) {
          g[k] = rhs_[k] - g[k] - 2.0 * penalty_ * excess * x_[k];
        }
      }
      clear_locked(g);
      const double norm = std::sqrt(inner(g, g));
      if (norm < kGradientTolerance * std::sqrt(static_cast<double>(n_))) {
        break;
      }
      const double forcing = std::min(0.1, std::sqrt(norm / static_cast<double>(n_)));
      report.iterations += conjugate_gradients(&x_, g, forcing, step);
      multiply(step, nullptr, product);
      Quartic line;
      line.c1 = -2.0 * inner(g, step);
      line.c2 = inner(step, product);
      for (std::size_t k = 0; k < x_.size(); k += 2) {
        const double a = x_[k] * x_[k] + x_[k + 1] * x_[k + 1] - 1.0;
        const double b = 2.0 * (x_[k] * step[k] + x_[k + 1] * step[k + 1]);
        const double c = step[k] * step[k] + step[k + 1] * step[k + 1];
        line.c2 += penalty_ * (b * b + 2.0 * a * c);
        line.c3 += penalty_ * 2.0 * b * c;
        line.c4 += penalty_ * c * c;
      }
      const double length = descend(line);
      if (!(length > 0.0)) {
        break;
      }
      for (std::size_t k = 0; k < x_.size(); ++k) {
        x_[k] += length * step[k];
      }
    }
  }

  void normalise_parts() {
    for (std::size_t k = 0; k < x_.size(); k += 2) {
      const double norm = std::sqrt(x_[k] * x_[k] + x_[k + 1] * x_[k + 1]);
      x_[k] = norm > 0.0 ? x_[k] / norm : 1.0;
      x_[k + 1] = norm > 0.0 ? x_[k + 1] / norm : 0.0;
    }
  }

  // On components whose constants are in the kernel.
  void remove_means(Vector& v) const {
    Vector sums(v.size(), 0.0);
    std::vector<double> count(n_, 0.0);
    for (std::uint64_t i = 0; i < n_; ++i) {
      count[component_[i]] += 1.0;
      for (std::size_t k = 0; k < kReals; ++k) {
        sums[component_[i] * kReals + k] += v[i * kReals + k];
      }
    }
    for (std::uint64_t i = 0; i < n_; ++i) {
      const std::uint64_t c = component_[i];
      for (std::size_t k = 0; k < kReals && locked_[c] != 0; ++k) {
        v[i * kReals + k] -= sums[c * kReals + k] / count[c];
      }
    }
  }

  std::uint64_t n_;
  double penalty_;
  std::vector<std::uint64_t> row_begin_, neighbor_, component_;
  std::vector<Coefficient<Block>> coefficient_;
  std::vector<double> diagonal_, fit_;
  Vector rhs_, x_;
  std::vector<char> locked_;
};

}  // namespace

template <class Block>
SolveReport solve_reference(Store& store, const TileLayout& layout, const HaloFields& halo,
                            const SystemFields<Block>& system, const SolveOptions& options,
                            TaskGraph& tasks) {
  Reference<Block> reference(store, layout, halo, system,
                             BlockOps<Block>::kPeriodic ? options.penalty : 0.0F);
  SolveReport report = reference.solve(options);
  Level links;
  links.layout = layout;
  links.store = &store;
  links.halo = halo;
  SystemLevel<Block> level;
  level.level = &links;
  level.finest = &system;
  level.store = &store;
  level.row_begin = system.row_begin;
  level.neighbor = system.neighbor;
  level.coefficient = system.coefficient;
  level.solution = system.solution;
  reference.store_solution(store, layout, halo, system.solution, level.board);
  if constexpr (BlockOps<Block>::kPeriodic) {
    if (options.unit_norm) {
      settle_at_unit_norm(level, tasks, options.norms);
      ++report.passes;
    }
  }
  finish_solve(level, store, options, {}, true, report, tasks);
  return report;
}

#define RATTAN_INSTANTIATE(Block)                                                       \
  template SolveReport solve_reference(Store&, const TileLayout&, const HaloFields&,    \
                                       const SystemFields<Block>&, const SolveOptions&, \
                                       TaskGraph&);
RATTAN_FOR_EACH_BLOCK(RATTAN_INSTANTIATE)
#undef RATTAN_INSTANTIATE

}  // namespace rattan
