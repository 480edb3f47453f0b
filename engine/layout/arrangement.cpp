// SPDX-License-Identifier: MIT
//
// Based on: Ray, Li, Levy, Sheffer, Alliez, Periodic Global Parameterization (2006), section 3.3.
// There, lines stop at singular triangles and the cells are what remains; here lines are extended
// through them, and the decomposition is completed until every face is a disk.
#include "engine/layout/arrangement.h"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "engine/core/errors.h"
#include "engine/core/exact_math.h"
#include "engine/layout/assemble.h"
#include "engine/layout/face_cuts.h"
#include "engine/layout/stitch.h"
#include "engine/layout/tile_graph.h"
#include "engine/mesh/features.h"
#include "engine/param/phase_fields.h"

namespace rattan {

namespace {

using namespace layout;

/// Fixed-point steps per side of a cell.
constexpr double kLengthSteps = 1 << 20;
constexpr int kMostRounds = 6;
/// Stitching holds the graphs and a skeleton of them, with tables to sort.
constexpr std::uint64_t kTimesGraphs = 3;

class Extraction {
 public:
  Extraction(Store& store, const ScanMesh& mesh, const ArrangementOptions& options,
             TaskGraph& graph, ArrangementReport& report)
      : store_(store), mesh_(mesh), options_(options), graph_(graph), report_(report) {
    if (!(options.omega > 0.0) || options.density < 1 || options.density > 1024) {
      throw UsageError("The period must be positive and the density between 1 and 1024.");
    }
    trace_.side = kLengthSteps;
    trace_.length_scale = kLengthSteps * options.density / options.omega;
    trace_.features = options.features;
    trace_.corner_cosine = exact::sincos(options.corner_degrees / 180.0 * exact::kPi).cos;
    if (options.budget != nullptr) {
      reserved_ = options.budget->reserve(0, "the lines on the surface");
    }
    tiles_.resize(mesh.layout.tile_count());
    tile_cuts_.resize(tiles_.size());
  }

  CellComplex run() {
    std::vector<std::uint32_t> all(tiles_.size());
    for (std::uint32_t t = 0; t < all.size(); ++t) {
      all[t] = t;
    }
    report_ = {};
    trace_tiles(all, true);
    Skeleton skeleton = stitch(tiles_, cuts_, trace_);
    report_.dangling_ends = skeleton.counts.dangling_ends;
    report_.dropped_circles = skeleton.counts.dropped_circles;
    while (cut(skeleton)) {
      skeleton = {};  // before the next one is built
      skeleton = stitch(tiles_, cuts_, trace_);
    }
    for (TileGraph& g : tiles_) {  // the skeleton holds all but the lines
      std::vector<ArcLine> lines = std::move(g.lines);
      g = {};
      g.lines = std::move(lines);
    }
    Assembly assembly = assemble(skeleton, kLengthSteps, [&](std::span<const ArcRequest> requests) {
      return polylines(requests);
    });
    report_.spaced_vertices = assembly.spaced_vertices;
    check(assembly.cells);
    return std::move(assembly.cells);
  }

 private:
  struct Opened {
    TileMesh mesh;
    std::vector<VertexFrame> frames;
    std::vector<PairValue> phases;
    TileCoordinates coordinates;
    TileArrangement arrangement;
    TracedTile traced;
  };

  void load(TileId tile, Opened& o) {
    o.mesh = load_tile(store_, mesh_, tile);
    o.frames = read_local(store_, fields::kFrame, fields::kMeshHalo, tile);
    o.phases = read_local(store_, fields::kPhase, fields::kMeshHalo, tile);
  }

  void open(TileId tile, Opened& o) const {
    o.coordinates = tile_coordinates(o.mesh, o.frames, o.phases, options_.omega);
    o.frames = {};
    o.phases = {};
    const std::vector<PointKey>& cuts = tile_cuts_[tile.value];
    std::vector<std::array<std::uint32_t, 2>> creases;
    if (options_.features != nullptr) {
      creases = options_.features->tile_creases(o.mesh);
    }
    o.arrangement = arrange_tile(o.mesh, o.coordinates, options_.density, cuts, creases,
                                 options_.most_crossings);
    o.traced = trace_tile(o.arrangement, cuts, trace_);
  }

