// SPDX-License-Identifier: MIT
#pragma once

// Small meshes built in code, of every topology that extraction must keep, and fields on them.

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "engine/core/memory_store.h"
#include "engine/layout/arrangement.h"
#include "engine/mesh/tile_mesh.h"
#include "engine/param/phase_fields.h"

namespace rattan::testing {

struct IndexedMesh {
  std::string name;
  std::vector<Vec3d> positions;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// Right triangles over nx times ny squares of the given side.
IndexedMesh grid(std::uint32_t nx, std::uint32_t ny, double side = 1.0);
/// nu times nv quads, split; radii 3 and 1 times nv / 6.
IndexedMesh torus(std::uint32_t nu, std::uint32_t nv);
/// Subdivided octahedron.
IndexedMesh sphere(int levels, double radius = 1.0);
/// Surface of unit cubes where the mask has '#': as many handles as the mask has holes. Rows of
/// equal length; cubes must not touch along single edges.
IndexedMesh plate(const std::vector<std::string>& mask, int per_cube = 2);
IndexedMesh tetrahedron();
/// Two triangles back to back.
IndexedMesh pillow();

IndexedMesh without(const IndexedMesh& m, const std::function<bool(std::uint32_t)>& dropped);
IndexedMesh join(const std::vector<IndexedMesh>& parts);
/// Renumbers vertices at random: the worst order for tiles.
IndexedMesh shuffled(const IndexedMesh& m, std::uint64_t seed);
/// OBJ or OFF, triangles only; empty if it cannot be read or is not manifold.
IndexedMesh read_sample(const std::string& path);

/// One of each kind: holes, handles, several components, odd small ones.
std::vector<IndexedMesh> all_meshes();

/// A reproducible uniform number in [0, 1).
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed * 2 + 1) {}
  double next();

 private:
  std::uint64_t state_;
};

struct Fields {
  std::vector<VertexFrame> frames;
  std::vector<PairValue> phases;
};

/// Area-weighted normals; tangents and phases at random.
Fields random_fields(const IndexedMesh& m, std::uint64_t seed);
/// Tangents nearest to `direction`; phases 2 pi / omega times the coordinates along it and across.
Fields linear_fields(const IndexedMesh& m, const Vec3d& direction, double omega);

/// The mesh in tiles, with the fields where extraction looks for them.
ScanMesh store_fields(Store& store, const IndexedMesh& m, const Fields& fields,
                      std::uint32_t tile_size);

struct Extracted {
  CellComplex cells;
  ArrangementReport report;
};

Extracted extract(const IndexedMesh& m, const Fields& fields, double omega, int density,
                  std::uint32_t tile_size, int threads = 1,
                  std::uint64_t most_crossings = std::numeric_limits<std::uint64_t>::max());

/// Euler characteristic and boundary loops of each component, in the order of its lowest triangle.
struct ComponentTopology {
  std::int64_t euler = 0;
  std::uint64_t loops = 0;
  friend bool operator==(const ComponentTopology&, const ComponentTopology&) = default;
};
std::vector<ComponentTopology> topology(const IndexedMesh& m,
                                        std::vector<std::uint32_t>& component);

/// Adds test failures unless `cells` is a decomposition of `m` into disks.
void expect_decomposition(const IndexedMesh& m, const CellComplex& cells);
void expect_same(const CellComplex& a, const CellComplex& b);

}  // namespace rattan::testing
