// SPDX-License-Identifier: MIT
#include "engine/remesh/cell_map.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include <Eigen/Geometry>

#include "engine/core/errors.h"
#include "engine/remesh/edge_sort.h"

namespace rattan {

CellMap::CellMap(CellComplex&& cells) {
  connect(std::move(cells.mesh), cells.corner_edge, cells.edge_count);
  for (std::uint32_t e = 0; e < cells.edge_feature.size(); ++e) {
    if (cells.edge_feature[e] != 0) {
      set_feature(2 * e, true);
    }
  }
}

CellMap::CellMap(PolygonMesh&& mesh) {
  const std::vector<FaceSide> sides = sorted_sides(mesh);
  std::vector<std::uint32_t> corner_edge(sides.size());
  std::uint32_t edges = 0;
  for (std::size_t i = 0; i < sides.size(); ++i) {
    edges += i == 0 || sides[i].low != sides[i - 1].low || sides[i].high != sides[i - 1].high;
    corner_edge[sides[i].corner] = edges - 1;
  }
  const std::vector<std::array<std::uint32_t, 2>> features = std::move(mesh.feature_edges);
  connect(std::move(mesh), corner_edge, edges);
  for (const auto& [u, v] : features) {
    const std::uint32_t h = find_half(u, v);
    if (h != kNone) {
      set_feature(h, true);
    }
  }
}

void CellMap::connect(PolygonMesh&& mesh, std::span<const std::uint32_t> corner_edge,
                      std::uint32_t edge_count) {
  ensure(corner_edge.size() == mesh.corners.size(), "each corner of a cell complex has an edge");
  positions_ = std::move(mesh.positions);
  flags_ = std::move(mesh.vertex_flags);
  flags_.resize(positions_.size(), 0);
  scan_triangle_ = std::move(mesh.scan_triangle);
  vertex_half_.assign(positions_.size(), kNone);
  valence_.assign(positions_.size(), 0);
  normals_.assign(positions_.size(), Vec3d::Zero());

  const std::size_t halves = 2 * std::size_t{edge_count};
  next_.assign(halves, kNone);
  prev_.assign(halves, kNone);
  origin_.assign(halves, kNone);
  face_.assign(halves, kNone);
  feature_.assign(edge_count, 0);

  std::vector<std::uint32_t> face_edges;
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    const std::uint64_t begin = mesh.face_begin[f];
    const std::uint64_t n = mesh.degree(f);
    ensure(n > 0, "a cell has a corner");
    const std::uint32_t id = add_face(false);
    face_edges.resize(n);
    for (std::uint64_t k = 0; k < n; ++k) {
      const std::uint32_t e = corner_edge[begin + k];
      ensure(e < edge_count, "edge ids of a cell complex are below its edge count");
      const std::uint32_t h = origin_[2 * e] == kNone ? 2 * e : 2 * e + 1;
      ensure(origin_[h] == kNone, "an edge of a cell complex has at most two sides");
      origin_[h] = mesh.corners[begin + k];
      face_[h] = id;
      face_edges[k] = h;
    }
    for (std::uint64_t k = 0; k < n; ++k) {
      link(face_edges[k], face_edges[k + 1 == n ? 0 : k + 1]);
    }
    face_half_[id] = face_edges[0];
    degree_[id] = static_cast<std::uint32_t>(n);
  }

  // The second sides of boundary edges bound the holes.
  std::vector<std::uint32_t> open;
  for (std::uint32_t h = 0; h < halves; h += 2) {
    ensure(origin_[h] != kNone, "each edge of a cell complex has a face");
    if (origin_[h + 1] == kNone) {
      open.push_back(h + 1);
    } else {
      ensure(origin_[next_[h]] == origin_[h + 1] && origin_[next_[h + 1]] == origin_[h],
             "the two sides of an edge run in opposite directions");
    }
  }
  for (const std::uint32_t b : open) {
    origin_[b] = origin_[next_[twin(b)]];
  }
  for (const std::uint32_t b : open) {
    std::uint32_t h = twin(b);
    do {
      h = twin(prev_[h]);
    } while (face_[h] != kNone);
    next_[b] = h;
  }
  for (const std::uint32_t b : open) {
    prev_[next_[b]] = b;
  }
  for (const std::uint32_t b : open) {
    if (face_[b] != kNone) {
      continue;
    }
    const std::uint32_t id = add_face(true);
    face_half_[id] = b;
    std::uint32_t h = b;
    do {
      face_[h] = id;
      ++degree_[id];
      h = next_[h];
    } while (h != b);
  }

