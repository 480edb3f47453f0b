// SPDX-License-Identifier: MIT
#include "io/remesh/remesh_writer.h"

#include <algorithm>
#include <limits>
#include <string_view>
#include <vector>

#include "engine/core/errors.h"
#include "io/file/atomic_file.h"
#include "io/remesh/draco_polygons.h"
#include "io/remesh/mesh_identity.h"
#include "io/remesh/polygon_files.h"
#include "io/remesh/remesh_format.h"

namespace rattan {
namespace {

void check(const PolygonMesh& mesh) {
  ensure(!mesh.face_begin.empty() && mesh.face_begin.back() == mesh.corners.size(),
         "a remesh's face offsets end at its corners");
  ensure(mesh.face_count() > 0, "a remesh has faces");
  std::vector<std::uint32_t> last_face(mesh.vertex_count(),
                                       std::numeric_limits<std::uint32_t>::max());
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    ensure(mesh.face_begin[f + 1] >= mesh.face_begin[f] + 3,
           "every face of a remesh has three corners or more");
    for (const std::uint32_t v : mesh.face(f)) {
      ensure(v < mesh.vertex_count(), "every corner of a remesh names a vertex");
      ensure(last_face[v] != static_cast<std::uint32_t>(f), "no face of a remesh repeats a vertex");
      last_face[v] = static_cast<std::uint32_t>(f);
    }
  }
  ensure(mesh.colours.empty() || mesh.colours.size() == mesh.vertex_count(),
         "every vertex of a remesh has a colour or none has");
  for (const Vec3d& p : mesh.positions) {
    ensure(p.allFinite(), "every position of a remesh is finite");
  }
}

/// The mesh without vertices that no face uses.
PolygonMesh compact(const PolygonMesh& mesh) {
  std::vector<std::uint32_t> number(mesh.vertex_count(), 0);
  for (const std::uint32_t v : mesh.corners) {
    number[v] = 1;
  }
  PolygonMesh out;
  out.face_begin = mesh.face_begin;
  out.positions.reserve(mesh.vertex_count());
  for (std::size_t v = 0; v < number.size(); ++v) {
    if (number[v] != 0) {
      number[v] = static_cast<std::uint32_t>(out.positions.size());
      out.positions.push_back(mesh.positions[v]);
      if (!mesh.colours.empty()) {
        out.colours.push_back(mesh.colours[v]);
      }
    }
  }
  out.corners.reserve(mesh.corners.size());
  for (const std::uint32_t v : mesh.corners) {
    out.corners.push_back(number[v]);
  }
  return out;
}

void refuse_difference(const std::string& path, const std::string& difference) {
  if (!difference.empty()) {
    throw InternalError(path + ": read back to check, the file differs from the remesh: " +
                        difference + ". Nothing was kept.");
  }
}

/// Every position of the decoded mesh lies within the bound of the one meant.
void check_bound(const PolygonMesh& mesh, const Vec3d& origin, const DracoEncoding& encoding) {
  const Vec3d shift = encoding.origin - origin;
  // The subtraction of origins rounds; allow for it.
  const double slack =
      encoding.bound + 4.0 * std::numeric_limits<double>::epsilon() * origin.cwiseAbs().maxCoeff();
  for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
    const Vec3d off = encoding.expected.positions[v] + shift - mesh.positions[v];
    ensure(off.cwiseAbs().maxCoeff() <= slack,
           "Draco keeps positions within the quantisation bound");
  }
}

}  // namespace

WriteResult write_remesh(const PolygonMesh& input, const RemeshMetadata& metadata,
                         const std::string& path, const WriteOptions& options) {
  const RemeshFormat format = remesh_format(path);
  check(input);
  const PolygonMesh mesh = compact(input);
  WriteResult result;
  result.vertices = mesh.vertex_count();
  result.faces = mesh.face_count();

  AtomicFile file(path);
  DracoEncoding encoding;
  switch (format) {
    case RemeshFormat::kDraco: {
      DracoOptions draco;
      draco.position_bits = options.position_bits;
      draco.accuracy = options.position_accuracy;
      draco.speed = options.draco_speed;
      encoding = encode_draco(mesh, metadata, draco);
      check_bound(mesh, metadata.origin, encoding);
      result.origin = encoding.origin;
      result.position_bits = encoding.position_bits;
      result.position_bound = encoding.bound;
      file.write(encoding.bytes);
      break;
    }
    case RemeshFormat::kObj:
      write_obj(mesh, metadata, file);
      break;
    case RemeshFormat::kPly:
      write_ply(mesh, metadata, file);
      break;
    case RemeshFormat::kOff:
      write_off(mesh, metadata, file);
      break;
  }
  file.sync();
  if (options.before_verify) {
    options.before_verify(file.temporary_path());
  }
  const std::string bytes = read_file(file.temporary_path());
  if (format == RemeshFormat::kDraco) {
    RemeshMetadata read;
    const PolygonMesh decoded = decode_draco(bytes, path, &read);
    refuse_difference(path, difference_as_meshes(encoding.expected, decoded));
    if (read.origin != encoding.origin || read.options != metadata.options ||
        read.input_hash != metadata.input_hash) {
      refuse_difference(path, "its metadata is not what was meant");
    }
  } else {
    PolygonMesh meant = mesh;
    if (format == RemeshFormat::kObj) {  // which has no alpha
      for (Rgba& c : meant.colours) {
        c[3] = 255;
      }
    }
    for (Vec3d& p : meant.positions) {
      p += metadata.origin;
    }
    const PolygonMesh read = format == RemeshFormat::kObj   ? parse_obj(bytes, path)
                             : format == RemeshFormat::kPly ? parse_ply(bytes, path)
                                                            : parse_off(bytes, path);
    refuse_difference(path, difference_in_order(meant, read));
  }
  result.bytes = file.size();
  file.commit();
  return result;
}

}  // namespace rattan
