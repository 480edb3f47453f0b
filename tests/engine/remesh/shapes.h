// SPDX-License-Identifier: MIT
#pragma once

// Meshes of known topology and random cell complexes over them.

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <random>
#include <vector>

#include "engine/layout/cell_complex.h"
#include "engine/remesh/cell_map.h"
#include "engine/remesh/polygon_mesh.h"

namespace rattan::test {

using Rng = std::mt19937_64;

inline std::uint32_t pick(Rng& rng, std::uint32_t n) {
  return static_cast<std::uint32_t>(rng() % n);
}

/// nx x ny unit quads in the plane; nx = 1 or more.
inline PolygonMesh grid(std::uint32_t nx, std::uint32_t ny) {
  PolygonMesh mesh;
  for (std::uint32_t y = 0; y <= ny; ++y) {
    for (std::uint32_t x = 0; x <= nx; ++x) {
      mesh.positions.emplace_back(x, y, 0.0);
    }
  }
  for (std::uint32_t y = 0; y < ny; ++y) {
    for (std::uint32_t x = 0; x < nx; ++x) {
      const std::uint32_t a = y * (nx + 1) + x;
      const std::array<std::uint32_t, 4> quad{a, a + 1, a + nx + 2, a + nx + 1};
      mesh.add_face(quad);
    }
  }
  return mesh;
}

/// Surface of the unit cubes at which `solid` holds; the caller sees to it that it's a manifold.
inline PolygonMesh voxels(int nx, int ny, int nz, const std::function<bool(int, int, int)>& solid) {
  PolygonMesh mesh;
  std::map<std::array<int, 3>, std::uint32_t> ids;
  const auto vertex = [&](std::array<int, 3> p) {
    const auto [it, fresh] = ids.emplace(p, static_cast<std::uint32_t>(ids.size()));
    if (fresh) {
      mesh.positions.emplace_back(p[0], p[1], p[2]);
    }
    return it->second;
  };
  const auto filled = [&](int x, int y, int z) {
    return x >= 0 && y >= 0 && z >= 0 && x < nx && y < ny && z < nz && solid(x, y, z);
  };
  for (int z = 0; z < nz; ++z) {
    for (int y = 0; y < ny; ++y) {
      for (int x = 0; x < nx; ++x) {
        if (!filled(x, y, z)) {
          continue;
        }
        for (int axis = 0; axis < 3; ++axis) {
          for (int side = 0; side < 2; ++side) {
            std::array<int, 3> to{x, y, z};
            to[axis] += side == 0 ? -1 : 1;
            if (filled(to[0], to[1], to[2])) {
              continue;
            }
            std::array<int, 3> p{x, y, z};
            p[axis] += side;
            const int u = (axis + 1) % 3, v = (axis + 2) % 3;
            std::array<std::uint32_t, 4> quad;
            for (int k = 0; k < 4; ++k) {
              std::array<int, 3> q = p;
              q[u] += k == 1 || k == 2;
              q[v] += k >= 2;
              quad[static_cast<std::size_t>(k)] = vertex(q);
            }
            if (side == 0) {
              std::swap(quad[1], quad[3]);
            }
            mesh.add_face(quad);
          }
        }
      }
    }
  }
  return mesh;
}

/// Closed, of the given genus.
inline PolygonMesh slab(int genus) {
  return voxels(2 * genus + 1, 3, 1, [](int x, int y, int) { return x % 2 == 0 || y != 1; });
}

/// `b` beside `a`.
inline PolygonMesh join(PolygonMesh a, const PolygonMesh& b) {
  const auto base = static_cast<std::uint32_t>(a.positions.size());
  for (const Vec3d& p : b.positions) {
    a.positions.push_back(p + Vec3d(100, 0, 0));
  }
  for (std::size_t f = 0; f < b.face_count(); ++f) {
    std::vector<std::uint32_t> face(b.face(f).begin(), b.face(f).end());
    for (std::uint32_t& v : face) {
      v += base;
    }
    a.add_face(face);
  }
  return a;
}

/// Removes up to `holes` faces that touch neither each other nor the boundary.
inline PolygonMesh punch(const PolygonMesh& mesh, int holes, Rng& rng, int& made) {
  std::vector<std::uint8_t> used(mesh.vertex_count(), 0), gone(mesh.face_count(), 0);
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    const auto v = mesh.face(f);
    for (std::size_t k = 0; k < v.size(); ++k) {
      ++sides[std::minmax(v[k], v[(k + 1) % v.size()])];
    }
  }
  for (const auto& [edge, count] : sides) {
    if (count == 1) {
      used[edge.first] = used[edge.second] = 1;
    }
  }
  made = 0;
  for (int attempt = 0; attempt < 20 * holes && made < holes; ++attempt) {
    const std::uint32_t f = pick(rng, static_cast<std::uint32_t>(mesh.face_count()));
    const auto v = mesh.face(f);
    if (!gone[f] && std::none_of(v.begin(), v.end(), [&](std::uint32_t x) { return used[x]; })) {
      gone[f] = 1;
      ++made;
      for (const std::uint32_t x : v) {
        used[x] = 1;
      }
    }
  }
  PolygonMesh result;
  result.positions = mesh.positions;
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    if (!gone[f]) {
      result.add_face(mesh.face(f));
    }
  }
  return result;
}