  // One vertex a fan.
  for (std::uint8_t& flag : flags_) {
    flag &= static_cast<std::uint8_t>(~(kBoundaryVertex | kFeatureVertex));
  }
  std::vector<std::uint8_t> seen(halves, 0);
  for (std::uint32_t start = 0; start < halves; ++start) {
    if (seen[start]) {
      continue;
    }
    std::uint32_t v = origin_[start];
    if (vertex_half_[v] != kNone) {
      v = add_vertex(positions_[v], normals_[v], v, flags_[v] & kCornerVertex);
    }
    vertex_half_[v] = start;
    std::uint32_t h = start;
    do {
      seen[h] = 1;
      origin_[h] = v;
      ++valence_[v];
      if (hole_[face_[h]]) {
        flags_[v] |= kBoundaryVertex;
      }
      h = around(h);
    } while (h != start);
  }
}

void CellMap::set_feature(std::uint32_t h, bool feature) {
  feature_[h >> 1] = feature ? 1 : 0;
  if (feature) {
    flags_[origin_[h]] |= kFeatureVertex;
    flags_[origin_[twin(h)]] |= kFeatureVertex;
  }
}

std::uint32_t CellMap::add_edge() {
  const std::uint32_t h = half_count();
  next_.resize(h + 2, kNone);
  prev_.resize(h + 2, kNone);
  origin_.resize(h + 2, kNone);
  face_.resize(h + 2, kNone);
  feature_.push_back(0);
  return h;
}

std::uint32_t CellMap::add_face(bool hole) {
  face_half_.push_back(kNone);
  degree_.push_back(0);
  hole_.push_back(hole ? 1 : 0);
  return face_count() - 1;
}

std::uint32_t CellMap::add_vertex(const Vec3d& position, const Vec3d& normal, std::uint32_t source,
                                  std::uint8_t flags) {
  vertex_half_.push_back(kNone);
  valence_.push_back(0);
  positions_.push_back(position);
  normals_.push_back(normal);
  flags_.push_back(flags);
  if (!scan_triangle_.empty()) {
    scan_triangle_.push_back(std::uint64_t{scan_triangle_[source]});
  }
  return vertex_count() - 1;
}

std::uint32_t CellMap::find_half(std::uint32_t u, std::uint32_t v) const {
  const bool from_u = valence_[u] <= valence_[v];
  const std::uint32_t pivot = from_u ? u : v;
  const std::uint32_t other = from_u ? v : u;
  const std::uint32_t start = vertex_half_[pivot];
  std::uint32_t h = start;
  do {
    if (target(h) == other) {
      return from_u ? h : twin(h);
    }
    h = around(h);
  } while (h != start);
  return kNone;
}

void CellMap::face_halves(std::uint32_t f, std::vector<std::uint32_t>& out) const {
  out.clear();
  std::uint32_t h = face_half_[f];
  do {
    out.push_back(h);
    h = next_[h];
  } while (h != face_half_[f]);
}

Vec3d CellMap::face_centre(std::uint32_t f) const {
  Vec3d sum = Vec3d::Zero();
  std::uint32_t h = face_half_[f];
  do {
    sum += positions_[origin_[h]];
    h = next_[h];
  } while (h != face_half_[f]);
  return sum / degree_[f];
}

Vec3d CellMap::face_normal(std::uint32_t f) const {
  const Vec3d& base = positions_[origin_[face_half_[f]]];
  Vec3d sum = Vec3d::Zero();
  std::uint32_t h = face_half_[f];
  do {
    sum += (positions_[origin_[h]] - base).cross(positions_[target(h)] - base);
    h = next_[h];
  } while (h != face_half_[f]);
  return sum;
}

