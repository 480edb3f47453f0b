// SPDX-License-Identifier: MIT
//
// Based on: Ray, Li, Levy, Sheffer, Alliez, Periodic Global Parameterization (2006), section 3.3.
// There, lines stop at singular triangles and the cells are what remains; here lines are extended
// through them, and the decomposition is completed until every face is a disk.
#include "engine/layout/scan_arrangement.h"

#include <algorithm>
#include <array>
#include <utility>

#include "engine/core/errors.h"
#include "engine/core/exact_math.h"
#include "engine/mesh/features.h"
#include "engine/param/phase_fields.h"

namespace rattan::layout {

namespace {

constexpr int kMostRounds = 6;
/// Faces are divided for their many sides in so many rounds at most.
constexpr std::uint64_t kRoundsOfDivision = 3;
/// Stitching holds the graphs and a skeleton of them, with tables to sort.
constexpr std::uint64_t kTimesGraphs = 3;

/// Pieces of features on rims of tiles that were peeled off.
std::vector<PointKey> loose_rim_pieces(const Skeleton& k) {
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
void mark_shared_points(const Skeleton& k, std::vector<FaceSegment>& segments) {
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

/// Strands around each stitched face; valid at roots.
std::vector<std::uint32_t> count_sides(Skeleton& k) {
  std::vector<std::uint32_t> sides(k.euler.size(), 0);
  for (const Strand& s : k.strands) {
    for (const std::uint32_t dart : {s.first, s.first ^ 1U}) {
      const std::uint32_t f = k.left(dart);
      if (f != kNone) {
        ++sides[f];
      }
    }
  }
  return sides;
}

}  // namespace

ScanArrangement::ScanArrangement(Store& store, const ScanMesh& mesh,
                                 const ArrangementOptions& options, TaskGraph& graph,
                                 ArrangementReport& report)
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

std::vector<std::uint32_t> ScanArrangement::all_tiles() const {
  std::vector<std::uint32_t> all(tiles_.size());
  for (std::uint32_t t = 0; t < all.size(); ++t) {
    all[t] = t;
  }
  return all;
}

Skeleton ScanArrangement::stitched() {
  report_ = {};
  trace_tiles(all_tiles(), true);
  Skeleton skeleton = stitch(tiles_, cuts_, trace_);
  report_.dangling_ends = skeleton.counts.dangling_ends;
  report_.dropped_circles = skeleton.counts.dropped_circles;
  return skeleton;
}

ScanArrangement::NotDisks ScanArrangement::not_disks(Skeleton& k, std::uint32_t many_sides) {
  NotDisks n;
  const std::vector<std::uint32_t> sides = count_sides(k);
  for (std::uint32_t f = 0; f < k.euler.size(); ++f) {
    if (sides[f] > many_sides) {
      ++n.crowded;
      n.excess += sides[f] - many_sides;
    }
    if (k.faces.find(f) == f && (k.euler[f] != 1 || k.has_graph[f] == 0)) {
      ++n.faces;
      n.cuts += static_cast<std::uint64_t>(k.euler[f] < 1 ? 1 - k.euler[f] : 1);
    }
  }
  return n;
}

void ScanArrangement::complete(Skeleton& k) {
  while (cut(k)) {
    k = {};  // before the next one is built
    k = stitch(tiles_, cuts_, trace_);
  }
}

void ScanArrangement::load(TileId tile, OpenTile& o) {
  o.mesh = load_tile(store_, mesh_, tile);
  o.frames = read_local(store_, fields::kFrame, fields::kMeshHalo, tile);
  o.phases = read_local(store_, fields::kPhase, fields::kMeshHalo, tile);
}

void ScanArrangement::open(TileId tile, OpenTile& o) const {
  o.coordinates = tile_coordinates(o.mesh, o.frames, o.phases, options_.omega);
  o.frames = {};
  o.phases = {};
  const std::vector<PointKey>& cuts = tile_cuts_[tile.value];
  std::vector<std::array<std::uint32_t, 2>> creases;
  if (options_.features != nullptr) {
    creases = options_.features->tile_creases(o.mesh);
  }
  o.arrangement = arrange_tile(o.mesh, o.coordinates, options_.density, cuts, creases,
                               options_.most_crossings, options_.gap);
  o.traced = trace_tile(o.arrangement, cuts, trace_);
}

void ScanArrangement::trace_tiles(const std::vector<std::uint32_t>& which, bool count) {
  struct Result {
    TileGraph graph;
    SingularityCounts singularities;
  };
  pass<Result>(
      count ? "arrangement" : "arrangement, cut tiles", which,
      [&](std::uint32_t, OpenTile& o, Result& r) {
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
bool ScanArrangement::cut(Skeleton& k) {
  const std::size_t faces = k.euler.size();
  std::vector<std::uint8_t> bad(faces, 0);
  std::vector<std::uint8_t> bare(faces, 0);
  bool any = false;
  const bool divides = options_.most_sides > 0 && report_.cut_rounds < kRoundsOfDivision;
  const std::vector<std::uint32_t> sides =
      divides ? count_sides(k) : std::vector<std::uint32_t>(faces, 0);
  for (std::uint32_t f = 0; f < faces; ++f) {
    const std::uint32_t root = k.faces.find(f);
    const bool no_graph = k.has_graph[root] == 0;
    const bool crowded = sides[root] > options_.most_sides;
    bad[f] = k.euler[root] != 1 || no_graph || crowded ? 1 : 0;
    bare[f] = no_graph || crowded ? 1 : 0;
    any = any || bad[f] != 0;
    if (root == f && bad[f] != 0) {
      ++(no_graph ? report_.bare_components : report_.cut_faces);
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
      [&](std::uint32_t tile, OpenTile& o, std::vector<FaceSegment>& r) {
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

}  // namespace rattan::layout
