// SPDX-License-Identifier: MIT
#include "engine/mesh/refine.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "engine/core/errors.h"
#include "engine/mesh/fill_hole.h"
#include "engine/mesh/patches.h"

namespace rattan {

namespace {

/// A tile with what connects it to others.
struct LoadedTile {
  TileMesh mesh;
  ChunkView<std::uint32_t> border;
  ChunkView<std::uint32_t> slots;

  void load(Store& store, const ScanMesh& scan, TileId tile) {
    mesh = load_tile(store, scan, tile);
    border = read(store, fields::kMeshHalo.border, tile);
    slots = read(store, fields::kMeshHalo.halo_slots, tile);
  }
  /// f(local vertex, slot of the board) for all that other tiles know.
  template <class F>
  void for_each_slot(const F& f) const {
    for (std::uint32_t k = 0; k < border.size(); ++k) {
      f(border[k], static_cast<std::uint32_t>(mesh.extent.border_first) + k);
    }
    for (std::uint32_t k = 0; k < slots.size(); ++k) {
      f(mesh.extent.owned + k, slots[k]);
    }
  }
  /// Sets of vertices that the tile's triangles connect.
  ParityUnionFind pieces() const {
    ParityUnionFind sets(mesh.local_vertices());
    for (const LocalTriangle& t : mesh.triangles) {
      sets.unite(t[0], t[1], 0);
      sets.unite(t[0], t[2], 0);
    }
    return sets;
  }
};

/// Which components are too small: judged inside a tile where they end there, else by the slots of
/// the board that they reach.
class SmallComponents {
 public:
  SmallComponents(Store& store, const ScanMesh& scan, std::uint64_t least, TaskGraph& graph)
      : least_(least) {
    if (least_ > 0) {
      find(store, scan, graph);
    }
  }

  std::uint64_t components() const { return components_; }
  std::uint64_t triangles() const { return triangles_; }

  /// Per local vertex of the tile: 0 if its component is too small.
  std::vector<std::uint8_t> kept(const LoadedTile& tile) const {
    std::vector<std::uint8_t> keep(tile.mesh.local_vertices(), 1);
    if (components_ == 0) {
      return keep;
    }
    ParityUnionFind sets = tile.pieces();
    std::vector<std::uint64_t> size(keep.size(), 0);
    for (const LocalTriangle& t : tile.mesh.triangles.span().first(tile.mesh.counts.owned)) {
      ++size[sets.find(t[0]).first];
    }
    for (std::uint32_t v = 0; v < keep.size(); ++v) {
      keep[v] = size[v] < least_ ? 0 : 1;
    }
    tile.for_each_slot([&](std::uint32_t v, std::uint32_t slot) {
      keep[sets.find(v).first] = dropped_[slot] == 0 ? 1 : 0;
    });
    for (std::uint32_t v = 0; v < keep.size(); ++v) {
      keep[v] = keep[sets.find(v).first];
    }
    return keep;
  }

 private:
  struct State {
    LoadedTile tile;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> joined;  ///< slots of one component
    std::vector<std::pair<std::uint32_t, std::uint64_t>> sizes;   ///< slot, triangles
    std::uint64_t components = 0;  ///< that end inside the tile and are too small
    std::uint64_t triangles = 0;
  };

  void find(Store& store, const ScanMesh& scan, TaskGraph& graph) {
    const auto slots = static_cast<std::uint32_t>(scan.layout.border_count);
    ParityUnionFind sets(slots);
    std::vector<std::pair<std::uint32_t, std::uint64_t>> sizes;
    run_pass<State>(
        graph, "components", scan.layout.tile_count(),
        [&](TileId tile, State& s) { s.tile.load(store, scan, tile); },
        [&](TileId, State& s) { measure(s); },
        [&](TileId, State& s) {
          for (const auto& [a, b] : s.joined) {
            sets.unite(a, b, 0);
          }
          sizes.insert(sizes.end(), s.sizes.begin(), s.sizes.end());
          components_ += s.components;
          triangles_ += s.triangles;
        });
    std::vector<std::uint64_t> total(slots, 0);
    for (const auto& [slot, size] : sizes) {
      total[sets.find(slot).first] += size;
    }
    dropped_.resize(slots);
    for (std::uint32_t slot = 0; slot < slots; ++slot) {
      const std::uint32_t root = sets.find(slot).first;
      dropped_[slot] = total[root] < least_ ? 1 : 0;
      if (root == slot && dropped_[slot] != 0) {
        ++components_;
        triangles_ += total[root];
      }
    }
  }

