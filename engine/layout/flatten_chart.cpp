// SPDX-License-Identifier: MIT
#include "engine/layout/flatten_chart.h"

#include <algorithm>
#include <utility>

#include "engine/core/errors.h"
#include "engine/layout/colours.h"
#include "engine/layout/disk_sides.h"
#include "engine/layout/split_chart.h"
#include "engine/layout/square_map.h"
#include "engine/layout/strand_parameters.h"

namespace rattan {
namespace {

using layout::FlatDisk;
using layout::MapReport;
using layout::RimVertex;
using layout::StrandPoint;

constexpr std::uint32_t kNoNumber = 0xffffffffU;

/// The place `along` a side of [0, size]^2.
Vec2d on_square(std::uint32_t side, double along, double size) {
  switch (side) {
    case 0:
      return {along, 0.0};
    case 1:
      return {size, along};
    case 2:
      return {size - along, size};
    default:
      return {0.0, size - along};
  }
}

/// Adds vertices made half-way between two, by their numbers in `disk`, which `vertex_of` turns
/// into numbers of the chart. Returns the new ones' numbers.
template <class VertexOf>
void add_made(FlatChart& chart, const FlatDisk& disk, const VertexOf& vertex_of,
              std::vector<std::uint32_t>& numbers) {
  for (std::uint32_t i = 0; i < disk.made.size(); ++i) {
    numbers.push_back(static_cast<std::uint32_t>(chart.number.size()));
    chart.number.push_back(kUnnumbered);
    chart.position.push_back(disk.position[disk.given + i]);
    if (!chart.colour.empty()) {
      const Rgba c = layout::blend(chart.colour[vertex_of(disk.made[i][0])],
                                   chart.colour[vertex_of(disk.made[i][1])], 0.5);
      chart.colour.push_back(c);
    }
  }
}

void add_report(FlatChart& chart, const MapReport& report) {
  chart.nudged += report.nudged;
  chart.thin += report.thin;
}

/// The whole chart as one disk on [0, units]^2.
FlatDisk whole_disk(const ChartMesh& mesh, const std::vector<RimVertex>& rim, double size) {
  FlatDisk disk;
  disk.position = mesh.position;
  disk.triangle = mesh.triangle;
  disk.size = size;
  disk.given = static_cast<std::uint32_t>(mesh.position.size());
  disk.fixed.assign(disk.given, 0);
  disk.uv.assign(disk.given, Vec2d::Zero());
  for (const RimVertex& r : rim) {
    disk.fixed[r.vertex] = 1;
    disk.uv[r.vertex] = on_square(r.side, r.along, size);
  }
  return disk;
}

bool unfold(FlatChart& chart, const ChartMesh& mesh, const std::vector<RimVertex>& rim,
            FlatDisk& disk) {
  if (mesh.unfolded.empty()) {
    return false;
  }
  std::vector<Vec2d> moved(disk.given, Vec2d::Zero());
  for (std::uint32_t v = 0; v < disk.given; ++v) {
    if (disk.fixed[v] == 0) {
      disk.uv[v] = disk.size * mesh.unfolded[v];
    }
  }
  for (const RimVertex& r : rim) {
    moved[r.vertex] = disk.uv[r.vertex] - disk.size * mesh.unfolded[r.vertex];
  }
  MapReport report;
  if (!mend_unfolded(disk, moved, report)) {
    return false;
  }
  chart.kind = ChartKind::kUnfolded;
  add_report(chart, report);
  return true;
}

void flatten_whole(FlatChart& chart, const ChartMesh& mesh, const std::vector<RimVertex>& rim,
                   double size) {
  FlatDisk disk = whole_disk(mesh, rim, size);
  if (!unfold(chart, mesh, rim, disk)) {
    disk = whole_disk(mesh, rim, size);
    chart.kind = ChartKind::kFlattened;
    add_report(chart, map_to_square(disk));
  }
  std::vector<std::uint32_t> made;
  add_made(
      chart, disk, [](std::uint32_t v) { return v; }, made);
  chart.uv_vertex.resize(disk.uv.size());
  for (std::uint32_t v = 0; v < chart.uv_vertex.size(); ++v) {
    chart.uv_vertex[v] = v;
  }
  chart.uv = std::move(disk.uv);
  chart.triangle = std::move(disk.triangle);
  chart.part_begin.push_back(static_cast<std::uint32_t>(chart.triangle.size()));
  chart.part_uv_begin.push_back(static_cast<std::uint32_t>(chart.uv.size()));
}

/// How far from the centre along a spoke each of its vertices is, the same for both its parts.
std::vector<double> spoke_parameters(const SplitDisk& split,
                                     const std::vector<std::uint32_t>& spoke) {
  std::vector<Vec3d> position;
  position.reserve(spoke.size());
  for (const std::uint32_t v : spoke) {
    position.push_back(split.position[v]);
  }
  const std::vector<double> no_steps(spoke.size() - 1, -1.0);
  std::vector<double> at;
  at.reserve(spoke.size());
  for (const StrandPoint& p :
       layout::strand_parameters(position, no_steps, 1, 1, {}, layout::kLeastSpokeGap)) {
    at.push_back(p.at);
  }
  return at;
}

struct PlacedVertex {
  std::uint32_t vertex = 0;
  Vec2d uv;
};

/// A part of a split chart with vertices of its own, those of the rim first.
struct PartDisk {
  FlatDisk disk;
  std::vector<std::uint32_t> vertex;  ///< one a vertex of the disk: in the split chart
};

PartDisk cut_out(const SplitDisk& split, std::span<const std::array<std::uint32_t, 3>> triangle,
                 const std::vector<PlacedVertex>& rim, std::vector<std::uint32_t>& number) {
  PartDisk part;
  const auto rim_count = static_cast<std::uint32_t>(rim.size());
  for (std::uint32_t i = 0; i < rim_count; ++i) {
    number[rim[i].vertex] = i;
    part.vertex.push_back(rim[i].vertex);
  }
  part.disk.triangle.assign(triangle.begin(), triangle.end());
  for (auto& t : part.disk.triangle) {
    for (std::uint32_t& v : t) {
      if (number[v] == kNoNumber) {
        number[v] = static_cast<std::uint32_t>(part.vertex.size());
        part.vertex.push_back(v);
      }
      v = number[v];
    }
  }
  const auto count = static_cast<std::uint32_t>(part.vertex.size());
  part.disk.given = count;
  part.disk.fixed.assign(count, 0);
  part.disk.uv.assign(count, Vec2d::Zero());
  for (std::uint32_t i = 0; i < rim_count; ++i) {
    part.disk.fixed[i] = 1;
    part.disk.uv[i] = rim[i].uv;
  }
  for (const std::uint32_t v : part.vertex) {
    part.disk.position.push_back(split.position[v]);
    number[v] = kNoNumber;
  }
  // The rim just placed must be the one that the triangles have.
  const std::vector<std::uint32_t> walked = layout::match_sides(part.disk.triangle, count).rim;
  ensure(walked.size() == rim_count, "A part of a chart lies within its sides and spokes");
  for (const std::uint32_t side : walked) {
    const std::uint32_t from = part.disk.triangle[side / 3][side % 3];
    const std::uint32_t to = part.disk.triangle[side / 3][layout::next_side(side) % 3];
    ensure(from < rim_count && to == (from + 1) % rim_count,
           "A part of a chart lies within its sides and spokes");
  }
  return part;
}

void flatten_split(FlatChart& chart, const ChartMesh& mesh, const std::vector<RimVertex>& rim,
                   std::uint32_t sides) {
  chart.kind = ChartKind::kSplit;
  std::vector<std::uint32_t> corner_at(sides + 1, 0);  // places in the rim
  std::vector<std::uint32_t> middle_at(sides, 0);
  std::vector<std::uint32_t> middles(sides, layout::kNoSide);
  for (std::uint32_t i = 0; i < rim.size(); ++i) {
    if (rim[i].along == 0) {
      corner_at[rim[i].side] = i;
    } else if (rim[i].along == 1) {
      middle_at[rim[i].side] = i;
      middles[rim[i].side] = rim[i].vertex;
    }
  }
  corner_at[sides] = static_cast<std::uint32_t>(rim.size());
  ensure(std::find(middles.begin(), middles.end(), layout::kNoSide) == middles.end(),
         "The sides of a split chart have middles");
  const SplitDisk split = split_disk(mesh.position, mesh.triangle, middles);
  for (std::size_t i = mesh.position.size(); i < split.position.size(); ++i) {
    const SplitDisk::Made& made = split.made[i - mesh.position.size()];
    chart.number.push_back(kUnnumbered);
    chart.position.push_back(split.position[i]);
    if (!chart.colour.empty()) {
      const Rgba c = layout::blend(chart.colour[made.a], chart.colour[made.b], made.share);
      chart.colour.push_back(c);
    }
  }
  chart.centre = split.centre;
  std::vector<std::uint32_t> number(split.position.size(), kNoNumber);
  std::vector<std::vector<double>> spoke_at;
  for (const auto& spoke : split.spokes) {
    spoke_at.push_back(spoke_parameters(split, spoke));
  }
  for (std::uint32_t i = 0; i < sides; ++i) {
    const std::uint32_t before = (i + sides - 1) % sides;
    std::vector<PlacedVertex> around;
    for (std::uint32_t r = corner_at[i]; r < middle_at[i]; ++r) {
      around.push_back({rim[r].vertex, Vec2d(rim[r].along, 0)});
    }
    const std::vector<std::uint32_t>& out = split.spokes[i];
    for (std::size_t s = out.size(); s-- > 0;) {
      around.push_back({out[s], Vec2d(1, 1 - spoke_at[i][s])});
    }
    const std::vector<std::uint32_t>& back = split.spokes[before];
    for (std::size_t s = 1; s < back.size(); ++s) {
      around.push_back({back[s], Vec2d(1 - spoke_at[before][s], 1)});
    }
    for (std::uint32_t r = middle_at[before] + 1; r < corner_at[before + 1]; ++r) {
      around.push_back({rim[r].vertex, Vec2d(0, 2 - rim[r].along)});
    }
    const std::span<const std::array<std::uint32_t, 3>> triangle(
        split.triangle.data() + split.part_begin[i], split.part_begin[i + 1] - split.part_begin[i]);
    PartDisk part = cut_out(split, triangle, around, number);
    add_report(chart, map_to_square(part.disk));
    const std::size_t first = chart.uv.size();
    add_made(
        chart, part.disk, [&](std::uint32_t v) { return part.vertex[v]; }, part.vertex);
    chart.uv_vertex.insert(chart.uv_vertex.end(), part.vertex.begin(), part.vertex.end());
    chart.uv.insert(chart.uv.end(), part.disk.uv.begin(), part.disk.uv.end());
    for (auto t : part.disk.triangle) {
      for (std::uint32_t& v : t) {
        v += static_cast<std::uint32_t>(first);
      }
      chart.triangle.push_back(t);
    }
    chart.part_begin.push_back(static_cast<std::uint32_t>(chart.triangle.size()));
    chart.part_uv_begin.push_back(static_cast<std::uint32_t>(chart.uv.size()));
  }
}

}  // namespace

FlatChart flatten_chart(ChartMesh&& mesh, const ChartGraph& graph, const FlattenOptions& options) {
  const std::vector<RimVertex> rim = layout::divide_sides(mesh, graph, options.given);
  FlatChart chart;
  chart.chart = mesh.chart;
  chart.number = std::move(mesh.number);
  chart.position = mesh.position;
  chart.colour = std::move(mesh.colour);
  const std::uint32_t sides = graph.sides(mesh.chart);
  if (sides == 4) {
    flatten_whole(chart, mesh, rim, graph.units);
  } else {
    ensure(sides >= 3 && graph.units == 2,
           "Charts have three sides at least, halved where some chart has not four");
    flatten_split(chart, mesh, rim, sides);
  }
  return chart;
}

}  // namespace rattan
