// SPDX-License-Identifier: MIT
#include "engine/layout/arrangement.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "engine/core/errors.h"
#include "engine/layout/assemble.h"
#include "engine/layout/scan_arrangement.h"

namespace rattan {

namespace {

using namespace layout;

std::vector<std::vector<ArcPoint>> polylines(ScanArrangement& arrangement,
                                             std::span<const ArcRequest> requests) {
  std::vector<TileGraph>& tiles = arrangement.tiles();
  std::vector<std::vector<ArcPoint>> out(requests.size());
  std::vector<std::uint32_t> which;
  std::vector<std::vector<std::size_t>> open;  // requests that a tile must be opened for
  for (std::size_t i = 0; i < requests.size(); ++i) {
    std::vector<ArcLine>& lines = tiles[requests[i].tile].lines;
    const auto kept =
        std::lower_bound(lines.begin(), lines.end(), requests[i].arc,
                         [](const ArcLine& l, std::uint32_t arc) { return l.arc < arc; });
    if (kept != lines.end() && kept->arc == requests[i].arc) {
      out[i] = std::move(kept->points);
      continue;
    }
    if (which.empty() || which.back() != requests[i].tile) {
      which.push_back(requests[i].tile);
      open.emplace_back();
    }
    open.back().push_back(i);
  }
  if (which.empty()) {
    return out;
  }
  const auto wanted = [&](std::uint32_t tile) -> const std::vector<std::size_t>& {
    const auto at = std::lower_bound(which.begin(), which.end(), tile);
    return open[static_cast<std::size_t>(at - which.begin())];
  };
  arrangement.pass<std::vector<std::vector<ArcPoint>>>(
      "long edges", which,
      [&](std::uint32_t tile, OpenTile& o, std::vector<std::vector<ArcPoint>>& r) {
        for (const std::size_t i : wanted(tile)) {
          r.push_back(arc_polyline(o.arrangement, o.traced, requests[i].arc));
        }
      },
      [&](std::uint32_t tile, std::vector<std::vector<ArcPoint>>& r) {
        for (std::size_t i = 0; i < r.size(); ++i) {
          out[wanted(tile)[i]] = std::move(r[i]);
        }
      });
  return out;
}

}  // namespace

CellComplex extract_cells(Store& store, const ScanMesh& mesh, const ArrangementOptions& options,
                          TaskGraph& graph, ArrangementReport& report) {
  ScanArrangement arrangement(store, mesh, options, graph, report);
  Skeleton skeleton = arrangement.stitched();
  arrangement.complete(skeleton);
  for (TileGraph& g : arrangement.tiles()) {  // the skeleton holds all but the lines
    std::vector<ArcLine> lines = std::move(g.lines);
    g = {};
    g.lines = std::move(lines);
  }
  Assembly assembly = assemble(skeleton, kLengthSteps, [&](std::span<const ArcRequest> requests) {
    return polylines(arrangement, requests);
  });
  report.spaced_vertices = assembly.spaced_vertices;
  const CellComplex& c = assembly.cells;
  const auto euler = static_cast<std::int64_t>(c.mesh.vertex_count()) -
                     static_cast<std::int64_t>(c.edge_count) +
                     static_cast<std::int64_t>(c.mesh.face_count());
  ensure(mesh.topology.triangles == 0 || euler == mesh.topology.euler(),
         "the decomposition keeps the Euler characteristic");
  return std::move(assembly.cells);
}

}  // namespace rattan