  void measure(State& s) const {
    constexpr std::uint32_t kNone = 0xffffffffU;
    ParityUnionFind sets = s.tile.pieces();
    std::vector<std::uint64_t> size(sets.size(), 0);
    for (const LocalTriangle& t : s.tile.mesh.triangles.span().first(s.tile.mesh.counts.owned)) {
      ++size[sets.find(t[0]).first];
    }
    std::vector<std::uint32_t> slot_of(sets.size(), kNone);
    s.tile.for_each_slot([&](std::uint32_t v, std::uint32_t slot) {
      const std::uint32_t root = sets.find(v).first;
      if (slot_of[root] == kNone) {
        slot_of[root] = slot;
        s.sizes.emplace_back(slot, size[root]);
      } else {
        s.joined.emplace_back(slot_of[root], slot);
      }
    });
    for (std::uint32_t v = 0; v < sets.size(); ++v) {
      if (sets.find(v).first == v && slot_of[v] == kNone && size[v] < least_) {
        ++s.components;
        s.triangles += size[v];
      }
    }
  }

  std::uint64_t least_;
  std::vector<std::uint8_t> dropped_;  ///< per slot
  std::uint64_t components_ = 0;
  std::uint64_t triangles_ = 0;
};

/// New triangles, over old vertices and new ones, which are numbered behind them.
struct Filling {
  std::vector<Vec3d> positions;
  std::vector<Rgba> colours;
  std::vector<std::array<std::uint64_t, 3>> triangles;
  std::uint64_t holes = 0;
};

class HoleFinder {
 public:
  HoleFinder(Store& store, const ScanMesh& scan, const SmallComponents& small, std::uint64_t most,
             TaskGraph& graph)
      : store_(store), scan_(scan), small_(small), most_(most), graph_(graph) {}

  Filling run() {
    collect_boundary();
    trace();
    find_chords();
    return fill();
  }

 private:
  /// The boundary leaves a vertex for `next`, with a triangle to its left.
  struct BoundaryVertex {
    std::uint64_t id = 0;
    std::uint64_t next = 0;
    Vec3f position = Vec3f::Zero();
    Rgba colour{};
  };
  struct Corner {
    std::uint64_t id = 0;
    std::uint32_t hole = 0;
    std::uint32_t place = 0;  ///< along the hole
  };
  struct Chord {
    std::uint32_t hole = 0;
    std::uint32_t low = 0;
    std::uint32_t high = 0;
    friend auto operator<=>(const Chord&, const Chord&) = default;
  };

  void collect_boundary() {
    struct State {
      LoadedTile tile;
      ChunkView<std::uint8_t> flags;
      ChunkView<Rgba> colours;
      std::vector<BoundaryVertex> found;
    };
    run_pass<State>(
        graph_, "boundary", scan_.layout.tile_count(),
        [&](TileId tile, State& s) {
          s.tile.load(store_, scan_, tile);
          s.flags = read(store_, fields::kVertexFlag, tile);
          if (scan_.has_colours) {
            s.colours = read(store_, fields::kColour, tile);
          }
        },
        [&](TileId, State& s) {
          const TileMesh& mesh = s.tile.mesh;
          const std::vector<std::uint8_t> keep = small_.kept(s.tile);
          // Each neighbour follows the vertex in one triangle and precedes it in another, but for
          // the one that the boundary leaves for, which only follows, and the one it comes from.
          std::vector<std::uint64_t> sum(mesh.extent.owned, 0);
          std::vector<std::uint64_t> squares(mesh.extent.owned, 0);
          for (const LocalTriangle& t : mesh.triangles) {
            for (int c = 0; c < 3; ++c) {
              if (t[c] < mesh.extent.owned) {
                const std::uint64_t x = t[(c + 1) % 3];
                const std::uint64_t y = t[(c + 2) % 3];
                sum[t[c]] += x - y;
                squares[t[c]] += x * x - y * y;
              }
            }
          }
          for (std::uint32_t v = 0; v < mesh.extent.owned; ++v) {
            if ((s.flags[v] & kOnBoundary) != 0 && keep[v] != 0) {
              const auto difference = static_cast<std::int64_t>(sum[v]);
              const auto total = static_cast<std::int64_t>(squares[v]) / difference;
              const auto next = static_cast<std::uint32_t>((total + difference) / 2);
              s.found.push_back({mesh.global_id(v), mesh.global_id(next), mesh.positions[v],
                                 scan_.has_colours ? s.colours[v] : Rgba{}});
            }
          }
        },
        [&](TileId, State& s) {
          boundary_.insert(boundary_.end(), s.found.begin(), s.found.end());
        });
  }

  std::size_t find(std::uint64_t id) const {
    const auto at = std::lower_bound(
        boundary_.begin(), boundary_.end(), id,
        [](const BoundaryVertex& b, std::uint64_t wanted) { return b.id < wanted; });
    ensure(at != boundary_.end() && at->id == id, "the boundary goes on at each of its vertices");
    return static_cast<std::size_t>(at - boundary_.begin());
  }