/// The map's cells, each starting at a random corner.
inline CellComplex to_complex(const CellMap& map, Rng& rng) {
  CellComplex cells;
  std::vector<std::uint32_t> vertex(map.vertex_count(), CellMap::kNone);
  std::vector<std::uint32_t> edge(map.half_count(), CellMap::kNone);
  std::vector<std::uint32_t> halves;
  for (std::uint32_t f = 0; f < map.face_count(); ++f) {
    if (!map.is_cell(f)) {
      continue;
    }
    map.face_halves(f, halves);
    std::rotate(halves.begin(),
                halves.begin() + pick(rng, static_cast<std::uint32_t>(halves.size())),
                halves.end());
    std::vector<std::uint32_t> face;
    for (const std::uint32_t h : halves) {
      const std::uint32_t v = map.origin(h);
      if (vertex[v] == CellMap::kNone) {
        vertex[v] = static_cast<std::uint32_t>(cells.mesh.positions.size());
        cells.mesh.positions.push_back(map.position(v));
      }
      if (edge[h] == CellMap::kNone) {
        edge[h] = edge[CellMap::twin(h)] = cells.edge_count++;
      }
      face.push_back(vertex[v]);
      cells.corner_edge.push_back(edge[h]);
    }
    cells.mesh.add_face(face);
  }
  return cells;
}

inline CellComplex to_complex(PolygonMesh mesh) {
  Rng rng(1);
  return to_complex(CellMap(std::move(mesh)), rng);
}

/// How often each operation is tried, relative to the others.
struct FuzzMix {
  std::uint32_t erase = 4, contract = 4, split_edge = 1, split_face = 1, dangle = 0;
};

/// Random operations that keep every cell a disk and every boundary loop a circle.
inline void shake(CellMap& map, int operations, const FuzzMix& mix, Rng& rng) {
  const std::uint32_t total =
      mix.erase + mix.contract + mix.split_edge + mix.split_face + mix.dangle;
  std::vector<std::uint32_t> halves;
  for (int i = 0; i < operations; ++i) {
    const std::uint32_t h = pick(rng, map.half_count());
    std::uint32_t what = pick(rng, total);
    if (!map.half_alive(h)) {
      continue;
    }
    const std::uint32_t t = CellMap::twin(h);
    const std::uint32_t f = map.face(h), g = map.face(t), u = map.origin(h), v = map.target(h);
    const bool border = map.is_hole(f) || map.is_hole(g);
    if (what < mix.erase) {
      if (f != g && !border && map.degree(f) + map.degree(g) > 2) {
        map.erase_edge(h);
      }
      continue;
    }
    what -= mix.erase;
    if (what < mix.contract) {
      if (u != v && map.valence(u) + map.valence(v) > 2 &&
          (border || !map.on_boundary(u) || !map.on_boundary(v))) {
        map.contract_edge(h, Vec3d(0.5 * (map.position(u) + map.position(v))));
      }
      continue;
    }
    what -= mix.contract;
    if (what < mix.split_edge) {
      map.split_edge(h, Vec3d(0.5 * (map.position(u) + map.position(v))));
      continue;
    }
    what -= mix.split_edge;
    if (map.is_hole(f)) {
      continue;
    }
    map.face_halves(f, halves);
    if (what < mix.split_face) {
      const std::uint32_t other = halves[pick(rng, static_cast<std::uint32_t>(halves.size()))];
      if (other != h) {
        map.split_face(h, other);
      }
    } else {
      map.star_face(f, {&h, 1}, map.face_centre(f));
    }
  }
}

}  // namespace rattan::test
