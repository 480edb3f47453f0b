// SPDX-License-Identifier: MIT
#include "jobs/working_mesh.h"

#include "engine/core/packed_chunk.h"

namespace rattan {

template <class A>
void members_of(A& a, PolygonMesh& m) {
  a(m.positions);
  a(m.face_begin);
  a(m.corners);
  a(m.scan_triangle);
  a(m.vertex_flags);
  a(m.colours);
  a(m.feature_edges);
}

template <class A>
void members_of(A& a, CellComplex& c) {
  a(c.mesh);
  a(c.corner_edge);
  a(c.edge_count);
  a(c.edge_feature);
  a(c.face_singular);
}

namespace {

constexpr std::string_view kMesh = "remesh/mesh";
constexpr std::string_view kCells = "cells/complex";

}  // namespace

PolygonMesh& WorkingMesh::get() {
  if (!mesh_) {
    read_packed(store_, kMesh, mesh_.emplace());
  }
  return *mesh_;
}

void WorkingMesh::save() {
  write_packed(store_, kMesh, get());
}

bool WorkingMesh::saved() const {
  return store_.has_chunk(kMesh, TileId(0));
}

void save_cells(Store& store, const CellComplex& cells) {
  write_packed(store, kCells, cells);
}

CellComplex load_cells(Store& store) {
  CellComplex cells;
  read_packed(store, kCells, cells);
  return cells;
}

void erase_cells(Store& store) {
  store.erase(kCells);
}

}  // namespace rattan
