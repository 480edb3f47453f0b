// SPDX-License-Identifier: MIT
#pragma once

// Small polygon meshes and scratch directories for the tests of io/.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <numbers>
#include <random>
#include <stdlib.h>
#include <string>
#include <utility>
#include <vector>

#include "engine/remesh/polygon_mesh.h"

namespace rattan::testing {

/// Removed with everything in it.
class ScratchDirectory {
 public:
  ScratchDirectory() {
    std::string pattern = (std::filesystem::temp_directory_path() / "rattan-io-XXXXXX").string();
    path_ = ::mkdtemp(pattern.data());
  }
  ~ScratchDirectory() { std::filesystem::remove_all(path_); }
  ScratchDirectory(const ScratchDirectory&) = delete;
  ScratchDirectory& operator=(const ScratchDirectory&) = delete;
  std::string file(const std::string& name) const { return (path_ / name).string(); }
  std::vector<std::string> names() const {
    std::vector<std::string> out;
    for (const auto& entry : std::filesystem::directory_iterator(path_)) {
      out.push_back(entry.path().filename().string());
    }
    return out;
  }

 private:
  std::filesystem::path path_;
};

inline void add(PolygonMesh& mesh, std::initializer_list<std::uint32_t> face) {
  mesh.add_face(std::vector<std::uint32_t>(face));
}

inline PolygonMesh tetrahedron() {
  PolygonMesh m;
  m.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  add(m, {0, 2, 1});
  add(m, {0, 1, 3});
  add(m, {1, 2, 3});
  add(m, {2, 0, 3});
  return m;
}

inline PolygonMesh cube() {
  PolygonMesh m;
  for (int i = 0; i < 8; ++i) {
    m.positions.emplace_back(i & 1, (i >> 1) & 1, (i >> 2) & 1);
  }
  add(m, {0, 2, 3, 1});
  add(m, {4, 5, 7, 6});
  add(m, {0, 1, 5, 4});
  add(m, {2, 6, 7, 3});
  add(m, {0, 4, 6, 2});
  add(m, {1, 3, 7, 5});
  return m;
}

/// Without vertices that no face uses.
inline PolygonMesh compacted(const PolygonMesh& mesh) {
  std::vector<std::uint32_t> number(mesh.vertex_count(), 0);
  for (const std::uint32_t v : mesh.corners) {
    number[v] = 1;
  }
  PolygonMesh out = mesh;
  out.positions.clear();
  for (std::size_t v = 0; v < number.size(); ++v) {
    if (number[v] != 0) {
      number[v] = static_cast<std::uint32_t>(out.positions.size());
      out.positions.push_back(mesh.positions[v]);
    }
  }
  for (std::uint32_t& v : out.corners) {
    v = number[v];
  }
  return out;
}

/// n x m quads over a wavy height field, with a rectangular hole where asked.
inline PolygonMesh wavy_grid(std::uint32_t n, std::uint32_t m, bool hole = false) {
  PolygonMesh mesh;
  for (std::uint32_t j = 0; j <= m; ++j) {
    for (std::uint32_t i = 0; i <= n; ++i) {
      mesh.positions.emplace_back(i * 0.1, j * 0.1, 0.05 * std::sin(0.7 * i) * std::cos(0.4 * j));
    }
  }
  const std::uint32_t w = n + 1;
  for (std::uint32_t j = 0; j < m; ++j) {
    for (std::uint32_t i = 0; i < n; ++i) {
      if (!hole || i < n / 3 || i >= 2 * n / 3 || j < m / 3 || j >= 2 * m / 3) {
        add(mesh, {j * w + i, j * w + i + 1, (j + 1) * w + i + 1, (j + 1) * w + i});
      }
    }
  }
  return compacted(mesh);
}

/// Quads; every `triangle_every`-th is two triangles instead (0: none).
inline PolygonMesh torus(std::uint32_t n, std::uint32_t m, std::uint32_t triangle_every = 0) {
  PolygonMesh mesh;
  const double pi = std::numbers::pi;
  for (std::uint32_t j = 0; j < m; ++j) {
    for (std::uint32_t i = 0; i < n; ++i) {
      const double u = 2 * pi * i / n;
      const double v = 2 * pi * j / m;
      mesh.positions.emplace_back((3 + std::cos(v)) * std::cos(u), (3 + std::cos(v)) * std::sin(u),
                                  std::sin(v));
    }
  }
  for (std::uint32_t j = 0; j < m; ++j) {
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t a = j * n + i;
      const std::uint32_t b = j * n + (i + 1) % n;
      const std::uint32_t c = (j + 1) % m * n + (i + 1) % n;
      const std::uint32_t d = (j + 1) % m * n + i;
      if (triangle_every != 0 && a % triangle_every == 0) {
        add(mesh, {a, b, c});
        add(mesh, {a, c, d});
      } else {
        add(mesh, {a, b, c, d});
      }
    }
  }
  return mesh;
}

