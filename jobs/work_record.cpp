// SPDX-License-Identifier: MIT
#include "jobs/work_record.h"

#include <string>

#include <fmt/format.h>

namespace rattan {

namespace {

constexpr Field<Vec3d> kPositions{"remesh/position"};
constexpr Field<std::uint64_t> kFaceBegin{"remesh/face_begin"};
constexpr Field<std::uint32_t> kCorners{"remesh/corner"};
constexpr TileId kWhole{0};

template <class T>
std::vector<T> read_all(Store& store, Field<T> field) {
  const ChunkView<T> chunk = read(store, field, kWhole);
  return {chunk.begin(), chunk.end()};
}

}  // namespace

void save_work(Hdf5Store& store, const PolygonMesh& remesh, double omega, int density) {
  store.set_attribute("param", "omega", fmt::format("{}", omega));
  store.set_attribute("param", "density", fmt::format("{}", density));
  store.complete_stage("param");
  write(store, kPositions, kWhole, remesh.positions);
  write(store, kFaceBegin, kWhole, remesh.face_begin);
  write(store, kCorners, kWhole, remesh.corners);
  store.complete_stage("remesh");
}

WorkRecord load_work(Hdf5Store& store) {
  WorkRecord record;
  const auto omega = store.attribute("param", "omega");
  const auto density = store.attribute("param", "density");
  if (omega && density) {
    record.omega = std::stod(*omega);
    record.density = std::stoi(*density);
  }
  if (store.is_complete("remesh")) {
    PolygonMesh& mesh = record.remesh.emplace();
    mesh.positions = read_all(store, kPositions);
    mesh.face_begin = read_all(store, kFaceBegin);
    mesh.corners = read_all(store, kCorners);
  }
  return record;
}

}  // namespace rattan
