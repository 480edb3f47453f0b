// SPDX-License-Identifier: MIT
#include "engine/mesh/ingest.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>
#include <utility>

#include "engine/mesh/direction_join.h"
#include "engine/mesh/external_sort.h"
#include "engine/mesh/refine.h"
#include "engine/mesh/reindex.h"
#include "engine/mesh/repair.h"
#include "engine/mesh/tiling.h"
#include "engine/mesh/vertex_order.h"

namespace rattan {

namespace {

// Scratch between the two passes over blocks, one chunk per block.
constexpr Field<LocalTriangle> kRepaired{"ingest/triangle"};
constexpr Field<std::uint64_t> kForeign{"ingest/foreign"};
constexpr Field<std::uint32_t> kSource{"ingest/source"};
constexpr Field<std::uint32_t> kPatchOf{"ingest/patch"};

/// floor(rank / size), without a division where size is a power of two.
struct BlockOf {
  explicit BlockOf(std::uint64_t block_size) : size(block_size) {
    if ((size & (size - 1)) == 0) {
      shift = 0;
      while ((std::uint64_t{1} << shift) < size) {
        ++shift;
      }
    }
  }
  std::uint64_t operator()(std::uint64_t rank) const {
    return shift >= 0 ? rank >> shift : rank / size;
  }
  std::uint64_t size;
  int shift = -1;
};

constexpr Rgba kWhite{255, 255, 255, 255};

}  // namespace

/// order() and finish() for one width of ids.
template <class Index>
class IngestRun {
 public:
  using Triangle = RankTriangle<Index>;

  explicit IngestRun(Ingest& in)
      : in_(in),
        options_(in.options_),
        store_(in.store_),
        block_of_(options_.tile_size),
        ids_(store_, "ingest/order", options_.spool_block_bytes, in.state_.order) {}

  /// Fills in the ingest's state.
  void order() {
    sort_vertices();
    in_.state_.order = ids_.hand_over();
    in_.state_.ordered = true;
  }

  ScanMesh finish(TaskGraph& graph) {
    const IngestRecord& state = in_.state_;
    mesh_.origin = state.origin;
    mesh_.unit = state.unit;
    mesh_.has_colours = state.has_colours;
    mesh_.repaired = state.repaired;
    ranks_ = state.ranks;
    blocks_ = static_cast<std::uint32_t>((ranks_ + options_.tile_size - 1) / options_.tile_size);
    distribute_triangles();
    if (home_->done()) {
      throw InputError(options_.input_name, "", "holds no usable triangle",
                       "Rattan remeshes surfaces made of triangles");
    }
    repair(graph);
    build_tiles(graph);
    erase_scratch();
    return std::move(mesh_);
  }

 private:
  struct ForeignTriangle {
    std::uint32_t block;
    Triangle triangle;
  };
  struct BlockOfHome {
    BlockOf block_of;
    std::uint64_t operator()(const Triangle& t) const { return block_of(t[0]); }
  };
  struct BlockOfForeign {
    std::uint64_t operator()(const ForeignTriangle& t) const { return t.block; }
  };
  struct PairOfLink {
    std::uint64_t operator()(const PatchLink& l) const { return l.pair; }
  };
  using LinkSort = ExternalSort<PatchLink, PairOfLink>;

  template <class F>
  void for_each_triangle_block(const F& f) const {
    std::vector<Triangle> converted;
    const auto pass_on = [&](auto block) {
      using Record = typename decltype(block)::value_type;
      if constexpr (std::is_same_v<Record, Triangle>) {
        f(std::span<const Triangle>(block));
      } else {
        converted.resize(block.size());
        for (std::size_t t = 0; t < block.size(); ++t) {
          for (int c = 0; c < 3; ++c) {
            converted[t][c] = static_cast<Index>(block[t][c]);
          }
        }
        f(std::span<const Triangle>(converted));
      }
    };
    in_.narrow_.for_each_block(pass_on);
    in_.wide_.for_each_block(pass_on);
  }