  /// Runs a pass over some tiles: work(tile, opened, result) wide, done(tile, result) in order.
  template <class Result, class Work, class Done>
  void pass(const char* name, const std::vector<std::uint32_t>& which, const Work& work,
            const Done& done) {
    struct State {
      Opened opened;
      Result result;
    };
    run_pass<State>(
        graph_, name, static_cast<std::uint32_t>(which.size()),
        [&](TileId i, State& s) { load(TileId(which[i.value]), s.opened); },
        [&](TileId i, State& s) {
          open(TileId(which[i.value]), s.opened);
          work(which[i.value], s.opened, s.result);
          s.opened = {};
        },
        [&](TileId i, State& s) { done(which[i.value], s.result); });
  }

  void trace_tiles(const std::vector<std::uint32_t>& which, bool count) {
    struct Result {
      TileGraph graph;
      SingularityCounts singularities;
    };
    pass<Result>(
        count ? "arrangement" : "arrangement, cut tiles", which,
        [&](std::uint32_t, Opened& o, Result& r) {
          r.graph = std::move(o.traced.graph);
          if (count) {
            r.singularities = count_singularities(o.mesh, o.coordinates);
          }
        },
        [&](std::uint32_t tile, Result& r) {
          graph_bytes_ += r.graph.bytes() - tiles_[tile].bytes();
          if (options_.budget != nullptr) {
            reserved_.resize(kTimesGraphs * graph_bytes_);
          }
          tiles_[tile] = std::move(r.graph);
          report_.singularities += r.singularities;
        });
  }

  /// True if faces had to be cut; the tiles' graphs are new then.
  bool cut(Skeleton& k) {
    const std::size_t faces = k.euler.size();
    std::vector<std::uint8_t> bad(faces, 0);
    std::vector<std::uint8_t> bare(faces, 0);
    bool any = false;
    for (std::uint32_t f = 0; f < faces; ++f) {
      const std::uint32_t root = k.faces.find(f);
      bad[f] = k.euler[root] != 1 || k.has_graph[root] == 0 ? 1 : 0;
      bare[f] = k.has_graph[root] == 0 ? 1 : 0;
      any = any || bad[f] != 0;
      if (root == f && bad[f] != 0) {
        ++(bare[f] != 0 ? report_.bare_components : report_.cut_faces);
      }
    }
    if (!any) {
      return false;
    }
    ++report_.cut_rounds;
    ensure(report_.cut_rounds <= kMostRounds, "faces become disks in a few rounds of cuts");

    std::vector<std::uint32_t> which;
    for (std::uint32_t t = 0; t < tiles_.size(); ++t) {
      if (std::any_of(bad.begin() + k.face_base[t], bad.begin() + k.face_base[t + 1],
                      [](std::uint8_t b) { return b != 0; })) {
        which.push_back(t);
      }
    }
    const std::vector<PointKey> loose = loose_rim_pieces(k);
    std::vector<FaceSegment> segments;
    pass<std::vector<FaceSegment>>(
        "faces to cut", which,
        [&](std::uint32_t tile, Opened& o, std::vector<FaceSegment>& r) {
          const std::uint32_t first = k.arc_base[tile];
          std::vector<std::uint8_t> alive(k.arc_base[tile + 1] - first);
          for (std::uint32_t i = 0; i < alive.size(); ++i) {
            alive[i] = k.arcs[first + i].alive ? 1 : 0;
          }
          r = face_segments(
              o.arrangement, o.traced,
              std::span(bad).subspan(k.face_base[tile], k.face_base[tile + 1] - k.face_base[tile]),
              alive, loose);
        },
        [&](std::uint32_t tile, std::vector<FaceSegment>& r) {
          for (FaceSegment& s : r) {
            s.face = k.faces.find(s.face + k.face_base[tile]);
            s.tile = tile;
            segments.push_back(s);
          }
        });
    mark_shared_points(k, segments);

    std::vector<std::uint32_t> touched;
    for (FaceCut& c : cut_faces(std::move(segments), bare)) {
      c.tiles.push_back(mesh_.layout.owner(c.piece.a).value);
      c.tiles.push_back(mesh_.layout.owner(c.piece.b).value);
      std::sort(c.tiles.begin(), c.tiles.end());
      c.tiles.erase(std::unique(c.tiles.begin(), c.tiles.end()), c.tiles.end());
      for (const std::uint32_t t : c.tiles) {
        tile_cuts_[t].push_back(c.piece);
        touched.push_back(t);
      }
      cuts_.push_back(c.piece);
    }
    std::sort(cuts_.begin(), cuts_.end());
    std::sort(touched.begin(), touched.end());
    touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
    for (const std::uint32_t t : touched) {
      std::sort(tile_cuts_[t].begin(), tile_cuts_[t].end());
    }
    trace_tiles(touched, false);
    return true;
  }