  void trace() {
    std::vector<std::uint8_t> visited(boundary_.size(), 0);
    std::vector<std::size_t> loop;
    for (std::size_t start = 0; start < boundary_.size(); ++start) {
      if (visited[start] != 0) {
        continue;
      }
      loop.clear();
      std::uint64_t length = 0;
      for (std::size_t at = start; visited[at] == 0; at = find(boundary_[at].next)) {
        visited[at] = 1;
        if (++length <= most_) {
          loop.push_back(at);
        }
      }
      if (length > most_) {
        continue;
      }
      const auto hole = static_cast<std::uint32_t>(hole_begin_.size() - 1);
      for (std::uint32_t k = 0; k < loop.size(); ++k) {
        corners_.push_back({boundary_[loop[k]].id, hole, k});
      }
      members_.insert(members_.end(), loop.begin(), loop.end());
      hole_begin_.push_back(members_.size());
    }
    std::sort(corners_.begin(), corners_.end(),
              [](const Corner& a, const Corner& b) { return a.id < b.id; });
  }

  const Corner* corner(std::uint64_t id) const {
    const auto at =
        std::lower_bound(corners_.begin(), corners_.end(), id,
                         [](const Corner& c, std::uint64_t wanted) { return c.id < wanted; });
    return at != corners_.end() && at->id == id ? &*at : nullptr;
  }

  /// Edges of the scan between two corners of one hole, and holes that are one triangle's outline.
  void find_chords() {
    struct State {
      TileMesh mesh;
      ChunkView<std::uint8_t> flags;
      std::vector<Chord> chords;
      std::vector<std::uint32_t> outlines;
    };
    if (corners_.empty()) {
      return;
    }
    outline_.assign(hole_begin_.size() - 1, 0);
    run_pass<State>(
        graph_, "chords", scan_.layout.tile_count(),
        [&](TileId tile, State& s) {
          s.mesh = load_tile(store_, scan_, tile);
          s.flags = read(store_, fields::kVertexFlag, tile);
        },
        [&](TileId, State& s) {
          for (const LocalTriangle& t : s.mesh.triangles.span().first(s.mesh.counts.owned)) {
            std::array<const Corner*, 3> c{};
            for (int k = 0; k < 3; ++k) {
              if (t[k] >= s.mesh.extent.owned || (s.flags[t[k]] & kOnBoundary) != 0) {
                c[k] = corner(s.mesh.global_id(t[k]));
              }
            }
            for (int k = 0; k < 3; ++k) {
              const Corner* a = c[k];
              const Corner* b = c[(k + 1) % 3];
              if (a != nullptr && b != nullptr && a->hole == b->hole) {
                s.chords.push_back(
                    {a->hole, std::min(a->place, b->place), std::max(a->place, b->place)});
              }
            }
            if (c[0] != nullptr && c[1] != nullptr && c[2] != nullptr && c[0]->hole == c[1]->hole &&
                c[0]->hole == c[2]->hole &&
                hole_begin_[c[0]->hole + 1] - hole_begin_[c[0]->hole] == 3) {
              s.outlines.push_back(c[0]->hole);
            }
          }
        },
        [&](TileId, State& s) {
          chords_.insert(chords_.end(), s.chords.begin(), s.chords.end());
          for (const std::uint32_t hole : s.outlines) {
            outline_[hole] = 1;
          }
        });
    std::sort(chords_.begin(), chords_.end());
    chords_.erase(std::unique(chords_.begin(), chords_.end()), chords_.end());
  }

  Filling fill() const {
    Filling out;
    std::vector<Vec3d> loop;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> taken;
    auto chord = chords_.begin();
    for (std::uint32_t hole = 0; hole + 1 < hole_begin_.size(); ++hole) {
      taken.clear();
      for (; chord != chords_.end() && chord->hole == hole; ++chord) {
        taken.emplace_back(chord->low, chord->high);
      }
      if (outline_[hole] != 0) {
        continue;
      }
      const auto members =
          std::span(members_).subspan(hole_begin_[hole], hole_begin_[hole + 1] - hole_begin_[hole]);
      loop.clear();
      for (const std::size_t b : members) {
        loop.push_back(boundary_[b].position.cast<double>());
      }
      ++out.holes;
      const auto triangles = triangulate_hole(loop, taken);
      // Against the direction of the loop, which has its triangles on the left.
      for (const auto& t : triangles) {
        out.triangles.push_back({boundary_[members[t[2]]].id, boundary_[members[t[1]]].id,
                                 boundary_[members[t[0]]].id});
      }
      if (triangles.empty()) {
        add_centre(members, out);
      }
    }
    return out;
  }