std::uint32_t CellMap::erase_edge(std::uint32_t h) {
  const std::uint32_t t = twin(h);
  std::uint32_t keep = face_[h];
  std::uint32_t gone = face_[t];
  ensure(keep != gone && !hole_[keep] && !hole_[gone] && degree_[keep] + degree_[gone] > 2,
         "only an edge between two cells can be erased");
  if (degree_[gone] > degree_[keep] || (degree_[gone] == degree_[keep] && gone < keep)) {
    std::swap(keep, gone);
  }
  std::uint32_t walk = face_half_[gone];
  do {
    face_[walk] = keep;
    walk = next_[walk];
  } while (walk != face_half_[gone]);
  const std::uint32_t a = prev_[h], b = next_[h], c = prev_[t], d = next_[t];
  const std::uint32_t u = origin_[h], v = origin_[t];
  if (a == h) {
    link(c, d);
  } else if (c == t) {
    link(a, b);
  } else {
    link(a, d);
    link(c, b);
  }
  vertex_half_[u] = d != t ? d : b;
  vertex_half_[v] = b != h ? b : d;
  face_half_[keep] = b != h ? b : d;
  --valence_[u];
  --valence_[v];
  degree_[keep] += degree_[gone] - 2;
  degree_[gone] = 0;
  face_half_[gone] = kNone;
  kill_edge(h);
  return keep;
}

void CellMap::contract_edge(std::uint32_t h, const Vec3d& position) {
  const std::uint32_t t = twin(h);
  const std::uint32_t u = origin_[h], v = origin_[t];
  ensure(u != v && valence_[u] + valence_[v] > 2, "a loop or a whole component isn't contracted");
  std::uint32_t walk = vertex_half_[v];
  do {
    origin_[walk] = u;
    walk = around(walk);
  } while (walk != vertex_half_[v]);
  const std::uint32_t a = prev_[h], b = next_[h], c = prev_[t], d = next_[t];
  const std::uint32_t f = face_[h], g = face_[t];
  if (b == t) {
    link(a, d);
    face_half_[f] = d;
  } else if (d == h) {
    link(c, b);
    face_half_[f] = b;
  } else {
    link(a, b);
    link(c, d);
    face_half_[f] = b;
    face_half_[g] = d;
  }
  --degree_[f];
  --degree_[g];
  vertex_half_[u] = b != t ? b : d;
  vertex_half_[v] = kNone;
  valence_[u] += valence_[v] - 2;
  valence_[v] = 0;
  flags_[u] |= flags_[v];
  positions_[u] = position;
  const Vec3d normal = normals_[u] + normals_[v];
  const double norm = normal.norm();
  normals_[u] = norm > 0 ? Vec3d(normal / norm) : normals_[u];
  kill_edge(h);
}

std::uint32_t CellMap::split_edge(std::uint32_t h, const Vec3d& position) {
  const std::uint32_t t = twin(h);
  const std::uint32_t u = origin_[h], v = origin_[t];
  const bool border = hole_[face_[h]] || hole_[face_[t]];
  const Vec3d sum = normals_[u] + normals_[v];
  const double norm = sum.norm();
  const std::uint32_t w =
      add_vertex(position, norm > 0 ? Vec3d(sum / norm) : sum, u, border ? kBoundaryVertex : 0);
  const std::uint32_t h2 = add_edge();
  const std::uint32_t t2 = twin(h2);
  const std::uint32_t after = next_[h], before = prev_[t];
  origin_[h2] = w;
  origin_[t2] = v;
  origin_[t] = w;
  face_[h2] = face_[h];
  face_[t2] = face_[t];
  ++degree_[face_[h]];
  ++degree_[face_[t]];
  if (after == t) {
    link(h2, t2);
  } else {
    link(h2, after);
    link(before, t2);
  }
  link(h, h2);
  link(t2, t);
  if (vertex_half_[v] == t) {
    vertex_half_[v] = t2;
  }
  vertex_half_[w] = h2;
  valence_[w] = 2;
  if (is_feature(h)) {
    set_feature(h2, true);
  }
  return h2;
}

std::uint32_t CellMap::split_face(std::uint32_t h1, std::uint32_t h2) {
  const std::uint32_t f = face_[h1];
  ensure(f == face_[h2] && h1 != h2, "a face is split between two of its corners");
  const std::uint32_t x = add_edge();
  const std::uint32_t y = twin(x);
  const std::uint32_t p1 = prev_[h1], p2 = prev_[h2];
  origin_[x] = origin_[h2];
  origin_[y] = origin_[h1];
  link(p2, x);
  link(x, h1);
  link(p1, y);
  link(y, h2);
  const std::uint32_t g = add_face(false);
  std::uint32_t count = 0;
  std::uint32_t h = x;
  do {
    face_[h] = g;
    ++count;
    h = next_[h];
  } while (h != x);
  face_half_[g] = x;
  degree_[g] = count;
  face_[y] = f;
  face_half_[f] = y;
  degree_[f] = degree_[f] + 2 - count;
  ++valence_[origin_[x]];
  ++valence_[origin_[y]];
  return x;
}