  /// Without those that repeat an index.
  template <class F>
  void for_each_kept_block(const F& f) const {
    std::vector<Triangle> kept;
    for_each_triangle_block([&](std::span<const Triangle> block) {
      if (std::none_of(block.begin(), block.end(), repeats)) {
        f(block);
        return;
      }
      kept.clear();
      std::copy_if(block.begin(), block.end(), std::back_inserter(kept),
                   [](const Triangle& t) { return !repeats(t); });
      f(std::span<const Triangle>(kept));
    });
  }

  static bool repeats(const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }

  [[noreturn]] void refuse_triangle(std::uint64_t number,
                                    const std::array<std::uint64_t, 3>& t) const {
    throw InputError(options_.input_name, "triangle " + std::to_string(number),
                     "refers to vertex " + std::to_string(std::max({t[0], t[1], t[2]})) +
                         ", but there are only " + std::to_string(in_.state_.vertices) +
                         " vertices",
                     "Numbers start at 0 here; check that the file is complete");
  }

  void check_indices() {
    std::uint64_t number = 0;
    const auto check = [&](auto block) {
      for (const auto& t : block) {
        if (std::max({t[0], t[1], t[2]}) >= in_.state_.vertices) {
          refuse_triangle(number, {t[0], t[1], t[2]});
        }
        in_.state_.repaired.degenerate_triangles +=
            t[0] == t[1] || t[1] == t[2] || t[2] == t[0] ? 1 : 0;
        ++number;
      }
    };
    in_.narrow_.for_each_block(check);
    in_.wide_.for_each_block(check);
  }

  void sort_vertices() {
    IngestRecord& state = in_.state_;
    state.repaired.non_finite_vertices = state.non_finite;
    check_indices();
    VertexOrder<Index> order(store_, options_, ids_);
    const auto triangles = [&](const auto& f) { for_each_triangle_block(f); };
    const auto survey = order.survey(in_.positions_, state.vertices, triangles);
    typename VertexOrder<Index>::Input input{in_.positions_,
                                             in_.colours_.size() > 0 ? &in_.colours_ : nullptr,
                                             state.vertices,
                                             survey.box_min,
                                             survey.box_max,
                                             Vec3d::Zero(),
                                             1.0,
                                             options_.merge == Merge::kAlways};
    if (options_.merge == Merge::kSoup &&
        is_soup(survey.used, state.triangles - state.repaired.degenerate_triangles)) {
      input.weld = true;
      state.repaired.triangle_soup = 1;
    }
    if (survey.box_min[0] <= survey.box_max[0]) {
      input.origin = choose_origin(survey.box_min, survey.box_max);
      input.unit = choose_unit(survey.box_min, survey.box_max);
    }
    state.origin = input.origin;
    state.unit = input.unit;
    state.has_colours = input.colours != nullptr;
    order.run(input, triangles);
    in_.positions_.erase();
    in_.colours_.erase();
    state.has_directions = in_.directions_.size() > 0;
    if (state.has_directions) {
      ensure(in_.directions_.size() == state.vertices, "each vertex has a direction, or none has");
      rank_directions(store_, in_.directions_, ids_, options_);
      in_.directions_.erase();
    }
    state.repaired.merged_vertices = order.merged();
    if (order.merged() == 0) {
      state.repaired.triangle_soup = 0;  // pieces that touch nowhere
    }
    state.ranks = order.ranks();
  }

  std::uint32_t ranks_in(std::uint32_t block) const {
    const std::uint64_t first = std::uint64_t{block} * options_.tile_size;
    return static_cast<std::uint32_t>(std::min<std::uint64_t>(options_.tile_size, ranks_ - first));
  }

