// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <utility>

#include "engine/core/store.h"
#include "engine/layout/cell_complex.h"
#include "engine/remesh/polygon_mesh.h"

namespace rattan {

/// The remesh while it is made: in memory, and in the store for a run that resumes. Inside steps
/// only.
class WorkingMesh {
 public:
  explicit WorkingMesh(Store& store) : store_(store) {}

  /// What the last step left, of this run or an earlier one.
  PolygonMesh& get();
  void set(PolygonMesh mesh) { mesh_ = std::move(mesh); }
  /// At the end of each step that changed it.
  void save();
  bool saved() const;

 private:
  Store& store_;
  std::optional<PolygonMesh> mesh_;
};

/// The same for the cells, from one step to the next.
void save_cells(Store& store, const CellComplex& cells);
CellComplex load_cells(Store& store);
void erase_cells(Store& store);

}  // namespace rattan