std::uint32_t CellMap::star_face(std::uint32_t f, std::span<const std::uint32_t> corners,
                                 const Vec3d& position) {
  // Starts as a dangling edge at the first corner; the rest are face splits.
  const std::uint32_t first = corners[0];
  const std::uint32_t u = origin_[first];
  Vec3d normal = Vec3d::Zero();
  for (const std::uint32_t c : corners) {
    normal += normals_[origin_[c]];
  }
  const double norm = normal.norm();
  const std::uint32_t w = add_vertex(position, norm > 0 ? Vec3d(normal / norm) : normals_[u], u, 0);
  const std::uint32_t s = add_edge();  // u -> w
  const std::uint32_t r = twin(s);
  link(prev_[first], s);
  link(s, r);
  link(r, first);
  origin_[s] = u;
  origin_[r] = w;
  face_[s] = face_[r] = f;
  degree_[f] += 2;
  ++valence_[u];
  vertex_half_[w] = r;
  valence_[w] = 1;
  std::uint32_t from = r;
  for (std::size_t k = 1; k < corners.size(); ++k) {
    // The side (w -> first ... corner k) is closed; the rest keeps the twin, which starts at w.
    from = twin(split_face(from, corners[k]));
  }
  return w;
}

void CellMap::inset_face(std::uint32_t f) {
  std::vector<std::uint32_t> ring;
  face_halves(f, ring);
  const std::size_t n = ring.size();
  ensure(n >= 3, "an inset needs three corners");
  const Vec3d centre = face_centre(f);
  std::vector<std::uint32_t> inner(n), spoke(n), rim(n);
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint32_t c = origin_[ring[i]];
    const Vec3d p = positions_[c] + 0.4 * (centre - positions_[c]);
    inner[i] = add_vertex(p, Vec3d(normals_[c]), c, 0);
    spoke[i] = add_edge();
    rim[i] = add_edge();
  }
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t j = i + 1 == n ? 0 : i + 1;
    const std::uint32_t c = origin_[ring[i]];
    origin_[spoke[i]] = c;
    origin_[twin(spoke[i])] = inner[i];
    origin_[rim[i]] = inner[i];
    origin_[twin(rim[i])] = inner[j];
    ++valence_[c];
    valence_[inner[i]] = 3;
    vertex_half_[inner[i]] = rim[i];
  }
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t j = i + 1 == n ? 0 : i + 1;
    const std::uint32_t g = add_face(false);
    const std::array<std::uint32_t, 4> quad{ring[i], spoke[j], twin(rim[i]), twin(spoke[i])};
    for (std::size_t k = 0; k < 4; ++k) {
      link(quad[k], quad[(k + 1) % 4]);
      face_[quad[k]] = g;
    }
    face_half_[g] = ring[i];
    degree_[g] = 4;
    link(rim[i], rim[j]);
    face_[rim[i]] = f;
  }
  face_half_[f] = rim[0];
}

void CellMap::set_normals(std::span<const Vec3d> given) {
  if (!given.empty()) {
    ensure(given.size() <= normals_.size(), "one normal a vertex");
    std::copy(given.begin(), given.end(), normals_.begin());
    return;
  }
  std::fill(normals_.begin(), normals_.end(), Vec3d::Zero());
  for (std::uint32_t f = 0; f < face_count(); ++f) {
    if (!is_cell(f)) {
      continue;
    }
    const Vec3d area = face_normal(f);
    std::uint32_t h = face_half_[f];
    do {
      normals_[origin_[h]] += area;
      h = next_[h];
    } while (h != face_half_[f]);
  }
  for (Vec3d& n : normals_) {
    const double norm = n.norm();
    if (norm > 0) {
      n /= norm;
    }
  }
}