  /// Every triangle in terms of ranks, to the block of its lowest corner and to others it touches.
  void distribute_triangles() {
    const auto memory = static_cast<std::size_t>(options_.memory_bytes / 4);
    const std::uint64_t triangles = in_.state_.triangles;
    home_.emplace(store_, "ingest/home_run_", BlockOfHome{block_of_}, memory, triangles);
    others_.emplace(store_, "ingest/other_run_", BlockOfForeign{}, memory / 2, triangles / 8);
    Reindexer<Index> reindexer(store_, ids_, in_.state_.vertices, options_.memory_bytes / 4,
                               options_.spool_block_bytes);
    reindexer.run([&](const auto& f) { for_each_kept_block(f); },
                  [&](std::vector<Triangle>& block) { distribute(block); });
    in_.narrow_.erase();
    in_.wide_.erase();
    ids_.erase();
    home_->finish();
    others_->finish();
  }

  void distribute(std::vector<Triangle>& block) {
    parallel_indices(block.size(), [&](std::size_t t) {
      Triangle& r = block[t];
      std::rotate(r.begin(), std::min_element(r.begin(), r.end()), r.end());
    });
    std::size_t kept = 0;
    for (const Triangle& t : block) {
      if (std::max(t[1], t[2]) == Reindexer<Index>::kAbsent) {
        ++mesh_.repaired.non_finite_triangles;
        continue;
      }
      if (repeats(t)) {
        ++mesh_.repaired.degenerate_triangles;
        continue;
      }
      block[kept++] = t;
      const std::uint64_t b0 = block_of_(t[0]);
      const std::uint64_t b1 = block_of_(t[1]);
      const std::uint64_t b2 = block_of_(t[2]);
      if (b1 != b0) {
        others_->push({static_cast<std::uint32_t>(b1), t});
      }
      if (b2 != b0 && b2 != b1) {
        others_->push({static_cast<std::uint32_t>(b2), t});
      }
    }
    home_->push(std::span<const Triangle>(block).first(kept));
  }

  void repair(TaskGraph& graph) {
    repair_pass(graph, {});
    if (one_sided_) {
      // Now that it is known which components cannot be oriented, cut those where they turn.
      const std::vector<PatchFate> fates = std::move(fates_);
      home_->finish();
      others_->finish();
      repair_pass(graph, fates);
    }
    home_.reset();
    others_.reset();
  }

  struct RepairState {
    RepairInput<Index> input;
    std::vector<ForeignTriangle> foreign;
    ChunkView<Vec3f> positions;
    ChunkView<Rgba> colours;
    BlockRepair repaired;
  };

