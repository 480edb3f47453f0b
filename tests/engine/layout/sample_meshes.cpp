// SPDX-License-Identifier: MIT
#include "tests/engine/layout/sample_meshes.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <numeric>
#include <set>
#include <sstream>

#include <gtest/gtest.h>

#include "engine/core/exact_math.h"

namespace rattan::testing {

namespace {

std::uint32_t find(std::vector<std::uint32_t>& parent, std::uint32_t x) {
  while (parent[x] != x) {
    x = parent[x] = parent[parent[x]];
  }
  return x;
}

/// As the store keeps it. Volatile, because GCC 12 at -O3 drops a narrowing that is widened at
/// once.
Vec3d stored(const Vec3d& p) {
  Vec3d rounded;
  for (int i = 0; i < 3; ++i) {
    const volatile float narrow = static_cast<float>(p[i]);
    rounded[i] = static_cast<double>(narrow);
  }
  return rounded;
}

}  // namespace

double Random::next() {
  state_ += 0x9e3779b97f4a7c15ULL;
  std::uint64_t z = state_;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

IndexedMesh grid(std::uint32_t nx, std::uint32_t ny, double side) {
  IndexedMesh m{"grid", {}, {}};
  for (std::uint32_t y = 0; y <= ny; ++y) {
    for (std::uint32_t x = 0; x <= nx; ++x) {
      m.positions.emplace_back(side * x, side * y, 0.0);
    }
  }
  for (std::uint32_t y = 0; y < ny; ++y) {
    for (std::uint32_t x = 0; x < nx; ++x) {
      const std::uint32_t a = y * (nx + 1) + x;
      const std::uint32_t b = a + nx + 1;
      m.triangles.push_back({a, a + 1, b + 1});
      m.triangles.push_back({a, b + 1, b});
    }
  }
  return m;
}

IndexedMesh torus(std::uint32_t nu, std::uint32_t nv) {
  IndexedMesh m{"torus", {}, {}};
  const double minor = nv / 6.0;
  for (std::uint32_t u = 0; u < nu; ++u) {
    for (std::uint32_t v = 0; v < nv; ++v) {
      const auto [su, cu] = exact::sincos(2 * exact::kPi * u / nu);
      const auto [sv, cv] = exact::sincos(2 * exact::kPi * v / nv);
      const double r = minor * (3.0 + cv);
      m.positions.emplace_back(r * cu, r * su, minor * sv);
    }
  }
  for (std::uint32_t u = 0; u < nu; ++u) {
    for (std::uint32_t v = 0; v < nv; ++v) {
      const std::uint32_t a = u * nv + v;
      const std::uint32_t b = (u + 1) % nu * nv + v;
      const std::uint32_t c = (u + 1) % nu * nv + (v + 1) % nv;
      const std::uint32_t d = u * nv + (v + 1) % nv;
      m.triangles.push_back({a, b, c});
      m.triangles.push_back({a, c, d});
    }
  }
  return m;
}

IndexedMesh sphere(int levels, double radius) {
  IndexedMesh m{"sphere", {}, {}};
  m.positions = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  m.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                 {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int l = 0; l < levels; ++l) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middle;
    std::vector<std::array<std::uint32_t, 3>> finer;
    const auto mid = [&](std::uint32_t a, std::uint32_t b) {
      const auto key = std::minmax(a, b);
      const auto [at, fresh] =
          middle.try_emplace(key, static_cast<std::uint32_t>(m.positions.size()));
      if (fresh) {
        m.positions.push_back((m.positions[a] + m.positions[b]).normalized());
      }
      return at->second;
    };
    for (const auto& t : m.triangles) {
      const std::uint32_t a = mid(t[0], t[1]);
      const std::uint32_t b = mid(t[1], t[2]);
      const std::uint32_t c = mid(t[2], t[0]);
      finer.push_back({t[0], a, c});
      finer.push_back({a, t[1], b});
      finer.push_back({c, b, t[2]});
      finer.push_back({a, b, c});
    }
    m.triangles = std::move(finer);
  }
  for (Vec3d& p : m.positions) {
    p *= radius;
  }
  return m;
}

IndexedMesh plate(const std::vector<std::string>& mask, int per_cube) {
  IndexedMesh m{"plate", {}, {}};
  const int h = static_cast<int>(mask.size());
  const int w = static_cast<int>(mask[0].size());
  const auto full = [&](int x, int y, int z) {
    const auto down = [&](int i) { return i < 0 ? -1 : i / per_cube; };
    return down(x) >= 0 && down(x) < w && down(y) >= 0 && down(y) < h && down(z) == 0 &&
           mask[static_cast<std::size_t>(down(y))][static_cast<std::size_t>(down(x))] == '#';
  };
  std::map<std::array<int, 3>, std::uint32_t> ids;
  const auto vertex = [&](int x, int y, int z) {
    const auto [at, fresh] =
        ids.try_emplace({x, y, z}, static_cast<std::uint32_t>(m.positions.size()));
    if (fresh) {
      m.positions.emplace_back(static_cast<double>(x) / per_cube, static_cast<double>(y) / per_cube,
                               static_cast<double>(z) / per_cube);
    }
    return at->second;
  };
  const auto quad = [&](std::array<std::array<int, 3>, 4> c) {
    std::array<std::uint32_t, 4> v{};
    for (std::size_t i = 0; i < 4; ++i) {
      v[i] = vertex(c[i][0], c[i][1], c[i][2]);
    }
    m.triangles.push_back({v[0], v[1], v[2]});
    m.triangles.push_back({v[0], v[2], v[3]});
  };
  for (int z = 0; z < per_cube; ++z) {
    for (int y = 0; y < h * per_cube; ++y) {
      for (int x = 0; x < w * per_cube; ++x) {
        if (!full(x, y, z)) {
          continue;
        }
        const int X = x + 1;
        const int Y = y + 1;
        const int Z = z + 1;
        if (!full(x, y, z - 1)) quad({{{x, y, z}, {x, Y, z}, {X, Y, z}, {X, y, z}}});
        if (!full(x, y, z + 1)) quad({{{x, y, Z}, {X, y, Z}, {X, Y, Z}, {x, Y, Z}}});
        if (!full(x, y - 1, z)) quad({{{x, y, z}, {X, y, z}, {X, y, Z}, {x, y, Z}}});
        if (!full(x, y + 1, z)) quad({{{x, Y, z}, {x, Y, Z}, {X, Y, Z}, {X, Y, z}}});
        if (!full(x - 1, y, z)) quad({{{x, y, z}, {x, y, Z}, {x, Y, Z}, {x, Y, z}}});
        if (!full(x + 1, y, z)) quad({{{X, y, z}, {X, Y, z}, {X, Y, Z}, {X, y, Z}}});
      }
    }
  }
  return m;
}

IndexedMesh tetrahedron() {
  return {"tetrahedron",
          {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
          {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}};
}

IndexedMesh pillow() {
  return {"pillow", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 1}}};
}

