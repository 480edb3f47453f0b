// SPDX-License-Identifier: MIT
#include "engine/layout/chart_extraction.h"

#include <algorithm>
#include <utility>

#include "engine/core/errors.h"
#include "engine/layout/chart_assembly.h"
#include "engine/layout/chart_fields.h"
#include "engine/layout/chart_numbering.h"
#include "engine/layout/scan_arrangement.h"

namespace rattan {

namespace {

using namespace layout;

/// Points on a scan edge keep so far from its ends and each other.
constexpr double kGap = 0.02;

std::vector<LayoutPoint> records(const std::vector<PieceVertex>& points) {
  std::vector<LayoutPoint> out;
  out.reserve(points.size());
  for (const PieceVertex& p : points) {
    out.push_back({p.position, p.colour});
  }
  return out;
}

}  // namespace

std::optional<ChartLayout> extract_charts(Store& store, const ScanMesh& mesh,
                                          const ArrangementOptions& options, bool cut,
                                          TaskGraph& graph, ChartExtraction& report) {
  ArrangementOptions spaced = options;
  spaced.gap = kGap;
  spaced.most_sides = kManyChartSides;
  ScanArrangement arrangement(store, mesh, spaced, graph, report.lines);
  Skeleton skeleton = arrangement.stitched();
  const ScanArrangement::NotDisks not_disks = ScanArrangement::not_disks(skeleton, kManyChartSides);
  report.not_disks = not_disks.faces;
  report.cuts = not_disks.cuts;
  report.crowded = not_disks.crowded;
  report.excess = not_disks.excess;
  if (report.not_disks + report.crowded > 0 && !cut) {
    return std::nullopt;
  }
  arrangement.complete(skeleton);
  report.still_crowded = ScanArrangement::not_disks(skeleton, kManyChartSides).crowded;
  ChartNumbering numbering =
      number_charts(skeleton, arrangement.tiles(), mesh.layout.node_count, kLengthSteps);
  skeleton = {};
  for (TileGraph& g : arrangement.tiles()) {
    g = {};
  }

  ChartGraph& charts = numbering.graph;
  std::vector<std::vector<std::uint32_t>> contributors(mesh.layout.tile_count());
  arrangement.pass<TilePieces>(
      "charts", arrangement.all_tiles(),
      [&](std::uint32_t tile, OpenTile& o, TilePieces& pieces) {
        std::vector<Rgba> colours;
        if (mesh.has_colours) {
          const ChunkView<Rgba> c = read(store, fields::kColour, TileId(tile));
          colours.assign(c.begin(), c.end());
        }
        pieces = cut_tile(o, TileId(tile), numbering, colours);
      },
      [&](std::uint32_t tile, TilePieces& pieces) {
        const TileId id(tile);
        write(store, fields::kOwnPieceVertex, id, pieces.own.vertices);
        write(store, fields::kOwnPiece, id, pieces.own.triangles);
        write(store, fields::kForeignPieceVertex, id, pieces.foreign.vertices);
        write(store, fields::kForeignPiece, id, pieces.foreign.triangles);
        write(store, fields::kLayoutPoint, id, records(pieces.points));
        write(store, fields::kTriangleChart, id, pieces.triangle_chart);
        for (const PieceTriangle& t : pieces.foreign.triangles) {
          std::vector<std::uint32_t>& to = contributors[numbering.home(t.chart)];
          if (to.empty() || to.back() != tile) {
            to.push_back(tile);
          }
        }
        for (const NumberedNode& n : pieces.nodes) {
          charts.node_vertex[n.node] = n.number;
        }
        for (const std::uint32_t c : pieces.singular_charts) {
          charts.chart_singular[c] = 1;
        }
      });

  ChartLayout out;
  out.sorted_nodes = charts.node_vertex;
  std::sort(out.sorted_nodes.begin(), out.sorted_nodes.end());
  ensure(out.sorted_nodes.empty() || out.sorted_nodes.back() < charts.first_division,
         "every node has its number");
  out.contributor_begin.assign(1, 0);
  for (const std::vector<std::uint32_t>& c : contributors) {
    out.contributors.insert(out.contributors.end(), c.begin(), c.end());
    out.contributor_begin.push_back(static_cast<std::uint32_t>(out.contributors.size()));
  }
  for (const std::uint8_t s : charts.chart_singular) {
    out.singular_charts += s;
  }
  out.chart_begin = std::move(numbering.chart_begin);
  out.point_begin = std::move(numbering.point_begin);
  out.graph = std::move(charts);
  return out;
}

ChartChunks load_pieces(Store& store, const ChartLayout& layout, TileId tile) {
  ChartChunks out;
  out.chunks.push_back(
      {read(store, fields::kOwnPieceVertex, tile), read(store, fields::kOwnPiece, tile)});
  for (std::uint32_t i = layout.contributor_begin[tile.value];
       i < layout.contributor_begin[tile.value + 1]; ++i) {
    const TileId other(layout.contributors[i]);
    out.chunks.push_back({read(store, fields::kForeignPieceVertex, other),
                          read(store, fields::kForeignPiece, other)});
  }
  return out;
}

void erase_pieces(Store& store) {
  for (const std::string_view name :
       {fields::kOwnPieceVertex.name, fields::kOwnPiece.name, fields::kForeignPieceVertex.name,
        fields::kForeignPiece.name}) {
    store.erase(name);
  }
}

std::vector<ChartMesh> assemble_charts(const ChartChunks& pieces, const ChartLayout& layout,
                                       TileId tile, bool has_colours) {
  std::vector<PieceView> views;
  for (const ChartChunks::Chunk& c : pieces.chunks) {
    views.push_back({c.vertices.span(), c.triangles.span()});
  }
  return rattan::layout::assemble_charts(layout.graph, layout.sorted_nodes,
                                         layout.chart_begin[tile.value],
                                         layout.chart_begin[tile.value + 1], views, has_colours);
}

}  // namespace rattan
