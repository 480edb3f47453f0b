// SPDX-License-Identifier: MIT
#pragma once

// From a stream of vertices and triangles to the tiles of tile_mesh.h, in bounded memory: spooled,
// sorted along a space-filling curve, re-indexed, repaired block by block, written tile by tile.

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "engine/core/memory_budget.h"
#include "engine/core/spool.h"
#include "engine/core/store.h"
#include "engine/core/task_graph.h"
#include "engine/mesh/polygon_cutter.h"
#include "engine/mesh/scan_sink.h"
#include "engine/mesh/tile_mesh.h"
#include "engine/mesh/wanted_direction.h"

namespace rattan {

/// Which vertices at exactly equal positions become one.
enum class Merge {
  kSoup,    ///< all, if triangles hardly share vertices: if there are three for every two triangles
            ///< or more, that is, if pieces connected across edges have four triangles on average
  kAlways,  ///< all
  kNever,
};

/// Whether so many used vertices for so many triangles are Merge::kSoup's soup.
constexpr bool is_soup(std::uint64_t vertices, std::uint64_t triangles) {
  return 2 * vertices >= 3 * triangles;
}

struct IngestOptions {
  /// Vertices per tile, in curve order and before vertices are split (so that a tile may own some
  /// more); at least 1. Part of what decides the output.
  std::uint32_t tile_size = 8192;
  Merge merge = Merge::kSoup;
  /// Components of fewer triangles, counted after repair, are dropped.
  std::uint64_t drop_components = 0;
  /// Boundary loops of at most so many edges, counted after repair, are filled with triangles.
  std::uint64_t fill_holes = 0;
  /// Bytes for sort buffers and tables of ids. Never decides the output, only the number of passes
  /// over the spools.
  std::uint64_t memory_bytes = std::uint64_t{256} << 20;
  /// Bytes per block of the spools. Never decides the output.
  std::size_t spool_block_bytes = kSpoolBlockBytes;
  /// Names the input in errors.
  std::string input_name = "the scan";
  /// Ledger for the buffers; may be null.
  MemoryBudget* budget = nullptr;
  /// Uses 64-bit ids even where 32 bits suffice; for tests.
  bool wide_ids = false;
};

/// An ingest between two of its parts: small, as the records are in the store.
struct IngestRecord {
  std::uint64_t vertices = 0;
  std::uint64_t triangles = 0;
  std::uint64_t non_finite = 0;
  bool closed = false;
  SpoolExtent positions, colours, directions, narrow, wide;
  // Once the vertices are in order:
  bool ordered = false;
  SpoolExtent order;
  std::uint64_t ranks = 0;  ///< vertices that are used and finite
  bool has_colours = false;
  bool has_directions = false;
  Vec3d origin = Vec3d::Zero();
  double unit = 1.0;
  RepairCounts repaired;  ///< found so far
};

template <class A>
void members_of(A& a, IngestRecord& r) {
  a(r.vertices);
  a(r.triangles);
  a(r.non_finite);
  a(r.closed);
  a(r.positions);
  a(r.colours);
  a(r.directions);
  a(r.narrow);
  a(r.wide);
  a(r.ordered);
  a(r.order);
  a(r.ranks);
  a(r.has_colours);
  a(r.has_directions);
  a(r.origin);
  a(r.unit);
  a(r.repaired);
}

/// Add everything, then finish once. Not thread safe. Uses scratch fields "ingest/..." of the store
/// and erases them. Takes its time in three parts, adding, order() and finish(), between which
/// hand_over() lets another process take over.
class Ingest final : public ScanSink {
 public:
  /// `left`: by hand_over() of an ingest with the same options.
  explicit Ingest(Store& store, IngestOptions options = {}, const IngestRecord& left = {});
  ~Ingest() override;

  void add_vertices(std::span<const Vec3d> positions) override;
  void add_colours(std::span<const Rgba> colours) override;
  void add_triangles(std::span<const std::array<std::uint64_t, 3>> triangles) override;
  void add_polygons(std::span<const std::uint32_t> sizes,
                    std::span<const std::uint64_t> corners) override;
  /// Directions of the vertices in the order they came, at any time before finish: for all vertices
  /// or for none.
  void add_directions(std::span<const VertexDirection> directions);

  /// After everything was added: sorts the vertices.
  void order();
  /// Leaves all to an ingest to come; this one is done for then. Ends adding.
  IngestRecord hand_over();

  /// Does what is left, and writes the fields of tile_mesh.h. Repairs on the way and counts it in
  /// ScanMesh::repaired: equal positions are merged as the options say; triangles that repeat an
  /// index, duplicates, and those with non-finite corners (or beyond 1e150) are dropped, as are
  /// vertices without triangles; components are oriented by the majority of their triangles; edges
  /// that still have more than two triangles or disagreeing ones are cut open; vertices are split
  /// until each has one fan. The result depends on the input and tile_size only. Two passes over
  /// the tiles (three if a component is one-sided; with drop_components or fill_holes everything
  /// once more, see refine.h). Throws InputError for indices out of range and if no triangle is
  /// left.
  ScanMesh finish(TaskGraph& graph);

  std::uint64_t vertex_count() const { return state_.vertices; }
  std::uint64_t triangle_count() const { return state_.triangles; }

 private:
  template <class Index>
  friend class IngestRun;

  /// White for those that came without, as some of another block have colours.
  void pad_colours(std::uint64_t count);
  /// Turns the polygons into triangles, after all of these; how many repeated polygons made none.
  std::uint64_t cut_polygons();
  /// Ends adding.
  void close();
  Reservation reserve() const;
  template <class Work>
  void with_ids(const Work& work);

  Store& store_;
  IngestOptions options_;
  IngestRecord state_;  ///< spools apart, but for the order's
  Spool<Vec3d> positions_;
  Spool<Rgba> colours_;                ///< empty, or one a vertex
  Spool<VertexDirection> directions_;  ///< empty, or one a vertex
  /// Triangles as long as every index fits 32 bits, and all after the first that doesn't.
  Spool<std::array<std::uint32_t, 3>> narrow_;
  Spool<std::array<std::uint64_t, 3>> wide_;
  PolygonCutter polygons_;
};

/// The point that stored positions are relative to: per axis zero if coordinates are not large
/// compared with the box, else a multiple of a power of two near the box centre, so that
/// subtracting it from 32-bit coordinates is exact.
Vec3d choose_origin(const Vec3d& box_min, const Vec3d& box_max);

/// See ScanMesh::unit; of the box that triangles use.
double choose_unit(const Vec3d& box_min, const Vec3d& box_max);

}  // namespace rattan
