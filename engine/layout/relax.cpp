// SPDX-License-Identifier: MIT
// Based on A. Khodakovsky, N. Litke, P. Schroeder, "Globally smooth parameterizations with low
// distortion", 2003. They relax all vertices over charts that grow; here the inside of a chart is
// solved for at once, and only what charts share moves in rounds.
#include "engine/layout/relax.h"

#include <algorithm>
#include <cmath>

#include "engine/core/errors.h"
#include "engine/layout/mean_value.h"

namespace rattan {
namespace {

/// How much of the way a round goes: points along a strand move at once, and would overshoot.
constexpr double kStep = 0.8;

/// How far along a side of [0, size]^2 a place is.
double along_side(const Vec2d& uv, std::uint32_t side, double size) {
  switch (side) {
    case 0:
      return uv.x();
    case 1:
      return uv.y();
    case 2:
      return size - uv.x();
    default:
      return size - uv.y();
  }
}

bool on_side(const Vec2d& uv, std::uint32_t side, double size) {
  switch (side) {
    case 0:
      return uv.y() == 0;
    case 1:
      return uv.x() == size;
    case 2:
      return uv.y() == size;
    default:
      return uv.x() == 0;
  }
}

/// A side of a part's square that lies on a side of the chart.
struct PartSide {
  std::uint32_t part = 0;
  std::uint32_t side = 0;
  double begin = 0;  ///< where on the chart's dart it begins, in units
};

struct Place {
  double at = 0;
  double sum = 0;
  double weight = 0;
};

/// The texture vertices of one part in the order of their triangles' corners.
struct PartCorners {
  std::vector<std::uint32_t> begin;
  std::vector<std::uint32_t> corner;
};

PartCorners corners_of(const FlatChart& chart, std::uint32_t part) {
  const std::uint32_t first = chart.part_uv_begin[part];
  PartCorners c;
  c.begin.assign(chart.part_uv_begin[part + 1] - first + 2, 0);
  for (std::uint32_t t = chart.part_begin[part]; t < chart.part_begin[part + 1]; ++t) {
    for (const std::uint32_t v : chart.triangle[t]) {
      ++c.begin[v - first + 2];
    }
  }
  for (std::size_t v = 2; v < c.begin.size(); ++v) {
    c.begin[v] += c.begin[v - 1];
  }
  c.corner.resize(c.begin.back());
  for (std::uint32_t t = chart.part_begin[part]; t < chart.part_begin[part + 1]; ++t) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      c.corner[c.begin[chart.triangle[t][k] - first + 1]++] = 3 * t + k;
    }
  }
  return c;
}

class WishReader {
 public:
  WishReader(const FlatChart& chart, std::uint32_t units)
      : chart_(chart), size_(chart.kind == ChartKind::kSplit ? 1 : units) {
    for (std::uint32_t p = 0; p + 1 < chart.part_begin.size(); ++p) {
      corners_.push_back(corners_of(chart, p));
    }
  }

  /// Adds the vertices of one side of a part, ends included.
  void read(const PartSide& s, std::vector<Place>& places) {
    for (std::uint32_t u = chart_.part_uv_begin[s.part]; u < chart_.part_uv_begin[s.part + 1];
         ++u) {
      if (!on_side(chart_.uv[u], s.side, size_)) {
        continue;
      }
      Place place;
      place.at = s.begin + along_side(chart_.uv[u], s.side, size_);
      if (place.at != std::floor(place.at)) {
        read_neighbours(s, u, place);
      }
      places.push_back(place);
    }
  }

 private:
  void read_neighbours(const PartSide& s, std::uint32_t u, Place& place) {
    const PartCorners& corners = corners_[s.part];
    const std::uint32_t local = u - chart_.part_uv_begin[s.part];
    const Vec3d& q = chart_.position[chart_.uv_vertex[u]];
    double longest = 0;
    const auto each_edge = [&](const auto& f) {
      for (std::uint32_t i = corners.begin[local]; i < corners.begin[local + 1]; ++i) {
        const auto& t = chart_.triangle[corners.corner[i] / 3];
        const std::uint32_t k = corners.corner[i] % 3;
        const std::array<std::uint32_t, 2> to{t[(k + 1) % 3], t[(k + 2) % 3]};
        const Vec3d a = chart_.position[chart_.uv_vertex[to[0]]] - q;
        const Vec3d b = chart_.position[chart_.uv_vertex[to[1]]] - q;
        f(to, a, b);
      }
    };
    each_edge([&](const auto& /*to*/, const Vec3d& a, const Vec3d& b) {
      longest = std::max({longest, a.norm(), b.norm()});
    });
    each_edge([&](const auto& to, const Vec3d& a, const Vec3d& b) {
      const double tangent = layout::half_tangent(a, b);
      const std::array<double, 2> weight{tangent / layout::relative_length(a, longest),
                                         tangent / layout::relative_length(b, longest)};
      for (std::size_t e = 0; e < 2; ++e) {
        place.sum += weight[e] * (s.begin + along_side(chart_.uv[to[e]], s.side, size_));
        place.weight += weight[e];
      }
    });
    // Both charts' shares are added up, so they must be in one unit of length.
    const double scale = longest > 0 ? 1 / longest : 1.0;
    place.sum *= scale;
    place.weight *= scale;
  }