  /// Sets the layout, the border table, the counts, and what becomes of each patch.
  void repair_pass(TaskGraph& graph, const std::vector<PatchFate>& fates) {
    const RepairCounts before = mesh_.repaired;
    const std::vector<std::uint64_t> patch_base = std::move(patch_base_);
    patch_base_.clear();
    border_ = {};
    mesh_.layout = {};
    mesh_.triangles.clear();
    mesh_.topology = {};
    mesh_.repaired.isolated_vertices =
        in_.state_.vertices - in_.state_.non_finite - mesh_.repaired.merged_vertices - ranks_;
    std::uint64_t next_triangle = 0;
    PatchJoiner joiner;
    const auto link_memory = static_cast<std::size_t>(options_.memory_bytes / 4);
    LinkSort home_links(store_, "ingest/home_link_", PairOfLink{}, link_memory, 0);
    LinkSort other_links(store_, "ingest/other_link_", PairOfLink{}, link_memory, 0);

    run_pass<RepairState>(
        graph, "repair", blocks_,
        [&](TileId tile, RepairState& s) {
          s.input.block = tile.value;
          s.input.block_size = options_.tile_size;
          s.input.owned = ranks_in(tile.value);
          home_->take_key(tile.value, s.input.home);
          others_->take_key(tile.value, s.foreign);
          s.positions = read(store_, kRankedPosition, tile);
          if (mesh_.has_colours) {
            s.colours = read(store_, kRankedColour, tile);
          }
          if (!fates.empty()) {
            const std::uint64_t first = patch_base[tile.value];
            const std::uint64_t end =
                tile.value + 1 < blocks_ ? patch_base[tile.value + 1] : fates.size();
            s.input.fates = std::span(fates).subspan(first, end - first);
          }
        },
        [](TileId, RepairState& s) {
          s.input.others.reserve(s.foreign.size());
          for (const ForeignTriangle& t : s.foreign) {
            s.input.others.push_back(t.triangle);
          }
          s.repaired = repair_block(std::move(s.input));
        },
        [&](TileId tile, RepairState& s) {
          BlockRepair& r = s.repaired;
          TileExtent extent;
          extent.first = mesh_.layout.node_count;
          extent.owned = r.vertices;
          extent.border_first = mesh_.layout.border_count;
          extent.border = static_cast<std::uint32_t>(r.border.size());
          mesh_.layout.node_count += extent.owned;
          mesh_.layout.border_count += extent.border;
          ensure(mesh_.layout.border_count < 0xffffffffU, "slots of the board are 32 bits wide");
          mesh_.layout.tiles.push_back(extent);
          mesh_.triangles.push_back(
              {next_triangle, r.home, static_cast<std::uint32_t>(r.triangles.size())});
          next_triangle += r.home;
          for (const std::uint32_t v : r.border) {
            const std::uint32_t rank = r.source.empty() ? v : r.source[v];
            border_.rank.push_back(rank);
            border_.vertex.push_back(v);
            border_.position.push_back(s.positions[rank]);
            if (mesh_.has_colours) {
              border_.colour.push_back(s.colours[rank]);
            }
          }
          for (SplitCorner corner : r.split_corners) {
            corner.copy += extent.border_first;
            border_.split.push_back(corner);
          }
          const std::uint64_t base = joiner.add(r.patches);
          patch_base_.push_back(base);
          for (auto [links, sort] :
               {std::pair(&r.home_links, &home_links), std::pair(&r.other_links, &other_links)}) {
            for (PatchLink& link : *links) {
              link.patch += base << 1;
            }
            sort->push(std::span<const PatchLink>(*links));
          }
          mesh_.topology.components += r.settled_components;
          mesh_.repaired.duplicate_triangles += r.duplicate_triangles;
          mesh_.repaired.non_manifold_edges += r.non_manifold_edges;
          mesh_.repaired.split_vertices += r.split_vertices;
          mesh_.repaired.isolated_vertices += r.isolated_vertices;
          mesh_.repaired.flipped_triangles += r.flipped_triangles;
          mesh_.repaired.one_sided_components += r.one_sided_components;
          write(store_, kRepaired, tile, r.triangles);
          write(store_, kForeign, tile, r.foreign);
          write(store_, kMeshBorder, tile, r.border);
          write(store_, kSource, tile, r.source);
          write(store_, kPatchOf, tile, r.patch_of);
        });

    home_links.finish();
    other_links.finish();
    joiner.begin_joining();
    while (!home_links.done()) {
      ensure(!other_links.done() && home_links.front().pair == other_links.front().pair,
             "two blocks see the same triangles between them");
      joiner.join(home_links.front().patch, other_links.front().patch);
      home_links.pop();
      other_links.pop();
    }
    fates_ = joiner.resolve();
    one_sided_ = joiner.any_one_sided();
    if (one_sided_) {
      ensure(fates.empty(), "cutting makes every component orientable");
      mesh_.repaired = before;
      mesh_.repaired.one_sided_components = joiner.one_sided();
    }
    mesh_.topology.components += joiner.components();
    mesh_.topology.vertices = mesh_.layout.node_count;
    mesh_.topology.triangles = next_triangle;
  }

  struct TileState {
    ChunkView<LocalTriangle> triangles;
    ChunkView<std::uint64_t> foreign;
    ChunkView<std::uint32_t> source;
    ChunkView<std::uint32_t> patch_of;
    ChunkView<Vec3f> positions;
    ChunkView<Rgba> colours;
    ChunkView<VertexDirection> directions;
    TileArrays arrays;
  };

