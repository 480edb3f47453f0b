// SPDX-License-Identifier: MIT
#include "engine/layout/divide_sides.h"

#include <algorithm>
#include <cmath>

#include "engine/core/errors.h"
#include "engine/layout/colours.h"
#include "engine/layout/disk_sides.h"
#include "engine/layout/strand_parameters.h"

namespace rattan::layout {
namespace {

/// The sides of triangles on the rim. What is left of one after cutting pieces off its front stays
/// in its place.
struct Rim {
  std::vector<std::uint32_t> side;   ///< counter-clockwise
  std::vector<std::uint32_t> start;  ///< their first vertices before any was cut
  std::vector<std::uint32_t>
      place;  ///< one a side of the chart's triangles as they came: in `side`
};

std::uint32_t start_of(const ChartMesh& mesh, std::uint32_t side) {
  return mesh.triangle[side / 3][side % 3];
}

/// Where in the rim the first dart of the ring begins.
std::uint32_t first_place(const ChartMesh& mesh, const ChartGraph& graph,
                          const std::vector<std::uint32_t>& rim) {
  const std::span<const std::uint32_t> ring = graph.ring(mesh.chart);
  ensure(!ring.empty(), "A chart has sides");
  const std::uint32_t dart = ring.front();
  const ChartStrand& strand = graph.strands[dart >> 1];
  const auto n = static_cast<std::uint32_t>(rim.size());
  std::uint32_t best = kNoSide;
  for (std::uint32_t i = 0; i < n; ++i) {
    if (mesh.dart[rim[i] / 3][rim[i] % 3] != dart) {
      continue;
    }
    const std::uint64_t number = mesh.number[start_of(mesh, rim[i])];
    if (strand.closed()) {
      if (best == kNoSide || number < mesh.number[start_of(mesh, rim[best])]) {
        best = i;
      }
    } else if (const std::uint32_t before = rim[(i + n - 1) % n];
               ring.size() == 1 ? number == graph.node_vertex[strand.node[dart & 1U]]
                                : mesh.dart[before / 3][before % 3] != dart) {
      ensure(best == kNoSide, "A strand runs along a chart once");
      best = i;
    }
  }
  ensure(best != kNoSide, "A chart's first side is on its rim");
  return best;
}

/// Adds the vertex that is `share` of the way along a rim side, from its start.
std::uint32_t add_vertex(ChartMesh& mesh, std::uint64_t number, std::uint32_t from,
                         std::uint32_t to, double share) {
  const auto v = static_cast<std::uint32_t>(mesh.number.size());
  mesh.number.push_back(number);
  mesh.is_node.push_back(0);
  const Vec3d point = mesh.position[from] + share * (mesh.position[to] - mesh.position[from]);
  mesh.position.push_back(point);
  if (!mesh.colour.empty()) {
    const Rgba c = blend(mesh.colour[from], mesh.colour[to], share);
    mesh.colour.push_back(c);
  }
  if (!mesh.unfolded.empty()) {
    const Vec2d uv = mesh.unfolded[from] + share * (mesh.unfolded[to] - mesh.unfolded[from]);
    mesh.unfolded.push_back(uv);
  }
  return v;
}

/// Puts v on the rim side at `place`, `share` of the way along it: a triangle on its first piece is
/// added, the second piece stays in place.
void cut_side(ChartMesh& mesh, Rim& rim, std::uint32_t place, std::uint32_t v, double share) {
  const std::uint32_t side = rim.side[place];
  const std::uint32_t t = side / 3;
  const std::uint32_t k = side % 3;
  const std::uint32_t before = previous_side(side) % 3;
  const auto added = static_cast<std::uint32_t>(mesh.triangle.size());
  const double step = mesh.step[t][k];
  std::array<std::uint32_t, 3> corners = mesh.triangle[t];
  std::array<std::uint32_t, 3> dart = mesh.dart[t];
  std::array<double, 3> steps = mesh.step[t];
  corners[(k + 1) % 3] = v;
  dart[(k + 1) % 3] = kInsideChart;
  steps[(k + 1) % 3] = -1;
  steps[k] = step < 0 ? step : step * share;
  mesh.triangle.push_back(corners);
  mesh.dart.push_back(dart);
  mesh.step.push_back(steps);
  // The side before goes with the new triangle.
  if (dart[before] != kInsideChart) {
    rim.side[rim.place[3 * t + before]] = 3 * added + before;
  }
  mesh.triangle[t][k] = v;
  mesh.dart[t][before] = kInsideChart;
  mesh.step[t][k] = step < 0 ? step : step * (1 - share);
  mesh.step[t][before] = -1;
}

}  // namespace

std::vector<RimVertex> divide_sides(ChartMesh& mesh, const ChartGraph& graph,
                                    const GivenParameters& given) {
  Rim rim;
  rim.side = match_sides(mesh.triangle, mesh.number.size()).rim;
  std::rotate(rim.side.begin(), rim.side.begin() + first_place(mesh, graph, rim.side),
              rim.side.end());
  rim.place.assign(3 * mesh.triangle.size(), kNoSide);
  for (std::uint32_t i = 0; i < rim.side.size(); ++i) {
    rim.place[rim.side[i]] = i;
    rim.start.push_back(start_of(mesh, rim.side[i]));
  }
  std::vector<RimVertex> result;
  result.reserve(rim.side.size() + 8);
  const std::uint32_t units = graph.units;
  std::uint32_t first_side = 0;
  std::uint32_t begin = 0;
  std::vector<std::uint32_t> chain;
  std::vector<Vec3d> position;
  std::vector<double> step;
  for (const std::uint32_t dart : graph.ring(mesh.chart)) {
    const ChartStrand& strand = graph.strands[dart >> 1];
    const bool reversed = (dart & 1U) != 0;
    chain.clear();
    position.clear();
    step.clear();
    std::uint32_t end = begin;
    for (; end < rim.side.size(); ++end) {
      const std::uint32_t side = rim.side[end];
      if (mesh.dart[side / 3][side % 3] != dart) {
        break;
      }
      chain.push_back(rim.start[end]);
      step.push_back(mesh.step[side / 3][side % 3]);
    }
    ensure(end > begin, "A chart's sides are on its rim in order");
    chain.push_back(rim.start[end % rim.start.size()]);
    if (!strand.closed()) {
      ensure(mesh.number[chain.front()] == graph.node_vertex[strand.node[dart & 1U]] &&
                 mesh.number[chain.back()] == graph.node_vertex[strand.node[1 - (dart & 1U)]],
             "A chart's sides begin and end at nodes");
    }
    for (const std::uint32_t v : chain) {
      position.push_back(mesh.position[v]);
    }
    if (reversed) {
      std::reverse(position.begin(), position.end());
      std::reverse(step.begin(), step.end());
    }
    const std::vector<StrandPoint> points = strand_parameters(
        position, step, strand.parts, units, given ? given(dart >> 1) : std::span<const double>());
    const auto last = static_cast<std::uint32_t>(chain.size() - 1);
    const double length = strand.parts * units;
    const std::uint64_t number =
        graph.first_division + graph.division_begin[dart >> 1] - (strand.closed() ? 0 : 1);
    double cut_until = 0;  // how much of a rim side is cut off already
    for (std::size_t i = 0; i + 1 < points.size(); ++i) {
      const std::size_t p = reversed ? points.size() - 1 - i : i;
      const StrandPoint& point = points[p];
      const double at = reversed ? length - point.at : point.at;
      std::uint32_t v = 0;
      if (point.made) {
        // The same computation from both charts: from the strand's earlier point to the later one.
        const std::uint32_t at_side = reversed ? last - 1 - point.point : point.point;
        const std::uint32_t from = chain[reversed ? at_side + 1 : at_side];
        const std::uint32_t to = chain[reversed ? at_side : at_side + 1];
        v = add_vertex(mesh, number + static_cast<std::uint64_t>(point.at), from, to, point.share);
        const double share = reversed ? 1 - point.share : point.share;
        cut_side(mesh, rim, begin + at_side, v,
                 std::clamp((share - cut_until) / (1 - cut_until), 0.0, 1.0));
        cut_until = share;
      } else {
        v = chain[reversed ? last - point.point : point.point];
        cut_until = 0;
      }
      const auto side = static_cast<std::uint32_t>(at / units);
      result.push_back(
          {v, first_side + side, at - side * units, dart >> 1, static_cast<std::uint32_t>(p)});
    }
    first_side += strand.parts;
    begin = end;
  }
  ensure(begin == rim.side.size(), "A chart's rim is its sides");
  return result;
}

}  // namespace rattan::layout