IndexedMesh without(const IndexedMesh& m, const std::function<bool(std::uint32_t)>& dropped) {
  IndexedMesh out{m.name + " with holes", {}, {}};
  std::vector<std::uint32_t> id(m.positions.size(), ~0U);
  for (std::uint32_t t = 0; t < m.triangles.size(); ++t) {
    if (dropped(t)) {
      continue;
    }
    std::array<std::uint32_t, 3> c = m.triangles[t];
    for (std::uint32_t& v : c) {
      if (id[v] == ~0U) {
        id[v] = static_cast<std::uint32_t>(out.positions.size());
        out.positions.push_back(m.positions[v]);
      }
      v = id[v];
    }
    out.triangles.push_back(c);
  }
  return out;
}

IndexedMesh join(const std::vector<IndexedMesh>& parts) {
  IndexedMesh out{"several", {}, {}};
  double shift = 0.0;
  for (const IndexedMesh& p : parts) {
    const auto base = static_cast<std::uint32_t>(out.positions.size());
    for (const Vec3d& x : p.positions) {
      out.positions.push_back(x + Vec3d(shift, 0, 0));
    }
    for (const auto& t : p.triangles) {
      out.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
    }
    shift += 100.0;
  }
  return out;
}

IndexedMesh shuffled(const IndexedMesh& m, std::uint64_t seed) {
  IndexedMesh out{m.name + " shuffled", std::vector<Vec3d>(m.positions.size()), m.triangles};
  std::vector<std::uint32_t> to(m.positions.size());
  std::iota(to.begin(), to.end(), 0U);
  Random random(seed);
  for (std::size_t i = to.size(); i > 1; --i) {
    std::swap(to[i - 1], to[static_cast<std::size_t>(random.next() * static_cast<double>(i))]);
  }
  for (std::size_t v = 0; v < to.size(); ++v) {
    out.positions[to[v]] = m.positions[v];
  }
  for (auto& t : out.triangles) {
    for (std::uint32_t& v : t) {
      v = to[v];
    }
  }
  return out;
}

