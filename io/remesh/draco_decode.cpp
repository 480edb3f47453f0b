// SPDX-License-Identifier: MIT
// Decoding a Draco file and finding its polygons again.

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include <draco/mesh/mesh.h>

#include "engine/core/errors.h"
#include "io/file/guarded_draco.h"
#include "io/remesh/draco_grid.h"
#include "io/remesh/draco_polygons.h"

namespace rattan {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

/// Half-edge h is corner h % 3 of triangle h / 3 and the edge that leaves it. It splits a polygon
/// if the corner opposite is flagged on either side.
struct TriangleSoup {
  std::vector<std::uint32_t> vertex;  // of each corner
  std::vector<std::uint8_t> splits;   // of each half-edge, as flagged on its own side
};

std::uint32_t next(std::uint32_t h) {
  return h % 3 == 2 ? h - 2 : h + 1;
}

/// kNone at boundaries and where more than two triangles meet.
std::vector<std::uint32_t> find_twins(const std::vector<std::uint32_t>& vertex) {
  struct Edge {
    std::uint64_t key;
    std::uint32_t half_edge;
  };
  std::vector<Edge> edges(vertex.size());
  for (std::uint32_t h = 0; h < vertex.size(); ++h) {
    const std::uint64_t a = vertex[h];
    const std::uint64_t b = vertex[next(h)];
    edges[h] = {a < b ? (a << 32 | b) : (b << 32 | a), h};
  }
  std::sort(edges.begin(), edges.end(), [](const Edge& x, const Edge& y) {
    return x.key != y.key ? x.key < y.key : x.half_edge < y.half_edge;
  });
  std::vector<std::uint32_t> twin(vertex.size(), kNone);
  for (std::size_t i = 0, j = 0; i < edges.size(); i = j) {
    while (j < edges.size() && edges[j].key == edges[i].key) {
      ++j;
    }
    if (j - i == 2 && vertex[edges[i].half_edge] != vertex[edges[i + 1].half_edge]) {
      twin[edges[i].half_edge] = edges[i + 1].half_edge;
      twin[edges[i + 1].half_edge] = edges[i].half_edge;
    }
  }
  return twin;
}

void join_polygons(const TriangleSoup& soup, const std::string& path, PolygonMesh& out) {
  const std::vector<std::uint32_t> twin = find_twins(soup.vertex);
  const auto inner = [&](std::uint32_t h) {
    return twin[h] != kNone && (soup.splits[h] != 0 || soup.splits[twin[h]] != 0);
  };
  const auto triangles = static_cast<std::uint32_t>(soup.vertex.size() / 3);
  std::vector<std::uint8_t> visited(triangles, 0);
  std::vector<std::uint32_t> stack;
  std::vector<std::uint32_t> loop;
  for (std::uint32_t seed = 0; seed < triangles; ++seed) {
    if (visited[seed] != 0) {
      continue;
    }
    visited[seed] = 1;
    stack.assign(1, seed);
    std::size_t members = 0;
    std::size_t sides = 0;
    std::uint32_t start = kNone;
    while (!stack.empty()) {
      const std::uint32_t t = stack.back();
      stack.pop_back();
      ++members;
      for (std::uint32_t h = 3 * t; h < 3 * t + 3; ++h) {
        if (!inner(h)) {
          ++sides;
          start = std::min(start, h);
        } else if (visited[twin[h] / 3] == 0) {
          visited[twin[h] / 3] = 1;
          stack.push_back(twin[h] / 3);
        }
      }
    }
    // A disk without inner vertices has as many sides as triangles and two more, on one loop.
    loop.clear();
    if (sides == members + 2) {
      std::uint32_t h = start;
      do {
        loop.push_back(soup.vertex[h]);
        for (h = next(h); inner(h); h = next(twin[h])) {
        }
      } while (h != start && loop.size() <= sides);
    }
    if (loop.size() != sides) {
      throw InputError(path, "triangle " + std::to_string(seed),
                       "the added edges around it do not bound a polygon",
                       "Encode the mesh again with polygons preserved");
    }
    out.add_face(loop);
  }
}

const draco::PointAttribute* added_edges_of(const draco::Mesh& mesh) {
  const draco::GeometryMetadata* about = mesh.GetMetadata();
  if (about == nullptr) {
    return nullptr;
  }
  const auto* name = about->GetAttributeMetadataByStringEntry("name", "added_edges");
  if (name == nullptr) {
    return nullptr;
  }
  const auto* attribute = mesh.GetAttributeByUniqueId(name->att_unique_id());
  const bool usable = attribute != nullptr && attribute->size() > 0 &&
                      attribute->num_components() == 1 && attribute->data_type() == draco::DT_UINT8;
  return usable ? attribute : nullptr;
}

/// Colours of the vertices, by the points at them.
void read_colours(const draco::Mesh& mesh, const draco::PointAttribute& position,
                  PolygonMesh& out) {
  const auto* colour = mesh.GetNamedAttribute(draco::GeometryAttribute::COLOR);
  if (colour == nullptr || colour->size() == 0 || colour->data_type() != draco::DT_UINT8 ||
      colour->num_components() < 3 || colour->num_components() > 4) {
    return;
  }
  out.colours.assign(out.vertex_count(), Rgba{255, 255, 255, 255});
  for (draco::PointIndex point(0); point < mesh.num_points(); ++point) {
    const std::uint32_t v = position.mapped_index(point).value();
    if (v < out.vertex_count() && colour->mapped_index(point).value() < colour->size()) {
      colour->GetMappedValue(point, out.colours[v].data());
    }
  }
}

}  // namespace