  /// Pieces of features on rims of tiles that were peeled off.
  static std::vector<PointKey> loose_rim_pieces(const Skeleton& k) {
    std::vector<PointKey> loose;
    for (std::size_t i = k.arc_base.back(); i < k.arcs.size(); ++i) {
      if (!k.arcs[i].alive) {
        loose.push_back(k.arcs[i].piece);
      }
    }
    std::sort(loose.begin(), loose.end());
    return loose;
  }

  /// A tile may not see that a point on its rim lies on the graph; the skeleton does.
  static void mark_shared_points(const Skeleton& k, std::vector<FaceSegment>& segments) {
    std::vector<PointKey> on_graph;
    for (std::uint32_t n = 0; n < k.nodes.size(); ++n) {
      for (std::uint32_t i = k.dart_begin[n]; i < k.dart_begin[n + 1]; ++i) {
        if (!k.nodes[n].key.in_triangle() && k.arcs[k.darts[i] >> 1].alive) {
          on_graph.push_back(k.nodes[n].key);
          break;
        }
      }
    }
    std::sort(on_graph.begin(), on_graph.end());
    for (FaceSegment& s : segments) {
      for (std::size_t e = 0; e < 2; ++e) {
        s.on_graph[e] =
            s.on_graph[e] || std::binary_search(on_graph.begin(), on_graph.end(), s.ends[e]);
      }
    }
  }

  std::vector<std::vector<ArcPoint>> polylines(std::span<const ArcRequest> requests) {
    std::vector<std::vector<ArcPoint>> out(requests.size());
    std::vector<std::uint32_t> which;
    std::vector<std::vector<std::size_t>> open;  // requests that a tile must be opened for
    for (std::size_t i = 0; i < requests.size(); ++i) {
      std::vector<ArcLine>& lines = tiles_[requests[i].tile].lines;
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
    pass<std::vector<std::vector<ArcPoint>>>(
        "long edges", which,
        [&](std::uint32_t tile, Opened& o, std::vector<std::vector<ArcPoint>>& r) {
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

  void check(const CellComplex& c) const {
    const auto euler = static_cast<std::int64_t>(c.mesh.vertex_count()) -
                       static_cast<std::int64_t>(c.edge_count) +
                       static_cast<std::int64_t>(c.mesh.face_count());
    ensure(mesh_.topology.triangles == 0 || euler == mesh_.topology.euler(),
           "the decomposition keeps the Euler characteristic");
  }

  Store& store_;
  const ScanMesh& mesh_;
  ArrangementOptions options_;
  TaskGraph& graph_;
  ArrangementReport& report_;
  TraceOptions trace_;
  Reservation reserved_;
  std::uint64_t graph_bytes_ = 0;
  std::vector<TileGraph> tiles_;
  std::vector<PointKey> cuts_;                    // of the whole scan, sorted
  std::vector<std::vector<PointKey>> tile_cuts_;  // those each tile must know, sorted
};

}  // namespace

CellComplex extract_cells(Store& store, const ScanMesh& mesh, const ArrangementOptions& options,
                          TaskGraph& graph, ArrangementReport& report) {
  return Extraction(store, mesh, options, graph, report).run();
}

}  // namespace rattan