IndexedMesh read_sample(const std::string& path) {
  IndexedMesh m{path.substr(path.rfind('/') + 1), {}, {}};
  std::ifstream in(path);
  std::string line;
  const bool off = path.ends_with(".off");
  std::size_t vertices = 0;
  std::size_t faces = 0;
  if (off) {
    std::string magic;
    std::size_t edges = 0;
    in >> magic >> vertices >> faces >> edges;
    for (std::size_t i = 0; i < vertices; ++i) {
      Vec3d p;
      in >> p.x() >> p.y() >> p.z();
      m.positions.push_back(p);
    }
    for (std::size_t i = 0; i < faces; ++i) {
      int n = 0;
      std::array<std::uint32_t, 3> t{};
      in >> n >> t[0] >> t[1] >> t[2];
      m.triangles.push_back(t);
      std::getline(in, line);
    }
  } else {
    while (std::getline(in, line)) {
      std::istringstream words(line);
      std::string word;
      words >> word;
      if (word == "v") {
        Vec3d p;
        words >> p.x() >> p.y() >> p.z();
        m.positions.push_back(p);
      } else if (word == "f") {
        std::array<std::uint32_t, 3> t{};
        for (std::uint32_t& v : t) {
          words >> word;
          v = static_cast<std::uint32_t>(std::stoul(word)) - 1;
        }
        m.triangles.push_back(t);
      }
    }
  }
  std::set<std::pair<std::uint32_t, std::uint32_t>> sides;
  for (const auto& t : m.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (!sides.insert({t[k], t[(k + 1) % 3]}).second) {
        return {};
      }
    }
  }
  return without(m, [](std::uint32_t) { return false; });
}

Fields random_fields(const IndexedMesh& m, std::uint64_t seed) {
  Fields f = linear_fields(m, Vec3d(0.3, 0.5, 0.8), 1.0);
  Random random(seed);
  for (std::size_t v = 0; v < f.frames.size(); ++v) {
    VertexFrame& frame = f.frames[v];
    const auto [s, c] = exact::sincos(2 * exact::kPi * random.next());
    const Vec3f across = frame.normal.cross(frame.direction);
    frame.direction =
        (static_cast<float>(c) * frame.direction + static_cast<float>(s) * across).normalized();
    const auto a = exact::sincos(2 * exact::kPi * random.next());
    const auto b = exact::sincos(2 * exact::kPi * random.next());
    f.phases[v].u = {static_cast<float>(a.cos), static_cast<float>(a.sin)};
    f.phases[v].v = {static_cast<float>(b.cos), static_cast<float>(b.sin)};
  }
  return f;
}

Fields linear_fields(const IndexedMesh& m, const Vec3d& direction, double omega) {
  std::vector<Vec3d> normals(m.positions.size(), Vec3d::Zero());
  for (const auto& t : m.triangles) {
    const Vec3d n =
        (m.positions[t[1]] - m.positions[t[0]]).cross(m.positions[t[2]] - m.positions[t[0]]);
    for (const std::uint32_t v : t) {
      normals[v] += n;
    }
  }
  Fields f;
  for (std::size_t v = 0; v < m.positions.size(); ++v) {
    const Vec3d n = normals[v].norm() > 0 ? normals[v].normalized() : Vec3d(0, 0, 1);
    Vec3d k = direction - direction.dot(n) * n;
    if (k.norm() < 1e-6) {
      k = n.unitOrthogonal();
    }
    k.normalize();
    VertexFrame frame;
    frame.position = m.positions[v].cast<float>();
    frame.normal = n.cast<float>();
    frame.direction = k.cast<float>();
    const auto a = exact::sincos(2 * exact::kPi / omega * k.dot(m.positions[v]));
    const auto b = exact::sincos(2 * exact::kPi / omega * n.cross(k).dot(m.positions[v]));
    PairValue p;
    p.u = {static_cast<float>(a.cos), static_cast<float>(a.sin)};
    p.v = {static_cast<float>(b.cos), static_cast<float>(b.sin)};
    f.frames.push_back(frame);
    f.phases.push_back(p);
  }
  return f;
}