  void build_tiles(TaskGraph& graph) {
    std::uint64_t boundary_edges = 0;
    std::vector<std::pair<std::uint64_t, std::uint64_t>> open_loops;
    double side_length = 0.0;
    Vec3f box_min = Vec3f::Constant(std::numeric_limits<float>::max());
    Vec3f box_max = -box_min;
    run_pass<TileState>(
        graph, "tiles", blocks_,
        [&](TileId tile, TileState& s) {
          s.triangles = read(store_, kRepaired, tile);
          s.foreign = read(store_, kForeign, tile);
          s.source = read(store_, kSource, tile);
          s.patch_of = read(store_, kPatchOf, tile);
          s.positions = read(store_, kRankedPosition, tile);
          if (mesh_.has_colours) {
            s.colours = read(store_, kRankedColour, tile);
          }
          if (in_.state_.has_directions) {
            s.directions = read(store_, kRankedDirection, tile);
          }
        },
        [&](TileId tile, TileState& s) {
          TileInput input;
          input.tile = tile.value;
          input.triangles = s.triangles.span();
          input.home = mesh_.triangles[tile.value].owned;
          input.foreign = s.foreign.span();
          input.source = s.source.span();
          input.patch_of = s.patch_of.span();
          const std::uint64_t first = patch_base_[tile.value];
          const std::uint64_t end =
              tile.value + 1 < blocks_ ? patch_base_[tile.value + 1] : fates_.size();
          input.fates = std::span<const PatchFate>(fates_).subspan(first, end - first);
          input.ranked_positions = s.positions.span();
          input.ranked_colours = s.colours.span();
          s.arrays = build_tile(input, mesh_.layout, border_, options_.tile_size);
        },
        [&](TileId tile, TileState& s) {
          TileArrays& a = s.arrays;
          halo_count_.push_back(static_cast<std::uint32_t>(a.halo_ids.size()));
          mesh_.repaired.flipped_triangles += a.flipped_triangles;
          mesh_.topology.boundary_loops += a.closed_loops;
          boundary_edges += a.boundary_edges;
          open_loops.insert(open_loops.end(), a.open_loops.begin(), a.open_loops.end());
          mesh_.area += a.area;
          side_length += a.side_length;
          if (!a.flags.empty()) {
            box_min = box_min.cwiseMin(a.box_min);
            box_max = box_max.cwiseMax(a.box_max);
          }
          write(store_, fields::kPosition, tile, a.positions);
          if (mesh_.has_colours) {
            write(store_, fields::kColour, tile, a.colours);
          }
          if (in_.state_.has_directions) {
            write_directions(tile, s.directions.span(), s.source.span());
          }
          write(store_, fields::kTriangle, tile, a.triangles);
          write(store_, fields::kVertexFlag, tile, a.flags);
          write(store_, fields::kMeshHalo.halo_ids, tile, a.halo_ids);
          write(store_, fields::kMeshHalo.halo_slots, tile, a.halo_slots);
        });
    // Other tiles were looking at the layout while the pass ran, so halo counts wait until here.
    for (std::uint32_t t = 0; t < blocks_; ++t) {
      mesh_.layout.tiles[t].halo = halo_count_[t];
    }
    const std::uint64_t sides = 3 * mesh_.topology.triangles;
    mesh_.topology.boundary_loops += count_open_loops(open_loops);
    mesh_.topology.edges = (sides + boundary_edges) / 2;
    mesh_.mean_edge_length = side_length / static_cast<double>(sides);
    mesh_.box_min = box_min.cast<double>();
    mesh_.box_max = box_max.cast<double>();
  }