  void add_centre(std::span<const std::size_t> members, Filling& out) const {
    const std::uint64_t centre = scan_.topology.vertices + out.positions.size();
    Vec3d mean = Vec3d::Zero();
    std::array<std::uint64_t, 4> tint{};
    for (std::size_t k = 0; k < members.size(); ++k) {
      const BoundaryVertex& b = boundary_[members[k]];
      mean += b.position.cast<double>();
      for (std::size_t c = 0; c < 4; ++c) {
        tint[c] += b.colour[c];
      }
      out.triangles.push_back({boundary_[members[(k + 1) % members.size()]].id, b.id, centre});
    }
    out.positions.emplace_back(mean / static_cast<double>(members.size()));
    Rgba colour;
    for (std::size_t c = 0; c < 4; ++c) {
      colour[c] = static_cast<std::uint8_t>(tint[c] / members.size());
    }
    out.colours.push_back(colour);
  }

  Store& store_;
  const ScanMesh& scan_;
  const SmallComponents& small_;
  std::uint64_t most_;
  TaskGraph& graph_;
  std::vector<BoundaryVertex> boundary_;  ///< ascending by id
  std::vector<std::size_t> members_;      ///< of the holes, in order along each
  std::vector<std::size_t> hole_begin_{0};
  std::vector<Corner> corners_;  ///< of all holes, ascending by id
  std::vector<Chord> chords_;
  std::vector<std::uint8_t> outline_;
};

void feed(Store& store, const ScanMesh& scan, const SmallComponents& small, const Filling& filling,
          Ingest& again) {
  std::vector<Vec3d> positions;
  std::vector<std::array<std::uint64_t, 3>> triangles;
  for (std::uint32_t t = 0; t < scan.layout.tile_count(); ++t) {
    LoadedTile tile;
    tile.load(store, scan, TileId(t));
    const TileMesh& mesh = tile.mesh;
    positions.clear();
    for (std::uint32_t v = 0; v < mesh.extent.owned; ++v) {
      positions.push_back(mesh.positions[v].cast<double>());
    }
    again.add_vertices(positions);
    if (scan.has_colours) {
      const ChunkView<Rgba> colours = read(store, fields::kColour, TileId(t));
      again.add_colours(colours.span().first(mesh.extent.owned));
    }
    const std::vector<std::uint8_t> keep = small.kept(tile);
    triangles.clear();
    for (const LocalTriangle& c : mesh.triangles.span().first(mesh.counts.owned)) {
      if (keep[c[0]] != 0) {
        triangles.push_back({mesh.global_id(c[0]), mesh.global_id(c[1]), mesh.global_id(c[2])});
      }
    }
    again.add_triangles(triangles);
  }
  if (!filling.positions.empty()) {
    again.add_vertices(filling.positions);
    if (scan.has_colours) {
      again.add_colours(filling.colours);
    }
  }
  again.add_triangles(filling.triangles);
}

void erase_tiles(Store& store) {
  for (const std::string_view name :
       {fields::kPosition.name, fields::kColour.name, fields::kTriangle.name,
        fields::kVertexFlag.name, fields::kMeshHalo.halo_ids.name,
        fields::kMeshHalo.halo_slots.name, fields::kMeshHalo.border.name}) {
    store.erase(name);
  }
}

}  // namespace

void refine_scan(Store& store, ScanMesh& mesh, const IngestOptions& options, TaskGraph& graph) {
  const SmallComponents small(store, mesh, options.drop_components, graph);
  Filling filling;
  if (options.fill_holes > 0) {
    filling = HoleFinder(store, mesh, small, options.fill_holes, graph).run();
  }
  if (small.components() == 0 && filling.holes == 0) {
    return;
  }
  if (small.triangles() == mesh.topology.triangles) {
    throw InputError(
        options.input_name, "",
        "every component has fewer than " + std::to_string(options.drop_components) + " triangles",
        "Give a smaller --drop-components");
  }
  IngestOptions plain = options;
  plain.merge = Merge::kNever;
  plain.drop_components = 0;
  plain.fill_holes = 0;
  plain.budget = nullptr;  // what the caller reserved serves here
  Ingest again(store, plain);
  feed(store, mesh, small, filling, again);
  erase_tiles(store);
  ScanMesh refined = again.finish(graph);
  ensure(refined.repaired.non_manifold_edges == 0 && refined.repaired.split_vertices == 0,
         "filled holes leave nothing to repair");
  refined.origin = mesh.origin + mesh.unit * refined.origin;
  refined.unit *= mesh.unit;
  refined.repaired = mesh.repaired;
  refined.repaired.dropped_components = small.components();
  refined.repaired.dropped_triangles = small.triangles();
  refined.repaired.filled_holes = filling.holes;
  refined.repaired.filled_triangles = filling.triangles.size();
  mesh = std::move(refined);
}

}  // namespace rattan