std::vector<IndexedMesh> all_meshes() {
  std::vector<IndexedMesh> list;
  list.push_back(grid(12, 9));
  list.push_back(without(grid(14, 11), [](std::uint32_t t) {
    const std::uint32_t x = t / 2 % 14;
    const std::uint32_t y = t / 2 / 14;
    return (x == 3 && y == 3) || (x > 6 && x < 10 && y > 4 && y < 8);
  }));
  list.push_back(torus(24, 12));
  list.push_back(sphere(3, 4.0));
  list.push_back(without(torus(20, 9), [](std::uint32_t t) { return t % 61 == 3; }));
  list.push_back(plate({"#####", "#.#.#", "#####", "#.###", "#####"}));
  list.push_back(tetrahedron());
  list.push_back(pillow());
  list.push_back({"triangle", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}});
  list.push_back(join({sphere(2), tetrahedron(), torus(9, 5), grid(4, 3), pillow(), sphere(0)}));
  list.push_back(join({torus(9, 5), sphere(2), grid(4, 3), tetrahedron(), sphere(0)}));
  list.push_back(shuffled(plate({"####", "#..#", "####"}), 5));
  list.push_back(shuffled(list[1], 7));
  return list;
}

ScanMesh store_fields(Store& store, const IndexedMesh& m, const Fields& fields,
                      std::uint32_t tile_size) {
  const ScanMesh mesh = tile_indexed_mesh(store, m.positions, m.triangles, tile_size);
  HaloBoard<VertexFrame> frames(mesh.layout.border_count);
  HaloBoard<PairValue> phases(mesh.layout.border_count);
  for (std::uint32_t t = 0; t < mesh.layout.tile_count(); ++t) {
    const TileExtent& e = mesh.layout.tiles[t];
    const auto border = read(store, fields::kMeshHalo.border, TileId(t));
    const std::span<const VertexFrame> f(fields.frames.data() + e.first, e.owned);
    const std::span<const PairValue> p(fields.phases.data() + e.first, e.owned);
    publish_border<VertexFrame>(f, border.span(), e.border_first, frames);
    publish_border<PairValue>(p, border.span(), e.border_first, phases);
    write(store, fields::kFrame, TileId(t), f);
    write(store, fields::kPhase, TileId(t), p);
  }
  write(store, fields::kFrame, kBoardTile, frames);
  write(store, fields::kPhase, kBoardTile, phases);
  return mesh;
}

Extracted extract(const IndexedMesh& m, const Fields& fields, double omega, int density,
                  std::uint32_t tile_size, int threads, std::uint64_t most_crossings) {
  MemoryStore store;
  const ScanMesh mesh = store_fields(store, m, fields, tile_size);
  TaskGraph graph({.threads = threads});
  Extracted out;
  ArrangementOptions options;
  options.omega = omega;
  options.density = density;
  options.most_crossings = most_crossings;
  out.cells = extract_cells(store, mesh, options, graph, out.report);
  return out;
}