PolygonMesh decode_draco(std::string_view bytes, const std::string& path,
                         RemeshMetadata* metadata) {
  const auto refuse = [&](const std::string& problem) {
    return InputError(path, "", problem, "Give a whole Draco mesh file");
  };
  // A remesh is of output size, which is in memory anyway.
  constexpr std::uint64_t kMostMemory = std::uint64_t{16} << 30;
  const std::unique_ptr<draco::Mesh> mesh = decode_draco_mesh(bytes, path, kMostMemory);
  const auto* position = mesh->GetNamedAttribute(draco::GeometryAttribute::POSITION);
  if (position == nullptr || position->num_components() != 3) {
    throw refuse("it holds no positions");
  }
  if (metadata != nullptr) {
    *metadata = metadata_of(*mesh);
  }

  PolygonMesh out;
  out.positions.resize(position->size());
  const bool numbers = holds_numbers(*position);
  for (std::uint32_t v = 0; v < position->size(); ++v) {
    std::array<double, 3> p{};
    if (!numbers || !position->ConvertValue<double, 3>(draco::AttributeValueIndex(v), p.data())) {
      throw refuse("its positions are of a kind that cannot be read");
    }
    out.positions[v] = Vec3d(p[0], p[1], p[2]);
  }
  read_colours(*mesh, *position, out);
  const auto* added = added_edges_of(*mesh);
  TriangleSoup soup;
  soup.vertex.reserve(3 * std::size_t{mesh->num_faces()});
  for (draco::FaceIndex f(0); f < mesh->num_faces(); ++f) {
    const draco::Mesh::Face& face = mesh->face(f);
    std::array<std::uint32_t, 3> v{};
    std::array<std::uint8_t, 3> flag{};
    for (std::size_t c = 0; c < 3; ++c) {
      if (face[c].value() >= mesh->num_points()) {
        throw refuse("a triangle names a point that is not there");
      }
      v[c] = position->mapped_index(face[c]).value();
      if (v[c] >= position->size()) {
        throw refuse("a point has no position");
      }
      if (added != nullptr) {
        added->GetMappedValue(face[c], &flag[c]);
      }
    }
    if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) {
      continue;
    }
    for (std::size_t c = 0; c < 3; ++c) {
      soup.vertex.push_back(v[c]);
      // The half-edge that leaves corner c lies opposite corner c + 2.
      soup.splits.push_back(flag[(c + 2) % 3]);
    }
  }
  if (added == nullptr) {
    out.corners = std::move(soup.vertex);
    for (std::size_t c = 3; c <= out.corners.size(); c += 3) {
      out.face_begin.push_back(c);
    }
  } else {
    join_polygons(soup, path, out);
  }
  return out;
}

}  // namespace rattan