  const FlatChart& chart_;
  double size_;
  std::vector<PartCorners> corners_;
};

}  // namespace

std::vector<StrandWish> rim_wishes(const FlatChart& chart, const ChartGraph& graph) {
  const std::uint32_t sides = graph.sides(chart.chart);
  const std::uint32_t units = graph.units;
  WishReader reader(chart, units);
  std::vector<StrandWish> wishes;
  std::uint32_t side = 0;
  for (const std::uint32_t dart : graph.ring(chart.chart)) {
    const ChartStrand& strand = graph.strands[dart >> 1];
    const double length = strand.parts * units;
    std::vector<Place> places;
    for (std::uint32_t i = 0; i < strand.parts; ++i, ++side) {
      const double begin = i * units;
      if (chart.kind != ChartKind::kSplit) {
        reader.read({0, side, begin}, places);
      } else {
        reader.read({side, 0, begin}, places);
        reader.read({(side + 1) % sides, 3, begin + 1}, places);
      }
    }
    std::sort(places.begin(), places.end(),
              [](const Place& a, const Place& b) { return a.at < b.at; });
    // Ends of sides came twice.
    places.erase(std::unique(places.begin(), places.end(),
                             [](const Place& a, const Place& b) { return a.at == b.at; }),
                 places.end());
    if ((dart & 1U) != 0) {
      std::reverse(places.begin(), places.end());
      for (Place& p : places) {
        p.at = length - p.at;
        p.sum = p.weight * length - p.sum;
      }
    }
    StrandWish wish;
    wish.strand = dart >> 1;
    for (const Place& p : places) {
      wish.at.push_back(p.at);
      wish.sum.push_back(p.sum);
      wish.weight.push_back(p.weight);
    }
    wishes.push_back(std::move(wish));
  }
  return wishes;
}

StrandRelaxation::StrandRelaxation(const ChartGraph& graph)
    : moves_(graph.strands.size(), 0),
      touches_(graph.chart_count(), 0),
      points_(graph.strands.size()) {
  const auto repaired = [&](std::uint32_t chart) {
    return graph.chart_singular[chart] != 0 || graph.sides(chart) != 4;
  };
  for (std::size_t s = 0; s < graph.strands.size(); ++s) {
    const ChartStrand& strand = graph.strands[s];
    if (!strand.boundary() && (repaired(strand.chart[0]) || repaired(strand.chart[1]))) {
      moves_[s] = 1;
      touches_[strand.chart[0]] = 1;
      touches_[strand.chart[1]] = 1;
    }
  }
}

void StrandRelaxation::add(std::span<const StrandWish> wishes) {
  for (const StrandWish& w : wishes) {
    if (moves_[w.strand] == 0) {
      continue;
    }
    Points& p = points_[w.strand];
    if (p.added++ == 0) {
      p.at = w.at;
      p.sum = w.sum;
      p.weight = w.weight;
      continue;
    }
    ensure(p.at == w.at, "Both charts of a strand have the same parameters along it");
    for (std::size_t i = 0; i < p.at.size(); ++i) {
      p.sum[i] += w.sum[i];
      p.weight[i] += w.weight[i];
    }
  }
}

double StrandRelaxation::end_round() {
  double most = 0;
  for (std::size_t s = 0; s < points_.size(); ++s) {
    if (moves_[s] == 0) {
      continue;
    }
    Points& p = points_[s];
    ensure(p.added == 2, "Both charts of a strand are relaxed");
    for (std::size_t i = 0; i < p.at.size(); ++i) {
      if (p.weight[i] > 0) {
        const double move = kStep * (p.sum[i] / p.weight[i] - p.at[i]);
        most = std::max(most, std::abs(move));
        p.at[i] += move;
      }
    }
    p.sum = {};
    p.weight = {};
    p.added = 0;
  }
  return most;
}

layout::GivenParameters StrandRelaxation::given() const {
  return [this](std::uint32_t strand) { return std::span<const double>(points_[strand].at); };
}

}  // namespace rattan