std::vector<ComponentTopology> topology(const IndexedMesh& m,
                                        std::vector<std::uint32_t>& component) {
  std::vector<std::uint32_t> parent(m.positions.size());
  std::iota(parent.begin(), parent.end(), 0U);
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  std::map<std::uint32_t, std::uint32_t> boundary;
  std::set<std::pair<std::uint32_t, std::uint32_t>> sides;
  for (const auto& t : m.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k];
      const std::uint32_t b = t[(k + 1) % 3];
      parent[find(parent, a)] = find(parent, b);
      edges[std::minmax(a, b)]++;
      sides.insert({a, b});
    }
  }
  std::map<std::uint32_t, std::size_t> index;
  std::vector<ComponentTopology> out;
  component.resize(m.positions.size());
  for (std::uint32_t v = 0; v < m.positions.size(); ++v) {
    const auto [at, fresh] = index.try_emplace(find(parent, v), out.size());
    if (fresh) {
      out.push_back({});
    }
    component[v] = static_cast<std::uint32_t>(at->second);
    ++out[at->second].euler;
  }
  for (const auto& [e, n] : edges) {
    --out[component[e.first]].euler;
  }
  for (const auto& t : m.triangles) {
    ++out[component[t[0]]].euler;
  }
  for (const auto& [a, b] : sides) {
    if (!sides.contains({b, a})) {
      EXPECT_TRUE(boundary.emplace(a, b).second) << "the input must be manifold";
    }
  }
  while (!boundary.empty()) {
    const std::uint32_t first = boundary.begin()->first;
    ++out[component[first]].loops;
    for (std::uint32_t at = first; boundary.contains(at);) {
      const std::uint32_t to = boundary[at];
      boundary.erase(at);
      at = to;
    }
  }
  return out;
}