/// A prism over a regular polygon: two faces of degree n and n quads.
inline PolygonMesh prism(std::uint32_t n) {
  PolygonMesh mesh;
  std::vector<std::uint32_t> top;
  std::vector<std::uint32_t> bottom;
  for (std::uint32_t i = 0; i < n; ++i) {
    const double u = 2 * std::numbers::pi * i / n;
    mesh.positions.emplace_back(std::cos(u), std::sin(u), 0.0);
    mesh.positions.emplace_back(std::cos(u), std::sin(u), 1.0);
    top.push_back(2 * i + 1);
    bottom.push_back(2 * (n - 1 - i));
    const std::uint32_t j = (i + 1) % n;
    add(mesh, {2 * i, 2 * j, 2 * j + 1, 2 * i + 1});
  }
  mesh.add_face(top);
  mesh.add_face(bottom);
  return mesh;
}

/// Two quads back to back on the same four vertices.
inline PolygonMesh pillow() {
  PolygonMesh m;
  m.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  add(m, {0, 1, 2, 3});
  add(m, {3, 2, 1, 0});
  return m;
}

/// A cube whose face 0 1 5 4 holds an inner vertex of valence two: both its quads have the diagonal
/// 0-5 in common, so neither may use it.
inline PolygonMesh cube_with_valence_two() {
  PolygonMesh m = cube();
  m.positions.emplace_back(0.5, 0.0, 0.4);
  PolygonMesh out;
  out.positions = m.positions;
  for (std::size_t f = 0; f < m.face_count(); ++f) {
    if (f != 2) {
      out.add_face(m.face(f));
    }
  }
  add(out, {0, 1, 5, 8});
  add(out, {0, 8, 5, 4});
  return out;
}

/// All of b after all of a; vertices stay distinct.
inline PolygonMesh join(const PolygonMesh& a, const PolygonMesh& b) {
  PolygonMesh out = a;
  const auto base = static_cast<std::uint32_t>(a.vertex_count());
  out.positions.insert(out.positions.end(), b.positions.begin(), b.positions.end());
  for (std::size_t f = 0; f < b.face_count(); ++f) {
    std::vector<std::uint32_t> face(b.face(f).begin(), b.face(f).end());
    for (std::uint32_t& v : face) {
      v += base;
    }
    out.add_face(face);
  }
  return out;
}

/// Two fans of quads that touch in a point, as repair leaves them: two vertices there, one each.
inline PolygonMesh split_pinch() {
  PolygonMesh a = wavy_grid(3, 3);
  PolygonMesh b = wavy_grid(3, 3);
  const Vec3d shift = a.positions.back() - b.positions.front();
  for (Vec3d& p : b.positions) {
    p += shift;
  }
  b.positions.front() = a.positions.back();
  return join(a, b);
}

