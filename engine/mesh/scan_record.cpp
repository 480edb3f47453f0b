// SPDX-License-Identifier: MIT
#include "engine/mesh/scan_record.h"

#include <bit>
#include <cstring>
#include <vector>

namespace rattan {

namespace {

constexpr std::uint64_t kVersion = 2;
constexpr TileId kOnly{0};

/// Hands every number of the record to `f`, in the order of the chunk.
template <class Mesh, class F>
void for_each_number(Mesh& m, const F& f) {
  f(m.layout.node_count);
  f(m.layout.border_count);
  for (auto* v : {&m.origin, &m.box_min, &m.box_max}) {
    for (int axis = 0; axis < 3; ++axis) {
      f((*v)[axis]);
    }
  }
  f(m.topology.vertices);
  f(m.topology.edges);
  f(m.topology.triangles);
  f(m.topology.components);
  f(m.topology.boundary_loops);
  for_each_count(m.repaired, [&](const char*, auto& count) { f(count); });
  f(m.unit);
  f(m.area);
  f(m.mean_edge_length);
}

/// Zero the padding, so that equal scans give equal bytes.
std::vector<std::byte> bytes_of(const std::vector<TileExtent>& tiles) {
  std::vector<std::byte> bytes(tiles.size() * sizeof(TileExtent));
  for (std::size_t t = 0; t < tiles.size(); ++t) {
    std::byte* at = bytes.data() + t * sizeof(TileExtent);
    std::memcpy(at + offsetof(TileExtent, first), &tiles[t].first, sizeof(tiles[t].first));
    std::memcpy(at + offsetof(TileExtent, owned), &tiles[t].owned, sizeof(tiles[t].owned));
    std::memcpy(at + offsetof(TileExtent, halo), &tiles[t].halo, sizeof(tiles[t].halo));
    std::memcpy(at + offsetof(TileExtent, border_first), &tiles[t].border_first,
                sizeof(tiles[t].border_first));
    std::memcpy(at + offsetof(TileExtent, border), &tiles[t].border, sizeof(tiles[t].border));
  }
  return bytes;
}

}  // namespace

void save_scan_mesh(Store& store, const ScanMesh& mesh) {
  std::vector<std::uint64_t> numbers = {kVersion};
  for_each_number(
      mesh, [&](const auto& value) { numbers.push_back(std::bit_cast<std::uint64_t>(value)); });
  numbers.push_back(mesh.has_colours ? 1 : 0);
  write(store, fields::kScanRecord, kOnly, numbers);
  store.write_chunk(fields::kScanTiles.name, kOnly,
                    std::make_shared<std::vector<std::byte>>(bytes_of(mesh.layout.tiles)));
  static_assert(std::has_unique_object_representations_v<TileTriangles>);
  write(store, fields::kScanTileTriangles, kOnly, mesh.triangles);
}

ScanMesh load_scan_mesh(Store& store) {
  ScanMesh mesh;
  const ChunkView<std::uint64_t> numbers = read(store, fields::kScanRecord, kOnly);
  std::size_t at = 0;
  const auto next = [&] {
    ensure(at < numbers.size(), "a scan's record is complete");
    return numbers[at++];
  };
  ensure(next() == kVersion, "a scan's record is of this version of Rattan");
  for_each_number(mesh, [&](auto& value) {
    value = std::bit_cast<std::remove_reference_t<decltype(value)>>(next());
  });
  mesh.has_colours = next() != 0;
  ensure(at == numbers.size(), "a scan's record holds no more than it should");
  const auto tiles = read(store, fields::kScanTiles, kOnly);
  mesh.layout.tiles.assign(tiles.begin(), tiles.end());
  const auto triangles = read(store, fields::kScanTileTriangles, kOnly);
  mesh.triangles.assign(triangles.begin(), triangles.end());
  return mesh;
}

}  // namespace rattan