PolygonMesh CellMap::to_mesh() const {
  PolygonMesh mesh;
  std::vector<std::uint32_t> number(vertex_count(), kNone);
  std::size_t count = 0;
  for (std::uint32_t v = 0; v < vertex_count(); ++v) {
    count += vertex_alive(v);
  }
  mesh.positions.reserve(count);
  mesh.vertex_flags.reserve(count);
  for (std::uint32_t v = 0; v < vertex_count(); ++v) {
    if (!vertex_alive(v)) {
      continue;
    }
    number[v] = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.push_back(positions_[v]);
    mesh.vertex_flags.push_back(flags_[v]);
    if (!scan_triangle_.empty()) {
      mesh.scan_triangle.push_back(scan_triangle_[v]);
    }
  }
  for (std::uint32_t f = 0; f < face_count(); ++f) {
    if (!is_cell(f)) {
      continue;
    }
    std::uint32_t h = face_half_[f];
    do {
      mesh.corners.push_back(number[origin_[h]]);
      h = next_[h];
    } while (h != face_half_[f]);
    mesh.face_begin.push_back(mesh.corners.size());
  }
  for (std::uint32_t h = 0; h < half_count(); h += 2) {
    if (half_alive(h) && is_feature(h) && !hole_[face_[h]] && !hole_[face_[twin(h)]]) {
      const auto ends = std::minmax(number[origin_[h]], number[target(h)]);
      mesh.feature_edges.push_back({ends.first, ends.second});
    }
  }
  return mesh;
}

CellMap::Counts CellMap::counts() const {
  Counts result;
  std::vector<std::uint32_t> parent(vertex_count());
  std::iota(parent.begin(), parent.end(), 0U);
  const auto root = [&](std::uint32_t v) {
    while (parent[v] != v) {
      v = parent[v] = parent[parent[v]];
    }
    return v;
  };
  for (std::uint32_t v = 0; v < vertex_count(); ++v) {
    result.vertices += vertex_alive(v);
  }
  result.components = result.vertices;
  for (std::uint32_t h = 0; h < half_count(); h += 2) {
    if (half_alive(h)) {
      ++result.edges;
      const std::uint32_t a = root(origin_[h]), b = root(target(h));
      if (a != b) {
        parent[std::max(a, b)] = std::min(a, b);
        --result.components;
      }
    }
  }
  for (std::uint32_t f = 0; f < face_count(); ++f) {
    if (face_alive(f)) {
      (hole_[f] ? result.boundary_loops : result.faces) += 1;
    }
  }
  return result;
}

void CellMap::validate() const {
  std::vector<std::uint32_t> degree(face_count(), 0), valence(vertex_count(), 0);
  for (std::uint32_t h = 0; h < half_count(); ++h) {
    if (!half_alive(h)) {
      continue;
    }
    ensure(half_alive(twin(h)), "both sides of an edge are alive");
    ensure(prev_[next_[h]] == h && next_[prev_[h]] == h, "next and prev are inverse");
    ensure(origin_[next_[h]] == target(h), "a face's half-edges meet at vertices");
    ensure(face_[next_[h]] == face_[h], "a face's half-edges agree on the face");
    ensure(face_alive(face_[h]) && vertex_alive(origin_[h]), "a half-edge's ends are alive");
    ++degree[face_[h]];
    ++valence[origin_[h]];
  }
  std::vector<std::uint32_t> ring;
  for (std::uint32_t f = 0; f < face_count(); ++f) {
    ensure(degree[f] == degree_[f], "a face knows its degree");
    if (face_alive(f)) {
      face_halves(f, ring);
      ensure(ring.size() == degree_[f] && face_[ring[0]] == f, "a face is one cycle");
    }
  }
  for (std::uint32_t v = 0; v < vertex_count(); ++v) {
    ensure(valence[v] == valence_[v], "a vertex knows its valence");
    if (vertex_alive(v)) {
      std::uint32_t count = 0;
      bool border = false;
      std::uint32_t h = vertex_half_[v];
      ensure(origin_[h] == v, "a vertex's half-edge starts there");
      do {
        ++count;
        border = border || hole_[face_[h]];
        h = around(h);
      } while (h != vertex_half_[v] && count <= valence_[v]);
      ensure(count == valence_[v], "a vertex is one cycle");
      ensure(border == on_boundary(v), "a vertex knows whether it's on the boundary");
    }
  }
}

}  // namespace rattan
