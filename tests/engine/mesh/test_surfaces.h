// SPDX-License-Identifier: MIT
#pragma once

// Small surfaces built in code, and global views of tiled fields, for the tests of engine/mesh,
// engine/field and engine/param.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "engine/core/memory_store.h"
#include "engine/mesh/halo_view.h"
#include "engine/mesh/tile_mesh.h"
#include "engine/mesh/vertex_graph.h"

namespace rattan::testing {

struct Surface {
  std::vector<Vec3d> positions;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// (nu x nv) quads split into triangles; `close_u`, `close_v` glue the sides. `diagonal(i, j)`
/// picks the split.
inline Surface grid_surface(
    std::uint32_t nu, std::uint32_t nv, bool close_u, bool close_v,
    const std::function<Vec3d(double, double)>& at,
    const std::function<bool(std::uint32_t, std::uint32_t)>& diagonal =
        [](std::uint32_t i, std::uint32_t j) { return (i + j) % 2 == 0; }) {
  Surface s;
  const std::uint32_t cu = close_u ? nu : nu + 1;
  const std::uint32_t cv = close_v ? nv : nv + 1;
  for (std::uint32_t j = 0; j < cv; ++j) {
    for (std::uint32_t i = 0; i < cu; ++i) {
      s.positions.push_back(at(static_cast<double>(i) / nu, static_cast<double>(j) / nv));
    }
  }
  const auto id = [&](std::uint32_t i, std::uint32_t j) { return (j % cv) * cu + i % cu; };
  for (std::uint32_t j = 0; j < nv; ++j) {
    for (std::uint32_t i = 0; i < nu; ++i) {
      const std::uint32_t a = id(i, j);
      const std::uint32_t b = id(i + 1, j);
      const std::uint32_t c = id(i + 1, j + 1);
      const std::uint32_t d = id(i, j + 1);
      if (diagonal(i, j)) {
        s.triangles.push_back({a, b, c});
        s.triangles.push_back({a, c, d});
      } else {
        s.triangles.push_back({a, b, d});
        s.triangles.push_back({b, c, d});
      }
    }
  }
  return s;
}

inline Surface plane(std::uint32_t nu, std::uint32_t nv, double width, double height) {
  return grid_surface(nu, nv, false, false,
                      [=](double u, double v) { return Vec3d(width * u, height * v, 0.0); });
}

inline Surface cylinder(std::uint32_t nu, std::uint32_t nv, double radius, double height) {
  return grid_surface(nu, nv, true, false, [=](double u, double v) {
    const double a = 2.0 * M_PI * u;
    return Vec3d(radius * std::cos(a), radius * std::sin(a), height * v);
  });
}

inline Surface torus(std::uint32_t nu, std::uint32_t nv, double big, double small) {
  return grid_surface(nu, nv, true, true, [=](double u, double v) {
    const double a = 2.0 * M_PI * u;
    const double b = 2.0 * M_PI * v;
    const double rho = big + small * std::cos(b);
    return Vec3d(rho * std::cos(a), rho * std::sin(a), small * std::sin(b));
  });
}

/// Icosahedron with each side split into `n`, pushed to the sphere.
inline Surface sphere(std::uint32_t n, double radius) {
  const double g = 0.5 * (1.0 + std::sqrt(5.0));
  const std::array<Vec3d, 12> corner = {Vec3d(-1, g, 0),  Vec3d(1, g, 0),   Vec3d(-1, -g, 0),
                                        Vec3d(1, -g, 0),  Vec3d(0, -1, g),  Vec3d(0, 1, g),
                                        Vec3d(0, -1, -g), Vec3d(0, 1, -g),  Vec3d(g, 0, -1),
                                        Vec3d(g, 0, 1),   Vec3d(-g, 0, -1), Vec3d(-g, 0, 1)};
  constexpr std::array<std::array<int, 3>, 20> kFaces = {
      {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
       {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
       {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}}};
  Surface s;
  std::map<std::array<std::uint32_t, 6>, std::uint32_t> known;
  const auto vertex = [&](const std::array<int, 3>& f, std::uint32_t i, std::uint32_t j) {
    // Key: corner indices with their weights, without zero weights, sorted.
    std::array<std::pair<std::uint32_t, std::uint32_t>, 3> w = {
        {{static_cast<std::uint32_t>(f[0]), n - i - j},
         {static_cast<std::uint32_t>(f[1]), i},
         {static_cast<std::uint32_t>(f[2]), j}}};
    Vec3d p = Vec3d::Zero();
    for (auto& [c, k] : w) {
      p += k * corner[c];
      if (k == 0) {
        c = 99;
      }
    }
    std::sort(w.begin(), w.end());
    const std::array<std::uint32_t, 6> key = {w[0].first,  w[0].second, w[1].first,
                                              w[1].second, w[2].first,  w[2].second};
    const auto [at, added] = known.try_emplace(key, s.positions.size());
    if (added) {
      s.positions.push_back(radius * p.normalized());
    }
    return at->second;
  };
  for (const auto& f : kFaces) {
    for (std::uint32_t i = 0; i < n; ++i) {
      for (std::uint32_t j = 0; i + j < n; ++j) {
        s.triangles.push_back({vertex(f, i, j), vertex(f, i + 1, j), vertex(f, i, j + 1)});
        if (i + j + 1 < n) {
          s.triangles.push_back(
              {vertex(f, i + 1, j), vertex(f, i + 1, j + 1), vertex(f, i, j + 1)});
        }
      }
    }
  }
  return s;
}

/// A slab with `holes` square holes, as the smoothed skin of small cubes: genus `holes`.
inline Surface slab_with_holes(int holes, int scale) {
  const int nx = (2 * holes + 1) * scale;
  const int ny = 3 * scale;
  const int nz = scale;
  const auto solid = [&](int x, int y, int z) {
    if (x < 0 || y < 0 || z < 0 || x >= nx || y >= ny || z >= nz) {
      return false;
    }
    return !(y / scale == 1 && (x / scale) % 2 == 1);
  };
  Surface s;
  std::map<std::array<int, 3>, std::uint32_t> known;
  const auto vertex = [&](int x, int y, int z) {
    const auto [at, added] = known.try_emplace({x, y, z}, s.positions.size());
    if (added) {
      s.positions.push_back(Vec3d(x, y, z));
    }
    return at->second;
  };
  for (int x = 0; x < nx; ++x) {
    for (int y = 0; y < ny; ++y) {
      for (int z = 0; z < nz; ++z) {
        if (!solid(x, y, z)) {
          continue;
        }
        for (int axis = 0; axis < 3; ++axis) {
          for (int side = 0; side < 2; ++side) {
            std::array<int, 3> d{};
            d[axis] = side == 1 ? 1 : -1;
            if (solid(x + d[0], y + d[1], z + d[2])) {
              continue;
            }
            std::array<std::uint32_t, 4> q{};
            const int u = (axis + 1) % 3;
            const int v = (axis + 2) % 3;
            for (int c = 0; c < 4; ++c) {
              std::array<int, 3> p = {x, y, z};
              p[axis] += side;
              const int cc = side == 1 ? c : 3 - c;
              p[u] += cc == 1 || cc == 2 ? 1 : 0;
              p[v] += cc == 2 || cc == 3 ? 1 : 0;
              q[c] = vertex(p[0], p[1], p[2]);
            }
            s.triangles.push_back({q[0], q[1], q[2]});
            s.triangles.push_back({q[0], q[2], q[3]});
          }
        }
      }
    }
  }
  // Round the corners off, so that normals vary slowly.
  std::vector<std::vector<std::uint32_t>> ring(s.positions.size());
  for (const auto& t : s.triangles) {
    for (int c = 0; c < 3; ++c) {
      ring[t[c]].push_back(t[(c + 1) % 3]);
    }
  }
  for (int round = 0; round < 2 * scale; ++round) {
    std::vector<Vec3d> next(s.positions.size());
    for (std::size_t i = 0; i < next.size(); ++i) {
      Vec3d sum = Vec3d::Zero();
      for (const std::uint32_t j : ring[i]) {
        sum += s.positions[j];
      }
      next[i] = 0.5 * s.positions[i] + 0.5 * sum / static_cast<double>(ring[i].size());
    }
    s.positions = next;
  }
  return s;
}

/// Moves every vertex by a reproducible random vector of length up to `size`.
inline Surface jittered(Surface s, double size, unsigned seed = 1) {
  std::mt19937 random(seed);
  const auto unit = [&] { return static_cast<double>(random()) / 4294967295.0 - 0.5; };
  for (Vec3d& p : s.positions) {
    p += size * Vec3d(unit(), unit(), unit());
  }
  return s;
}

/// A scan in a store of its own.
struct TiledScan {
  MemoryStore store;
  ScanMesh mesh;
  TaskGraph tasks;

  TiledScan(const Surface& s, std::uint32_t tile_size) {
    mesh = tile_indexed_mesh(store, s.positions, s.triangles, tile_size);
  }
  /// Owned values of all tiles, in global order.
  template <class T>
  std::vector<T> all(Field<T> field) {
    std::vector<T> values;
    for (std::uint32_t t = 0; t < mesh.layout.tile_count(); ++t) {
      const ChunkView<T> chunk = read(store, field, TileId(t));
      values.insert(values.end(), chunk.begin(), chunk.end());
    }
    return values;
  }
  /// Replaces a field and its board by given global values.
  template <class T>
  void set(Field<T> field, const std::vector<T>& values) {
    BoardWriter<T> writer(field, mesh.layout);
    for (std::uint32_t t = 0; t < mesh.layout.tile_count(); ++t) {
      const TileExtent& e = mesh.layout.tiles[t];
      writer.commit(store, fields::kMeshHalo, TileId(t),
                    std::span<const T>(values.data() + e.first, e.owned));
    }
    writer.finish(store);
  }
  /// Neighbours of all half-edges as global ids, in row order.
  std::vector<std::uint64_t> global_neighbors() {
    std::vector<std::uint64_t> ids;
    for (std::uint32_t t = 0; t < mesh.layout.tile_count(); ++t) {
      const TileMesh tile = load_tile(store, mesh, TileId(t));
      for (const std::uint32_t n : read(store, fields::kNeighbor, TileId(t))) {
        ids.push_back(tile.global_id(n));
      }
    }
    return ids;
  }
  /// Row offsets of all owned vertices, in global order.
  std::vector<std::uint64_t> global_rows() {
    std::vector<std::uint64_t> rows = {0};
    for (std::uint32_t t = 0; t < mesh.layout.tile_count(); ++t) {
      const ChunkView<std::uint32_t> row = read(store, fields::kRowBegin, TileId(t));
      const std::uint64_t base = rows.back();
      for (std::size_t i = 1; i < row.size(); ++i) {
        rows.push_back(base + row[i]);
      }
    }
    return rows;
  }
};

/// Bytes of a vector of plain values, to compare to the last bit.
template <class T>
std::string bytes_of(const std::vector<T>& values) {
  return std::string(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

}  // namespace rattan::testing
