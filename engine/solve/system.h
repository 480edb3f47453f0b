// SPDX-License-Identifier: MIT
#pragma once

// The shape that all global problems share: a connection Laplacian on a graph,
//
//   E(x) = sum_{edges ij} w_ij |x_i - T_ij x_j|^2
//        + sum_i ( d_i |x_i|^2 - 2 <b_i, x_i> )
//        + sum_i eps_i sum_c (|x_ic|^2 - 1)^2          (c runs over the block's complex parts)
//
// Row i of the operator holds, for each neighbour j, the coefficient C_ij = w_ij T_ij (T_ij an
// isometry that carries values at j into the gauge of i, so that C_ji is the adjoint of C_ij), and
// the diagonal D_i = sum_j w_ij + d_i. The gradient with respect to x_i is 2 (D_i x_i - sum_j C_ij
// x_j - b_i) + penalty. On coarse levels coefficients are sums of transported fine ones, so |C_ij|
// <= w_ij there. w_ij >= 0 makes the form positive semidefinite.

#include <array>
#include <complex>
#include <cstdint>

#include "engine/core/store.h"

namespace rattan {

using Complex = std::complex<float>;

/// Scalars, T = 1: curl correction.
struct RealBlock {
  using Value = float;
  struct Coefficient {
    float w = 0.0F;
  };
};

/// Three scalars side by side under one scalar operator: low-pass filtering of positions.
struct Triple {
  float x = 0.0F;
  float y = 0.0F;
  float z = 0.0F;
};
struct Real3Block {
  using Value = Triple;
  using Coefficient = RealBlock::Coefficient;
};

/// Directions modulo 2 pi / N as unit complex numbers, T a rotation: field smoothing.
struct ComplexBlock {
  using Value = Complex;
  struct Coefficient {
    Complex c{0.0F, 0.0F};
  };
};

/// (U, V) = (e^{i theta}, e^{i phi}): the periodic parameterization. T first turns by r quarter
/// turns,
///   turn_1(U, V) = (V, conj U),   turn_2 = (conj U, conj V),   turn_3(U, V) = (conj V, U),
/// then multiplies: x_i = (a U', b V') with a = e^{-i delta}, b = e^{-i delta_perp} along the edge
/// i -> j. Adjoints: (0; conj a, conj b), (3; b, conj a), (2; a, b), (1; conj b, a) for r = 0, 1,
/// 2, 3.
struct PairValue {
  Complex u{1.0F, 0.0F};
  Complex v{1.0F, 0.0F};
};
struct PairBlock {
  using Value = PairValue;
  struct Coefficient {
    Complex a{0.0F, 0.0F};
    Complex b{0.0F, 0.0F};
    std::uint32_t r = 0;
  };
};

inline PairValue quarter_turn(const PairValue& x, std::uint32_t r) {
  switch (r & 3U) {
    case 0:
      return x;
    case 1:
      return {x.v, std::conj(x.u)};
    case 2:
      return {std::conj(x.u), std::conj(x.v)};
    default:
      return {std::conj(x.v), x.u};
  }
}

/// Where one system of the finest level lives in the store; one chunk a tile, over owned vertices.
/// `fit` and `rhs` may have an empty name: zeros. `solution` need not exist beforehand.
template <class Block>
struct SystemFields {
  Field<std::uint32_t> row_begin;                  ///< owned + 1 offsets into the half-edges
  Field<std::uint32_t> neighbor;                   ///< tile-local vertex of each half-edge
  Field<typename Block::Coefficient> coefficient;  ///< C_ij of each half-edge
  Field<float> diagonal;                           ///< D_i without d_i: sum_j w_ij
  Field<float> fit;                                ///< d_i
  Field<typename Block::Value> rhs;                ///< b_i
  Field<typename Block::Value> solution;           ///< x_i
  /// Added to D_i, one a complex part; may have an empty name. For rows with edges to themselves.
  Field<std::array<float, 2>> part_diagonal{};
};

}  // namespace rattan
