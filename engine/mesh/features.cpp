// SPDX-License-Identifier: MIT
//
// Creases by hysteresis on the dihedral angle, after the idea of J. Canny, "A computational
// approach to edge detection", 1986. Noise bends a fan of triangles everywhere alike, a crease
// bends it at two edges only: that is what tells them apart at the scale of single edges; length
// does the rest.
#include "engine/mesh/features.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <tuple>

#include "engine/core/exact_math.h"
#include "engine/mesh/feature_builder.h"
#include "engine/mesh/vertex_graph.h"

namespace rattan {

namespace {

/// Edges of this share of the crease angle may continue a curve.
constexpr double kWeakShare = 0.6;
/// A sharp edge bends by this many times the root mean square of the others around its ends.
constexpr double kContrast = 2.5;
/// More sharp edges than these around one vertex are rubble.
constexpr std::size_t kMostSharp = 6;

struct State {
  TileMesh tile;
  ChunkView<std::uint8_t> flags;
  VertexFans fans;
  std::vector<FeatureCandidate> found;
  std::uint64_t sharp = 0;  ///< length of sharp edges, in units of FeatureBuilder::units
};

/// Candidates as seen from the tile's owned vertices.
void search_tile(State& s, const FeatureOptions& options, double weak_bend, bool all_sharp,
                 const FeatureBuilder& builder) {
  const std::uint32_t owned = s.tile.extent.owned;
  const std::uint32_t* row = s.fans.row_begin.data();
  const std::uint32_t* neighbor = s.fans.neighbor.data();
  const Vec3f* p = s.tile.positions.span().data();
  const auto id = [&](std::uint32_t v) { return s.tile.global_id(v); };
  const auto add = [&](std::uint32_t i, std::uint32_t j, double bend, double rest, bool boundary) {
    FeatureCandidate c;
    const bool up = id(i) < id(j);
    c.lo = up ? id(i) : id(j);
    c.hi = up ? id(j) : id(i);
    c.p_lo = p[up ? i : j];
    c.p_hi = p[up ? j : i];
    c.bend = static_cast<float>(bend);
    c.rest = static_cast<float>(rest);
    c.seen = boundary ? 3 : (up ? 1 : 2);
    c.boundary = boundary;
    s.found.push_back(c);
  };
  std::vector<Vec3f> normal;
  std::vector<float> bend;
  for (std::uint32_t i = 0; i < owned; ++i) {
    const std::uint32_t begin = row[i];
    const std::uint32_t end = row[i + 1];
    if (end - begin < 2) {
      continue;
    }
    const bool open = (s.flags[i] & kOnBoundary) != 0;
    if (open) {
      // Each boundary edge once, from its lower end.
      for (const std::uint32_t j : {neighbor[begin], neighbor[end - 1]}) {
        if (id(i) < id(j)) {
          add(i, j, 4.0, 0.0, true);
        }
      }
    }
    if (!options.creases) {
      continue;
    }
    const std::uint32_t n = end - begin;
    const std::uint32_t triangles = open ? n - 1 : n;
    normal.resize(triangles);
    bend.resize(n);
    Vec3f a = p[neighbor[begin]] - p[i];
    const Vec3f first = a;
    bool flat = false;
    for (std::uint32_t k = 0; k < triangles; ++k) {
      const Vec3f b = k + 1 < n ? Vec3f(p[neighbor[begin + k + 1]] - p[i]) : first;
      const Vec3f c = a.cross(b);
      const float norm2 = c.squaredNorm();
      flat = flat || !(norm2 > 1e-30F * a.squaredNorm() * b.squaredNorm()) || !(norm2 > 1e-36F);
      normal[k] = c / std::sqrt(std::max(norm2, 1e-36F));
      a = b;
    }
    if (flat) {
      // Triangles without area have no normal: they take the one before.
      for (std::uint32_t k = 0; k < 2 * triangles; ++k) {
        Vec3f& m = normal[k % triangles];
        if (!(m.squaredNorm() > 0.5F)) {
          m = normal[(k + triangles - 1) % triangles];
        }
      }
    }
    float sharpest = 0.0F;
    for (std::uint32_t k = 0; k < n; ++k) {
      const bool rim = open && (k == 0 || k + 1 == n);
      // |n - m|^2 = 2 - 2 cos.
      bend[k] = rim ? 0.0F : (normal[k] - normal[k == 0 ? triangles - 1 : k - 1]).squaredNorm();
      sharpest = std::max(sharpest, bend[k]);
    }
    if (!(static_cast<double>(sharpest) >= weak_bend)) {
      continue;
    }
    for (std::uint32_t k = 0; k < n; ++k) {
      const std::uint32_t j = neighbor[begin + k];
      if (id(i) < id(j) && static_cast<double>(bend[k]) >= builder.strong()) {
        s.sharp += builder.units((p[j] - p[i]).cast<double>().norm());
      }
    }
    double rest = 0.0;
    std::size_t sharp = 0;
    for (std::uint32_t k = 0; k < n; ++k) {
      const auto b = static_cast<double>(bend[k]);
      if (b >= weak_bend) {
        ++sharp;
      } else {
        rest += b;
      }
    }
    if (sharp > kMostSharp && !all_sharp) {
      continue;
    }
    const double noise = n > sharp ? rest / static_cast<double>(n - sharp) : 0.0;
    for (std::uint32_t k = 0; k < n; ++k) {
      const auto b = static_cast<double>(bend[k]);
      const bool clear = sharp <= kMostSharp && b >= kContrast * kContrast * noise;
      if (b >= weak_bend && (clear || (all_sharp && b >= builder.strong()))) {
        add(i, neighbor[begin + k], b, noise, false);
      }
    }
  }
}

}  // namespace

bool FeatureSet::is_corner(std::uint64_t vertex) const {
  return std::binary_search(corners_.begin(), corners_.end(), vertex);
}

bool FeatureSet::is_loose_end(std::uint64_t vertex) const {
  return std::binary_search(loose_ends_.begin(), loose_ends_.end(), vertex);
}

TileFeatures FeatureSet::of_tile(const TileExtent& extent,
                                 std::span<const std::uint64_t> halo_ids) const {
  TileFeatures out;
  const auto from = std::lower_bound(vertices_.begin(), vertices_.end(), extent.first);
  for (auto v = from; v != vertices_.end() && *v < extent.first + extent.owned; ++v) {
    const auto at = static_cast<std::size_t>(v - vertices_.begin());
    FeatureMark m;
    m.vertex = static_cast<std::uint32_t>(*v - extent.first);
    m.first = static_cast<std::uint32_t>(out.neighbor.size());
    m.neighbors = first_[at + 1] - first_[at];
    m.corner = std::binary_search(followed_corners_.begin(), followed_corners_.end(), *v);
    for (std::uint32_t k = first_[at]; k < first_[at + 1]; ++k) {
      const std::uint64_t id = neighbors_[k];
      const bool own = id >= extent.first && id < extent.first + extent.owned;
      out.neighbor.push_back(
          own ? static_cast<std::uint32_t>(id - extent.first)
              : extent.owned +
                    static_cast<std::uint32_t>(
                        std::lower_bound(halo_ids.begin(), halo_ids.end(), id) - halo_ids.begin()));
    }
    out.marks.push_back(m);
  }
  return out;
}

std::vector<std::array<std::uint32_t, 2>> FeatureSet::tile_creases(const TileMesh& mesh) const {
  std::vector<std::array<std::uint32_t, 2>> out;
  if (crease_edges_ == 0) {
    return out;
  }
  const auto halo = mesh.halo_ids.span();
  const std::uint64_t first = mesh.extent.first;
  const std::uint32_t owned = mesh.extent.owned;
  const auto local = [&](std::uint64_t id) -> std::uint32_t {
    if (id >= first && id < first + owned) {
      return static_cast<std::uint32_t>(id - first);
    }
    const auto at = std::lower_bound(halo.begin(), halo.end(), id);
    return at != halo.end() && *at == id ? owned + static_cast<std::uint32_t>(at - halo.begin())
                                         : 0xffffffffU;
  };
  const auto list = [&](std::vector<FeatureEdge>::const_iterator e, std::uint64_t end) {
    for (; e != edges_.end() && e->lo < end; ++e) {
      const std::uint32_t hi = e->boundary ? 0xffffffffU : local(e->hi);
      if (hi != 0xffffffffU) {
        out.push_back({local(e->lo), hi});
      }
    }
  };
  const auto from = [&](std::vector<FeatureEdge>::const_iterator begin, std::uint64_t id) {
    return std::lower_bound(begin, edges_.end(), id,
                            [](const FeatureEdge& e, std::uint64_t v) { return e.lo < v; });
  };
  list(from(edges_.begin(), first), first + owned);
  for (const std::uint64_t id : halo) {
    if (std::binary_search(all_vertices_.begin(), all_vertices_.end(), id)) {
      list(from(edges_.begin(), id), id + 1);
    }
  }
  return out;
}

FeatureSet find_features(Store& store, const ScanMesh& mesh, const FeatureOptions& options,
                         TaskGraph& tasks, bool make_graph) {
  const double weak =
      exact::sincos(0.5 * kWeakShare * options.crease_degrees / 180.0 * exact::kPi).sin;
  const double strong = exact::sincos(0.5 * options.crease_degrees / 180.0 * exact::kPi).sin;
  FeatureBuilder builder(options, 4.0 * strong * strong);
  // Once for clear curves; where these are most of what is sharp, once more for the rest.
  for (const bool all_sharp : {false, true}) {
    run_pass<State>(
        tasks, "features", mesh.layout.tile_count(),
        [&](TileId id, State& s) {
          s.tile = load_tile(store, mesh, id);
          s.flags = read(store, fields::kVertexFlag, id);
        },
        [&](TileId id, State& s) {
          const TileExtent& extent = mesh.layout.tiles[id.value];
          s.fans = build_fans(s.tile);
          search_tile(s, options, 4.0 * weak * weak, all_sharp, builder);
          builder.reduce_tile(extent.first, extent.owned, s.found);
        },
        [&](TileId id, State& s) {
          builder.add(s.found, s.sharp);
          if (make_graph && !all_sharp) {
            write_fans(store, id, s.fans);
          }
        });
    if (all_sharp) {
      builder.add_ragged();
    } else if (!builder.find_clear()) {
      break;
    }
  }
  return builder.finish();
}

}  // namespace rattan
