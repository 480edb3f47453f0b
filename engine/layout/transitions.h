// SPDX-License-Identifier: MIT
#pragma once

// How the parts of a layout meet: the transition functions of the global parameterization
// (PGP 3.3), quarter turns followed by integer translations.
//
// A part is a square [0, L]^2 (see FlatChart): a whole chart with L = units, or a corner's share of
// a split chart with L = 1. Its sides go counter-clockwise: 0 from (0, 0) to (L, 0), 1 to (L, L), 2
// to (0, L), 3 back to (0, 0). Each side is L unit sides long, counted in its own direction. The
// point p_a of part a on a unit side that is glued to one of part b has there the coordinates
//
//   p_b = R^turn p_a + (s, t),   R (x, y) = (-y, x).
//
// The function holds for the whole part: applied to all of part a it lays it beside part b.

#include <cstdint>
#include <vector>

#include "engine/core/types.h"
#include "engine/layout/chart_graph.h"

namespace rattan {

/// Parts meet there inside a split chart.
inline constexpr std::uint32_t kNoStrand = 0xffffffffU;

struct LayoutPart {
  std::uint32_t chart = 0;
  /// Of the chart's corners, counted from where its first side begins: the one at (0, 0).
  std::uint32_t corner = 0;
  bool split = false;  ///< one of several parts, L = 1
};

struct UnitSide {
  std::uint32_t part = 0;
  std::uint8_t side = 0;  ///< 0 to 3
  std::uint8_t unit = 0;  ///< 0 to L - 1, along the side

  friend bool operator==(const UnitSide&, const UnitSide&) = default;
};

/// A unit side of part a is one of part b, run through backwards. Both may be the same part.
struct Transition {
  UnitSide a;
  UnitSide b;
  std::uint32_t strand = kNoStrand;
  std::uint8_t turn = 0;  ///< 0 to 3
  std::int32_t s = 0;
  std::int32_t t = 0;

  /// From coordinates of part a to those of part b.
  Vec2d operator()(const Vec2d& p) const {
    const double x = turn == 0 ? p[0] : turn == 1 ? -p[1] : turn == 2 ? -p[0] : p[1];
    const double y = turn == 0 ? p[1] : turn == 1 ? p[0] : turn == 2 ? -p[1] : -p[0];
    return {x + s, y + t};
  }
  Transition inverse() const;
};

/// A unit side on the scan's boundary.
struct BoundarySide {
  UnitSide side;
  std::uint32_t strand = kNoStrand;
};

/// Every unit side of every part is in one transition, as a or as b, or on the boundary.
struct Transitions {
  std::uint32_t units = 1;        ///< L of parts that are whole charts
  std::vector<LayoutPart> parts;  ///< in the order of charts; LayoutChart::first_part counts so
  std::vector<Transition> pairs;  ///< by strand, along it (a has it on its left); then by chart
  std::vector<BoundarySide> boundary;  ///< by strand, along it
};

/// Memory: of the size of the layout. Throws InternalError for a graph whose strands don't lie once
/// on either side in the rings of the charts they name.
Transitions transitions_of(const ChartGraph& graph);

}  // namespace rattan