void expect_decomposition(const IndexedMesh& m, const CellComplex& cells) {
  const PolygonMesh& p = cells.mesh;
  std::vector<std::uint32_t> component;
  const std::vector<ComponentTopology> wanted = topology(m, component);
  // Triangles in the order of the store: lowest vertex first, ascending.
  std::vector<std::array<std::uint32_t, 3>> sorted = m.triangles;
  for (auto& t : sorted) {
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  }
  std::sort(sorted.begin(), sorted.end());

  ASSERT_EQ(p.scan_triangle.size(), p.vertex_count());
  ASSERT_EQ(p.vertex_flags.size(), p.vertex_count());
  ASSERT_EQ(cells.corner_edge.size(), p.corners.size());
  ASSERT_EQ(cells.face_singular.size(), p.face_count());
  ASSERT_EQ(p.face_begin.back(), p.corners.size());

  std::vector<ComponentTopology> got(wanted.size());
  std::vector<std::uint32_t> where(p.vertex_count());
  for (std::size_t v = 0; v < p.vertex_count(); ++v) {
    ASSERT_LT(p.scan_triangle[v], sorted.size());
    const auto& t = sorted[p.scan_triangle[v]];
    where[v] = component[t[0]];
    ++got[where[v]].euler;
    // The vertex lies in its triangle.
    const Vec3d a = stored(m.positions[t[0]]);
    const Vec3d b = stored(m.positions[t[1]]) - a;
    const Vec3d c = stored(m.positions[t[2]]) - a;
    const Vec3d x = p.positions[v] - a;
    ASSERT_TRUE(x.allFinite());
    const double size = std::max(b.norm(), c.norm());
    const Vec3d n = b.cross(c);
    if (n.norm() > 1e-12 * size * size) {
      EXPECT_LE(std::abs(x.dot(n.normalized())), 1e-9 * (1 + size));
      const double u = x.cross(c).dot(n) / n.squaredNorm();
      const double w = b.cross(x).dot(n) / n.squaredNorm();
      EXPECT_GE(std::min({u, w, 1 - u - w}), -1e-6);
    }
  }

  // Half-edges by edge: an interior edge twice in opposite directions, a boundary edge once.
  struct Use {
    std::uint32_t from, to;
    std::size_t corner;
  };
  std::vector<std::vector<Use>> uses(cells.edge_count);
  std::vector<std::size_t> face_of(p.corners.size());
  for (std::size_t f = 0; f < p.face_count(); ++f) {
    ASSERT_GE(p.degree(f), 1U);
    for (std::size_t i = 0; i < p.degree(f); ++i) {
      const std::size_t corner = p.face_begin[f] + i;
      face_of[corner] = f;
      ASSERT_LT(p.corners[corner], p.vertex_count());
      ASSERT_LT(cells.corner_edge[corner], cells.edge_count);
      uses[cells.corner_edge[corner]].push_back(
          {p.corners[corner], p.face(f)[(i + 1) % p.degree(f)], corner});
    }
    ++got[where[p.face(f)[0]]].euler;
    for (const std::uint32_t v : p.face(f)) {
      EXPECT_EQ(where[v], where[p.face(f)[0]]) << "a face stays on its component";
    }
  }
  std::vector<std::size_t> twin(p.corners.size(), ~std::size_t{0});
  for (std::uint32_t e = 0; e < cells.edge_count; ++e) {
    ASSERT_TRUE(uses[e].size() == 1 || uses[e].size() == 2) << uses[e].size();
    --got[where[uses[e][0].from]].euler;
    if (uses[e].size() == 2) {
      EXPECT_EQ(uses[e][0].from, uses[e][1].to);
      EXPECT_EQ(uses[e][0].to, uses[e][1].from);
      twin[uses[e][0].corner] = uses[e][1].corner;
      twin[uses[e][1].corner] = uses[e][0].corner;
    }
  }
  // One fan of corners around every vertex, or one fan between two boundary edges; boundary loops
  // of three edges and more.
  const auto next_in_face = [&](std::size_t corner) {
    const std::size_t f = face_of[corner];
    return corner + 1 == p.face_begin[f + 1] ? p.face_begin[f] : corner + 1;
  };
  std::vector<std::size_t> prev(p.corners.size());
  for (std::size_t c = 0; c < prev.size(); ++c) {
    prev[next_in_face(c)] = c;
  }
  std::vector<std::size_t> fans(p.vertex_count(), 0);
  std::vector<std::uint8_t> seen(p.corners.size(), 0);
  const auto turn = [&](std::size_t corner) { return twin[prev[corner]]; };  // counter-clockwise
  for (int pass = 0; pass < 2; ++pass) {
    for (std::size_t c = 0; c < p.corners.size(); ++c) {
      // Open fans first: they start at a boundary edge.
      if (seen[c] != 0 || (pass == 0 && twin[c] != ~std::size_t{0})) {
        continue;
      }
      ++fans[p.corners[c]];
      EXPECT_EQ((p.vertex_flags[p.corners[c]] & kBoundaryVertex) != 0, pass == 0);
      for (std::size_t at = c; at != ~std::size_t{0} && seen[at] == 0; at = turn(at)) {
        EXPECT_EQ(p.corners[at], p.corners[c]);
        seen[at] = 1;
      }
    }
  }
  for (std::size_t v = 0; v < p.vertex_count(); ++v) {
    EXPECT_EQ(fans[v], 1U) << "vertex " << v;
  }
  std::map<std::uint32_t, std::uint32_t> boundary;
  for (const auto& u : uses) {
    if (u.size() == 1) {
      EXPECT_TRUE(boundary.emplace(u[0].from, u[0].to).second);
    }
  }
  while (!boundary.empty()) {
    const std::uint32_t first = boundary.begin()->first;
    ++got[where[first]].loops;
    int length = 0;
    for (std::uint32_t at = first; boundary.contains(at);) {
      const std::uint32_t to = boundary[at];
      boundary.erase(at);
      at = to;
      ++length;
    }
    EXPECT_GE(length, 3);
  }
  ASSERT_EQ(got.size(), wanted.size());
  for (std::size_t i = 0; i < got.size(); ++i) {
    EXPECT_EQ(got[i].euler, wanted[i].euler) << "component " << i;
    EXPECT_EQ(got[i].loops, wanted[i].loops) << "component " << i;
  }
}

void expect_same(const CellComplex& a, const CellComplex& b) {
  ASSERT_EQ(a.mesh.positions.size(), b.mesh.positions.size());
  for (std::size_t v = 0; v < a.mesh.positions.size(); ++v) {
    ASSERT_EQ(a.mesh.positions[v], b.mesh.positions[v]) << "vertex " << v;
  }
  EXPECT_EQ(a.mesh.scan_triangle, b.mesh.scan_triangle);
  EXPECT_EQ(a.mesh.vertex_flags, b.mesh.vertex_flags);
  EXPECT_EQ(a.mesh.face_begin, b.mesh.face_begin);
  EXPECT_EQ(a.mesh.corners, b.mesh.corners);
  EXPECT_EQ(a.corner_edge, b.corner_edge);
  EXPECT_EQ(a.edge_count, b.edge_count);
  EXPECT_EQ(a.face_singular, b.face_singular);
}

}  // namespace rattan::testing
