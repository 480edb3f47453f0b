// SPDX-License-Identifier: MIT
#include "engine/layout/transitions.h"

#include <array>
#include <utility>

#include "engine/core/errors.h"

namespace rattan {
namespace {

constexpr std::uint32_t kNoPart = 0xffffffffU;

std::array<std::int32_t, 2> turned(std::uint32_t turn, std::array<std::int32_t, 2> p) {
  for (std::uint32_t i = 0; i < turn; ++i) {
    p = {-p[1], p[0]};
  }
  return p;
}

/// Where a unit side begins.
std::array<std::int32_t, 2> start_of(const UnitSide& u, std::int32_t length) {
  const std::int32_t along = u.unit;
  switch (u.side) {
    case 0:
      return {along, 0};
    case 1:
      return {length, along};
    case 2:
      return {length - along, length};
    default:
      return {0, length - along};
  }
}

Transition glue(const UnitSide& a, std::int32_t length_a, const UnitSide& b, std::int32_t length_b,
                std::uint32_t strand) {
  Transition out;
  out.a = a;
  out.b = b;
  out.strand = strand;
  // Side k runs in the direction R^k (1, 0); glued ones run against each other.
  out.turn = static_cast<std::uint8_t>((b.side + 6U - a.side) % 4U);
  // Where the side of a begins that of b ends, a unit along it.
  const auto begin_b = start_of(b, length_b);
  const auto along_b = turned(b.side, {1, 0});
  const auto moved_a = turned(out.turn, start_of(a, length_a));
  out.s = begin_b[0] + along_b[0] - moved_a[0];
  out.t = begin_b[1] + along_b[1] - moved_a[1];
  return out;
}

class Gluing {
 public:
  explicit Gluing(const ChartGraph& graph) : graph_(graph) { out_.units = graph.units; }

  Transitions run() {
    ensure(graph_.units == 1 || graph_.units == 2, "a chart side has one unit or two");
    place_darts();
    for (std::uint32_t chart = 0; chart < graph_.chart_count(); ++chart) {
      walk_ring(chart);
    }
    for (std::uint32_t s = 0; s < graph_.strands.size(); ++s) {
      join_strand(s);
    }
    for (const auto& [first, sides] : split_) {
      join_inside(first, sides);
    }
    return std::move(out_);
  }

 private:
  /// Unit sides of a dart are stored together, in its direction.
  void place_darts() {
    dart_begin_.reserve(2 * graph_.strands.size() + 1);
    std::uint64_t at = 0;
    for (const ChartStrand& strand : graph_.strands) {
      for (int direction = 0; direction < 2; ++direction) {
        dart_begin_.push_back(at);
        at += std::uint64_t{strand.parts} * graph_.units;
      }
    }
    dart_begin_.push_back(at);
    sides_.assign(at, UnitSide{kNoPart, 0, 0});
  }

  void walk_ring(std::uint32_t chart) {
    const std::uint32_t n = graph_.sides(chart);
    const auto first = static_cast<std::uint32_t>(out_.parts.size());
    const bool split = n != 4;
    ensure(n > 0 && (!split || graph_.units == 2),
           "sides of layouts with split charts have two units");
    for (std::uint32_t corner = 0; corner < (split ? n : 1U); ++corner) {
      out_.parts.push_back({chart, corner, split});
    }
    if (split) {
      split_.emplace_back(first, n);
    }
    std::uint32_t at = 0;  // unit sides around the chart
    for (const std::uint32_t dart : graph_.ring(chart)) {
      ensure(graph_.strands[dart >> 1].chart[dart & 1U] == chart,
             "a chart's ring holds darts that have it on their left");
      for (std::uint64_t i = dart_begin_[dart]; i < dart_begin_[dart + 1]; ++i, ++at) {
        const std::uint32_t side = at / graph_.units;
        const std::uint32_t unit = at % graph_.units;
        ensure(sides_[i].part == kNoPart, "a dart is in one ring, once");
        if (!split) {
          sides_[i] = {first, static_cast<std::uint8_t>(side), static_cast<std::uint8_t>(unit)};
        } else if (unit == 0) {  // from the corner at the origin to the middle at (1, 0)
          sides_[i] = {first + side, 0, 0};
        } else {  // from the middle at (0, 1) to the next corner
          sides_[i] = {first + (side + 1) % n, 3, 0};
        }
      }
    }
  }

  std::int32_t length(const UnitSide& u) const {
    return out_.parts[u.part].split ? 1 : static_cast<std::int32_t>(graph_.units);
  }

  void join_strand(std::uint32_t s) {
    const std::uint64_t begin = dart_begin_[2 * std::size_t{s}];
    const std::uint64_t back = dart_begin_[2 * std::size_t{s} + 1];
    const std::uint64_t count = back - begin;
    for (std::uint64_t i = 0; i < count; ++i) {
      const UnitSide& a = sides_[begin + i];
      const UnitSide& b = sides_[back + count - 1 - i];
      ensure(a.part != kNoPart && (b.part == kNoPart) == graph_.strands[s].boundary(),
             "either side of a strand is in the ring of its chart");
      if (b.part == kNoPart) {
        out_.boundary.push_back({a, s});
      } else {
        out_.pairs.push_back(glue(a, length(a), b, length(b), s));
      }
    }
  }

  /// From the middle of each side to the centre: side 1 of a part is side 2 of the next.
  void join_inside(std::uint32_t first, std::uint32_t n) {
    for (std::uint32_t i = 0; i < n; ++i) {
      out_.pairs.push_back(glue({first + i, 1, 0}, 1, {first + (i + 1) % n, 2, 0}, 1, kNoStrand));
    }
  }

  const ChartGraph& graph_;
  Transitions out_;
  std::vector<std::uint64_t> dart_begin_;
  std::vector<UnitSide> sides_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> split_;  // first part, sides
};

}  // namespace

Transition Transition::inverse() const {
  Transition out = *this;
  std::swap(out.a, out.b);
  out.turn = static_cast<std::uint8_t>((4U - turn) % 4U);
  const auto back = turned(out.turn, {s, t});
  out.s = -back[0];
  out.t = -back[1];
  return out;
}

Transitions transitions_of(const ChartGraph& graph) {
  return Gluing(graph).run();
}

}  // namespace rattan
