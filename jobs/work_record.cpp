// SPDX-License-Identifier: MIT
#include "jobs/work_record.h"

#include <utility>

#include "engine/core/packed_chunk.h"
#include "engine/core/tile_layout.h"
#include "engine/param/phase_fields.h"
#include "jobs/working_mesh.h"

namespace rattan {

namespace {

struct Lines {
  double omega = 0.0;
  int density = 2;
};
constexpr std::string_view kLines = "remesh/lines";

}  // namespace

void save_lines(Store& store, double omega, int density) {
  write_packed(store, kLines, Lines{omega, density});
}

WorkRecord load_work(Store& store) {
  WorkRecord record;
  if (store.has_chunk(kLines, TileId(0)) && store.has_chunk(fields::kPhase.name, kBoardTile)) {
    Lines lines;
    read_packed(store, kLines, lines);
    record.omega = lines.omega;
    record.density = lines.density;
  }
  if (store.has_chunk(kCharts, TileId(0)) && store.has_chunk(kFlatLayout, TileId(0))) {
    ChartRecord charts;
    read_packed(store, kCharts, charts.layout);
    read_packed(store, kFlatLayout, charts.flat);
    // Charts of another size than those that were parameterized are those of a run that was
    // interrupted in between.
    if (charts.flat.size.charts == charts.layout.graph.chart_count() &&
        charts.flat.unit * charts.layout.graph.units == record.omega) {
      record.charts = std::move(charts);
    }
  }
  WorkingMesh remesh(store);
  if (remesh.saved()) {
    record.remesh = remesh.get();
  }
  return record;
}

}  // namespace rattan
