// SPDX-License-Identifier: MIT

// Passes over the scan and what they do in each tile: curvature, assembly of the systems, triangle
// coordinates, crossings of lines, cells, closest points.

#include <cmath>
#include <vector>

#include <benchmark/benchmark.h>

#include "engine/layout/arrangement.h"
#include "engine/layout/tile_arrangement.h"
#include "engine/param/periodic_energy.h"
#include "engine/remesh/surface_projector.h"
#include "tools/bench/kernels/workload.h"

namespace rattan {

namespace {

constexpr auto kUnit = benchmark::kMillisecond;

void count(benchmark::State& state, const char* what, std::uint64_t items, std::uint64_t bytes) {
  const auto n = static_cast<std::int64_t>(state.iterations());
  state.SetItemsProcessed(n * static_cast<std::int64_t>(items));
  if (bytes > 0) {
    state.SetBytesProcessed(n * static_cast<std::int64_t>(bytes));
  }
  state.SetLabel(what);
}

/// Bytes of one field in all tiles.
template <class T>
std::uint64_t field_bytes(Field<T> field) {
  Workload& w = workload();
  std::uint64_t bytes = 0;
  for (std::uint32_t t = 0; t < w.mesh.layout.tile_count(); ++t) {
    bytes += read(w.store, field, TileId(t)).size() * sizeof(T);
  }
  return bytes;
}

std::uint64_t graph_bytes() {
  return field_bytes(fields::kRowBegin) + field_bytes(fields::kNeighbor) +
         field_bytes(fields::kEdgeWeight) + field_bytes(fields::kDiagonal);
}

/// Weights, normals, areas and the raw curvature measure, then the rounds that average it.
void curvature(benchmark::State& state) {
  Workload& w = workload();
  GeometryOptions options = w.field.geometry;
  options.curvature_rounds = static_cast<int>(state.range(0));
  for (auto _ : state) {
    benchmark::DoNotOptimize(prepare_surface(w.store, w.mesh, options, w.tasks));
  }
  const std::uint64_t first = field_bytes(fields::kTriangle) +
                              field_bytes(fields::kSmoothPosition) + graph_bytes() +
                              field_bytes(fields::kNormal) + field_bytes(fields::kVertexArea) +
                              field_bytes(fields::kCurvature);
  const std::uint64_t round = 2 * field_bytes(fields::kCurvature) + field_bytes(fields::kRowBegin) +
                              field_bytes(fields::kNeighbor);
  count(state, "triangles", w.mesh.topology.triangles,
        first + static_cast<std::uint64_t>(options.curvature_rounds) * round);
}

void directions(benchmark::State& state) {
  Workload& w = workload();
  const auto measures = read(w.store, fields::kCurvature, TileId(0));
  for (auto _ : state) {
    double sum = 0.0;
    for (const CurvatureMeasure& m : measures) {
      sum += principal_directions(m, Vec3d::UnitX(), Vec3d::UnitY(), 1e-6).fidelity;
    }
    benchmark::DoNotOptimize(sum);
  }
  count(state, "vertices", measures.size(), measures.size() * sizeof(CurvatureMeasure));
}

void assemble_smoothing_system(benchmark::State& state) {
  Workload& w = workload();
  SmoothingOptions options;
  options.fitting_length = 3.0 * w.quad_side;
  options.floor_curvature = 1e-3 / w.mesh.mean_edge_length;
  for (auto _ : state) {
    benchmark::DoNotOptimize(assemble_smoothing(w.store, w.mesh, options, w.tasks));
  }
  const auto& system = fields::kSmoothingSystem;
  count(state, "vertices", w.mesh.topology.vertices,
        graph_bytes() + field_bytes(system.coefficient) + field_bytes(system.rhs) +
            field_bytes(system.fit) + field_bytes(fields::kCurvature) +
            field_bytes(fields::kNormal));
}

void assemble_curl_system(benchmark::State& state) {
  Workload& w = workload();
  for (auto _ : state) {
    assemble_curl(w.store, w.mesh, w.tasks);
  }
  count(state, "vertices", w.mesh.topology.vertices,
        graph_bytes() + field_bytes(fields::kTriangle) + field_bytes(fields::kFrame) +
            field_bytes(fields::kCurlSystem.rhs) + field_bytes(fields::kCurlSystem.fit));
}

void assemble_phase_system(benchmark::State& state) {
  Workload& w = workload();
  for (auto _ : state) {
    assemble_phase(w.store, w.mesh, w.quad_side, w.tasks);
  }
  count(
      state, "vertices", w.mesh.topology.vertices,
      graph_bytes() + field_bytes(fields::kFrame) + field_bytes(fields::kPhaseSystem.coefficient));
}

struct SolvedTile {
  TileMesh mesh;
  std::vector<VertexFrame> frames;
  std::vector<PairValue> phases;
  TileCoordinates coordinates;
};

std::vector<SolvedTile> solved_tiles() {
  Workload& w = workload();
  std::vector<SolvedTile> tiles(w.mesh.layout.tile_count());
  for (std::uint32_t t = 0; t < tiles.size(); ++t) {
    SolvedTile& tile = tiles[t];
    tile.mesh = load_tile(w.store, w.mesh, TileId(t));
    tile.frames = read_local(w.store, fields::kFrame, fields::kMeshHalo, TileId(t));
    tile.phases = read_local(w.store, fields::kPhase, fields::kMeshHalo, TileId(t));
    tile.coordinates = tile_coordinates(tile.mesh, tile.frames, tile.phases, w.quad_side);
  }
  return tiles;
}

void coordinates(benchmark::State& state) {
  const std::vector<SolvedTile> tiles = solved_tiles();
  std::uint64_t bytes = 0;
  for (auto _ : state) {
    bytes = 0;
    for (const SolvedTile& tile : tiles) {
      const TileCoordinates c =
          tile_coordinates(tile.mesh, tile.frames, tile.phases, workload().quad_side);
      bytes += c.edges.size() * sizeof(TileEdge) + c.angles.size() * sizeof(PhaseAngles) +
               (c.side_edge.size() + c.edge_begin.size()) * sizeof(std::uint32_t);
    }
  }
  for (const SolvedTile& tile : tiles) {
    bytes += tile.mesh.triangles.size() * sizeof(LocalTriangle) +
             tile.frames.size() * (sizeof(VertexFrame) + sizeof(PairValue));
  }
  count(state, "triangles", workload().mesh.topology.triangles, bytes);
}

void crossings(benchmark::State& state) {
  const std::vector<SolvedTile> tiles = solved_tiles();
  const auto density = static_cast<int>(state.range(0));
  std::uint64_t segments = 0;
  for (auto _ : state) {
    segments = 0;
    for (const SolvedTile& tile : tiles) {
      segments += layout::arrange_tile(tile.mesh, tile.coordinates, density, {}, {},
                                       std::numeric_limits<std::uint64_t>::max())
                      .segments.size();
    }
  }
  count(state, "triangles", workload().mesh.topology.triangles, 0);
  state.counters["segments"] = static_cast<double>(segments);
}

/// Everything from the phases to the cells.
void extraction(benchmark::State& state) {
  Workload& w = workload();
  ArrangementOptions options;
  options.omega = w.quad_side;
  options.density = static_cast<int>(state.range(0));
  for (auto _ : state) {
    ArrangementReport report;
    const CellComplex cells = extract_cells(w.store, w.mesh, options, w.tasks, report);
    benchmark::DoNotOptimize(&cells);
  }
  count(state, "triangles", w.mesh.topology.triangles,
        field_bytes(fields::kTriangle) + field_bytes(fields::kPosition) +
            field_bytes(fields::kFrame) + field_bytes(fields::kPhase));
}

/// As many points as the remesh has vertices, off the surface by a fifth of an edge.
std::vector<ProjectionQuery> queries_beside_surface() {
  Workload& w = workload();
  std::vector<ProjectionQuery> queries;
  const double off = 0.2 * w.mesh.mean_edge_length;
  for (std::size_t v = 0; v < w.positions.size(); v += 16) {
    const double turn = 2.399963 * static_cast<double>(v);  // directions all around
    queries.push_back({.point = w.positions[v].cast<double>() +
                                off * Vec3d(std::cos(turn), std::sin(turn), std::cos(3.0 * turn))});
  }
  return queries;
}

void closest_point(benchmark::State& state) {
  Workload& w = workload();
  std::vector<ProjectionQuery> queries = queries_beside_surface();
  std::vector<SurfacePoint> results(queries.size());
  SurfaceProjector projector(w.store, w.mesh, {}, w.tasks);
  projector.project(queries, results, w.tasks);
  if (state.range(0) != 0) {
    for (std::size_t i = 0; i < queries.size(); ++i) {
      queries[i].hint = results[i].triangle;
    }
  }
  for (auto _ : state) {
    projector.project(queries, results, w.tasks);
    benchmark::ClobberMemory();
  }
  count(state, state.range(0) != 0 ? "points, with hints" : "points", queries.size(),
        queries.size() * (sizeof(ProjectionQuery) + sizeof(SurfacePoint)));
}

void triangle_index(benchmark::State& state) {
  Workload& w = workload();
  const TileMesh tile = load_tile(w.store, w.mesh, TileId(0));
  std::uint64_t bytes = 0;
  for (auto _ : state) {
    const TriangleIndex index(tile.positions.span(), tile.triangles.span());
    bytes = index.bytes();
    benchmark::DoNotOptimize(&index);
  }
  count(state, "triangles", tile.triangles.size(),
        bytes + tile.triangles.size() * sizeof(LocalTriangle) +
            tile.positions.size() * sizeof(Vec3f));
}

BENCHMARK(curvature)->Name("field/surface_and_curvature/rounds")->Arg(0)->Arg(3)->Unit(kUnit);
BENCHMARK(directions)->Name("field/principal_directions")->Unit(kUnit);
BENCHMARK(assemble_smoothing_system)->Name("field/assemble/smoothing")->Unit(kUnit);
BENCHMARK(assemble_curl_system)->Name("field/assemble/curl")->Unit(kUnit);
BENCHMARK(assemble_phase_system)->Name("param/assemble/phase")->Unit(kUnit);
BENCHMARK(coordinates)->Name("extract/triangle_coordinates")->Unit(kUnit);
BENCHMARK(crossings)->Name("extract/crossings/density")->Arg(1)->Arg(4)->Unit(kUnit);
BENCHMARK(extraction)->Name("extract/cells/density")->Arg(1)->Arg(4)->Unit(kUnit);
BENCHMARK(closest_point)->Name("remesh/closest_point/hints")->Arg(0)->Arg(1)->Unit(kUnit);
BENCHMARK(triangle_index)->Name("remesh/triangle_index")->Unit(kUnit);

}  // namespace

}  // namespace rattan
