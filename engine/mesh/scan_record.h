// SPDX-License-Identifier: MIT
#pragma once

// The part of a scan that lives in memory, as chunks of the store, so that a later run finds it.

#include "engine/core/store.h"
#include "engine/mesh/tile_mesh.h"

namespace rattan {

namespace fields {
/// One chunk (tile 0) each.
inline constexpr Field<std::uint64_t> kScanRecord{
    "mesh/record"};  ///< fixed numbers, see the source
inline constexpr Field<TileExtent> kScanTiles{"mesh/tiles"};
inline constexpr Field<TileTriangles> kScanTileTriangles{"mesh/tile_triangles"};
}  // namespace fields

void save_scan_mesh(Store& store, const ScanMesh& mesh);
/// Pre: saved before. Throws InternalError if the record is of another version.
ScanMesh load_scan_mesh(Store& store);

}  // namespace rattan
