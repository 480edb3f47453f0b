// SPDX-License-Identifier: MIT
#include "engine/mesh/tile_mesh.h"

#include <algorithm>
#include <unordered_map>

#include <Eigen/Geometry>

#include "engine/mesh/patches.h"

namespace rattan {

TileMesh load_tile(Store& store, const ScanMesh& mesh, TileId tile) {
  TileMesh t;
  t.extent = mesh.layout.tiles[tile.value];
  t.counts = mesh.triangles[tile.value];
  t.positions = read(store, fields::kPosition, tile);
  t.triangles = read(store, fields::kTriangle, tile);
  t.halo_ids = read(store, fields::kMeshHalo.halo_ids, tile);
  return t;
}

ScanMesh tile_indexed_mesh(Store& store, std::span<const Vec3d> positions,
                           std::span<const std::array<std::uint32_t, 3>> triangles,
                           std::uint32_t tile_size) {
  ScanMesh mesh;
  const auto n = static_cast<std::uint64_t>(positions.size());
  mesh.layout.node_count = n;
  for (std::uint64_t first = 0; first < n; first += tile_size) {
    TileExtent e;
    e.first = first;
    e.owned = static_cast<std::uint32_t>(std::min<std::uint64_t>(tile_size, n - first));
    mesh.layout.tiles.push_back(e);
  }
  const std::size_t tiles = mesh.layout.tiles.size();

  // Canonical triangles: lowest vertex first, ascending.
  std::vector<std::array<std::uint32_t, 3>> sorted(triangles.begin(), triangles.end());
  for (auto& t : sorted) {
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  }
  std::sort(sorted.begin(), sorted.end());

  std::vector<std::vector<std::array<std::uint32_t, 3>>> owned(tiles);
  std::vector<std::vector<std::array<std::uint32_t, 3>>> others(tiles);
  std::vector<std::vector<std::uint64_t>> halo(tiles);
  for (const auto& t : sorted) {
    const std::uint32_t home = t[0] / tile_size;
    owned[home].push_back(t);
    for (int c = 1; c < 3; ++c) {
      const std::uint32_t other = t[c] / tile_size;
      if (other != home && (c == 1 || other != t[1] / tile_size)) {
        others[other].push_back(t);
      }
    }
  }
  mesh.triangles.resize(tiles);
  std::uint64_t next = 0;
  for (std::size_t i = 0; i < tiles; ++i) {
    mesh.triangles[i] = {next, static_cast<std::uint32_t>(owned[i].size()),
                         static_cast<std::uint32_t>(owned[i].size() + others[i].size())};
    next += owned[i].size();
    for (const auto* list : {&owned[i], &others[i]}) {
      for (const auto& t : *list) {
        for (const std::uint32_t v : t) {
          if (v / tile_size != i) {
            halo[i].push_back(v);
          }
        }
      }
    }
    std::sort(halo[i].begin(), halo[i].end());
    halo[i].erase(std::unique(halo[i].begin(), halo[i].end()), halo[i].end());
  }
  std::vector<std::vector<std::uint32_t>> border;
  std::vector<std::vector<std::uint32_t>> slots;
  connect_halos(mesh.layout, halo, border, slots);

  // Boundary vertices and the mesh's invariants, from a plain edge table.
  std::unordered_map<std::uint64_t, int> sides;
  for (const auto& t : sorted) {
    for (int c = 0; c < 3; ++c) {
      const std::uint64_t a = t[c];
      const std::uint64_t b = t[(c + 1) % 3];
      ++sides[std::min(a, b) << 32 | std::max(a, b)];
      mesh.mean_edge_length += (positions[a] - positions[b]).norm();
    }
    mesh.area +=
        0.5 * (positions[t[1]] - positions[t[0]]).cross(positions[t[2]] - positions[t[0]]).norm();
  }
  mesh.mean_edge_length /= std::max<double>(1.0, 3.0 * static_cast<double>(sorted.size()));
  std::vector<std::uint8_t> flags(n, 0);
  ParityUnionFind components(static_cast<std::uint32_t>(n));
  ParityUnionFind loops(static_cast<std::uint32_t>(n));
  for (const auto& [edge, count] : sides) {
    ensure(count <= 2, "tile_indexed_mesh needs a manifold mesh");
    const auto a = static_cast<std::uint32_t>(edge >> 32);
    const auto b = static_cast<std::uint32_t>(edge);
    components.unite(a, b, 0);
    if (count == 1) {
      flags[a] |= kOnBoundary;
      flags[b] |= kOnBoundary;
      loops.unite(a, b, 0);
    }
  }
  for (std::uint32_t v = 0; v < n; ++v) {
    mesh.topology.components += components.find(v).first == v ? 1 : 0;
    mesh.topology.boundary_loops += flags[v] != 0 && loops.find(v).first == v ? 1 : 0;
  }
  mesh.topology.vertices = n;
  mesh.topology.edges = sides.size();
  mesh.topology.triangles = sorted.size();
  if (n > 0) {
    mesh.box_min = mesh.box_max = positions[0];
    for (const Vec3d& p : positions) {
      mesh.box_min = mesh.box_min.cwiseMin(p);
      mesh.box_max = mesh.box_max.cwiseMax(p);
    }
  }

  for (std::size_t i = 0; i < tiles; ++i) {
    const TileExtent& e = mesh.layout.tiles[i];
    const TileId id(static_cast<std::uint32_t>(i));
    std::vector<Vec3f> local;
    for (std::uint32_t v = 0; v < e.owned; ++v) {
      local.push_back(positions[e.first + v].cast<float>());
    }
    for (const std::uint64_t v : halo[i]) {
      local.push_back(positions[v].cast<float>());
    }
    const auto to_local = [&](std::uint32_t v) {
      if (v / tile_size == i) {
        return static_cast<std::uint32_t>(v - e.first);
      }
      const auto at = std::lower_bound(halo[i].begin(), halo[i].end(), v) - halo[i].begin();
      return static_cast<std::uint32_t>(e.owned + at);
    };
    std::vector<LocalTriangle> tris;
    for (const auto* list : {&owned[i], &others[i]}) {
      for (const auto& t : *list) {
        tris.push_back({to_local(t[0]), to_local(t[1]), to_local(t[2])});
      }
    }
    write(store, fields::kPosition, id, local);
    write(store, fields::kTriangle, id, tris);
    write(store, fields::kVertexFlag, id,
          std::span<const std::uint8_t>(flags.data() + e.first, e.owned));
    write(store, fields::kMeshHalo.halo_ids, id, halo[i]);
    write(store, fields::kMeshHalo.halo_slots, id, slots[i]);
    write(store, fields::kMeshHalo.border, id, border[i]);
  }
  return mesh;
}

}  // namespace rattan