  /// `source`: the rank within the block of each owned vertex; empty if they are the same.
  void write_directions(TileId tile, std::span<const VertexDirection> ranked,
                        std::span<const std::uint32_t> source) {
    std::vector<VertexDirection> owned(mesh_.layout.tiles[tile.value].owned);
    for (std::uint32_t v = 0; v < owned.size(); ++v) {
      owned[v] = ranked[source.empty() ? v : source[v]];
    }
    write(store_, fields::kWantedDirection, tile, owned);
  }

  void erase_scratch() {
    for (const std::string_view name :
         {kRankedPosition.name, kRankedColour.name, kRankedDirection.name, kRepaired.name,
          kForeign.name, kSource.name, kPatchOf.name}) {
      store_.erase(name);
    }
  }

  static constexpr Field<std::uint32_t> kMeshBorder = fields::kMeshHalo.border;

  Ingest& in_;
  const IngestOptions& options_;
  Store& store_;
  BlockOf block_of_;
  ScanMesh mesh_;
  std::uint64_t ranks_ = 0;  ///< vertices that are used and finite
  std::uint32_t blocks_ = 0;
  Spool<Index> ids_;
  std::optional<ExternalSort<Triangle, BlockOfHome>> home_;
  std::optional<ExternalSort<ForeignTriangle, BlockOfForeign>> others_;
  BorderTable border_;
  std::vector<std::uint32_t> halo_count_;
  std::vector<std::uint64_t> patch_base_;  ///< per block, its first border patch
  std::vector<PatchFate> fates_;
  bool one_sided_ = false;
};

Ingest::Ingest(Store& store, IngestOptions options, const IngestRecord& left)
    : store_(store),
      options_(std::move(options)),
      state_(left),
      positions_(store, "ingest/raw_position", options_.spool_block_bytes, left.positions),
      colours_(store, "ingest/raw_colour", options_.spool_block_bytes, left.colours),
      directions_(store, "ingest/raw_direction", options_.spool_block_bytes, left.directions),
      narrow_(store, "ingest/raw_triangle", options_.spool_block_bytes, left.narrow),
      wide_(store, "ingest/raw_wide_triangle", options_.spool_block_bytes, left.wide),
      polygons_(store, options_.spool_block_bytes) {
  ensure(options_.tile_size > 0, "a tile holds at least one vertex");
}

Ingest::~Ingest() = default;

void Ingest::add_vertices(std::span<const Vec3d> positions) {
  for (const Vec3d& p : positions) {
    state_.non_finite += is_usable(p) ? 0 : 1;
  }
  state_.vertices += positions.size();
  positions_.append(positions);
}

void Ingest::add_colours(std::span<const Rgba> colours) {
  ensure(colours.size() <= state_.vertices, "colours come after their vertices");
  pad_colours(state_.vertices - colours.size());
  colours_.append(colours);
}

void Ingest::pad_colours(std::uint64_t count) {
  while (colours_.size() < count) {
    colours_.push(kWhite);
  }
}

void Ingest::add_directions(std::span<const VertexDirection> directions) {
  directions_.append(directions);
}

void Ingest::add_triangles(std::span<const std::array<std::uint64_t, 3>> triangles) {
  state_.triangles += triangles.size();
  std::array<std::array<std::uint32_t, 3>, 256> buffer;
  while (!triangles.empty() && wide_.size() == 0) {
    std::size_t count = 0;
    for (; count < std::min(buffer.size(), triangles.size()); ++count) {
      const auto& t = triangles[count];
      if ((t[0] | t[1] | t[2]) >> 32 != 0) {
        break;
      }
      buffer[count] = {static_cast<std::uint32_t>(t[0]), static_cast<std::uint32_t>(t[1]),
                       static_cast<std::uint32_t>(t[2])};
    }
    narrow_.append(std::span(buffer).first(count));
    triangles = triangles.subspan(count);
    if (count < buffer.size()) {
      break;
    }
  }
  wide_.append(triangles);
}

void Ingest::add_polygons(std::span<const std::uint32_t> sizes,
                          std::span<const std::uint64_t> corners) {
  polygons_.add(sizes, corners);
}

std::uint64_t Ingest::cut_polygons() {
  if (polygons_.empty()) {
    return 0;
  }
  std::vector<PolygonCutter::Triangle> widened;
  const auto source = [&](const std::function<void(std::span<const PolygonCutter::Triangle>)>& f) {
    narrow_.for_each_block([&](std::span<const std::array<std::uint32_t, 3>> block) {
      widened.clear();
      for (const auto& t : block) {
        widened.push_back({t[0], t[1], t[2]});
      }
      f(widened);
    });
    wide_.for_each_block(f);
  };
  const PolygonCutter::Counts counts = polygons_.cut(
      source, [&](std::span<const PolygonCutter::Triangle> block) { add_triangles(block); },
      options_.memory_bytes);
  narrow_.finish();
  wide_.finish();
  return counts.duplicates;
}

Reservation Ingest::reserve() const {
  return options_.budget == nullptr
             ? Reservation()
             : options_.budget->reserve(options_.memory_bytes, "sorting the scan");
}

void Ingest::close() {
  if (state_.closed) {
    return;
  }
  if (colours_.size() > 0) {
    pad_colours(state_.vertices);
  }
  positions_.finish();
  colours_.finish();
  directions_.finish();
  narrow_.finish();
  wide_.finish();
  state_.repaired.duplicate_triangles = cut_polygons();
  state_.closed = true;
}

template <class Work>
void Ingest::with_ids(const Work& work) {
  const Reservation memory = reserve();
  close();
  // One bit of an index is spared for the re-indexing.
  if (!options_.wide_ids && state_.vertices < 0x7fffffffU) {
    IngestRun<std::uint32_t> run(*this);
    work(run);
  } else {
    IngestRun<std::uint64_t> run(*this);
    work(run);
  }
}

void Ingest::order() {
  ensure(!state_.ordered, "vertices are sorted once");
  with_ids([](auto& run) { run.order(); });
}

IngestRecord Ingest::hand_over() {
  if (!state_.closed) {
    const Reservation memory = reserve();
    close();
  }
  state_.positions = positions_.hand_over();
  state_.colours = colours_.hand_over();
  state_.directions = directions_.hand_over();
  state_.narrow = narrow_.hand_over();
  state_.wide = wide_.hand_over();
  return state_;
}

ScanMesh Ingest::finish(TaskGraph& graph) {
  if (!state_.ordered) {
    order();
  }
  ScanMesh mesh;
  with_ids([&](auto& run) { mesh = run.finish(graph); });
  if (options_.drop_components > 0 || options_.fill_holes > 0) {
    refine_scan(store_, mesh, options_, graph);
  }
  return mesh;
}

Vec3d choose_origin(const Vec3d& box_min, const Vec3d& box_max) {
  const double diagonal = (box_max - box_min).norm();
  Vec3d origin = Vec3d::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    const double largest = std::max(std::abs(box_min[axis]), std::abs(box_max[axis]));
    if (largest <= 4.0 * diagonal) {
      continue;
    }
    // A step of at most a quarter of the diagonal, coarse enough to be exact in 32 bits.
    int exponent = 0;
    std::frexp(std::max(diagonal, largest * 0x1p-20), &exponent);
    const double step = std::ldexp(1.0, exponent - 3);
    origin[axis] = std::round(0.5 * (box_min[axis] + box_max[axis]) / step) * step;
  }
  return origin;
}

double choose_unit(const Vec3d& box_min, const Vec3d& box_max) {
  // Well inside what fourth powers of lengths may be as 32-bit floats.
  constexpr double kMost = 0x1p20;
  const double side = (box_max - box_min).maxCoeff();
  if (side == 0.0 || (side <= kMost && side >= 1.0 / kMost)) {
    return 1.0;
  }
  int exponent = 0;
  std::frexp(side, &exponent);
  return std::ldexp(1.0, std::max(exponent, -1000));
}

}  // namespace rattan