/// A strip of quads bent to a ring whose ends lie on each other without being joined.
inline PolygonMesh slit_ring(std::uint32_t n) {
  PolygonMesh mesh;
  for (std::uint32_t i = 0; i <= n; ++i) {
    const double u = 2 * std::numbers::pi * (i % n) / n;
    mesh.positions.emplace_back(std::cos(u), std::sin(u), 0.0);
    mesh.positions.emplace_back(std::cos(u), std::sin(u), 0.5);
  }
  for (std::uint32_t i = 0; i < n; ++i) {
    add(mesh, {2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1});
  }
  return mesh;
}

/// Random neighbours joined to polygons of up to `most` corners, until `share` of the faces is
/// gone. Gives vertices of valence two, concave faces and polygons that touch themselves at no
/// vertex.
inline PolygonMesh merged(const PolygonMesh& mesh, double share, std::size_t most, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<std::vector<std::uint32_t>> faces;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> owner;
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    faces.emplace_back(mesh.face(f).begin(), mesh.face(f).end());
    for (std::size_t i = 0; i < faces[f].size(); ++i) {
      owner[{faces[f][i], faces[f][(i + 1) % faces[f].size()]}] = f;
    }
  }
  const auto wanted = static_cast<std::size_t>(share * static_cast<double>(faces.size()));
  std::size_t gone = 0;
  for (std::size_t tries = 0; tries < 30 * mesh.face_count() && gone < wanted; ++tries) {
    const std::size_t f = random() % faces.size();
    if (faces[f].empty()) {
      continue;
    }
    std::vector<std::uint32_t> a = faces[f];
    std::rotate(a.begin(), a.begin() + static_cast<std::ptrdiff_t>(random() % a.size()), a.end());
    // The edge from the last corner of a to its first.
    const auto other = owner.find({a.front(), a.back()});
    if (other == owner.end() || other->second == f) {
      continue;
    }
    std::vector<std::uint32_t>& b = faces[other->second];
    const auto common = std::count_if(b.begin(), b.end(), [&](std::uint32_t v) {
      return std::find(a.begin(), a.end(), v) != a.end();
    });
    if (common != 2 || a.size() + b.size() - 2 > most) {
      continue;
    }
    owner.erase({a.front(), a.back()});
    owner.erase({a.back(), a.front()});
    std::rotate(b.begin(), std::find(b.begin(), b.end(), a.back()), b.end());
    a.insert(a.end(), b.begin() + 1, b.end() - 1);
    b.clear();
    for (std::size_t i = 0; i < a.size(); ++i) {
      owner[{a[i], a[(i + 1) % a.size()]}] = f;
    }
    faces[f] = a;
    ++gone;
  }
  PolygonMesh out;
  out.positions = mesh.positions;
  for (const auto& face : faces) {
    if (!face.empty()) {
      out.add_face(face);
    }
  }
  return compacted(out);
}

struct NamedMesh {
  const char* name;
  PolygonMesh mesh;
};

inline std::vector<NamedMesh> all_meshes() {
  PolygonMesh triangle;
  triangle.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  add(triangle, {0, 1, 2});
  PolygonMesh quad;
  quad.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  add(quad, {0, 1, 2, 3});
  return {{"triangle", triangle},
          {"quad", quad},
          {"tetrahedron", tetrahedron()},
          {"cube", cube()},
          {"pillow", pillow()},
          {"valence_two", cube_with_valence_two()},
          {"pentagons", prism(5)},
          {"nonagons", prism(9)},
          {"three_hundred_gon", prism(300)},
          {"grid", wavy_grid(12, 9)},
          {"hole", wavy_grid(12, 9, true)},
          {"torus", torus(24, 12)},
          {"mixed_torus", torus(24, 12, 7)},
          {"tiny_torus", torus(3, 3)},
          {"components", join(join(torus(9, 7), cube()), wavy_grid(5, 5))},
          {"coincident_components", join(join(cube(), cube()), cube())},
          {"split_pinch", split_pinch()},
          {"slit_ring", slit_ring(8)}};
}

}  // namespace rattan::testing
