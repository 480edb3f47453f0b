// SPDX-License-Identifier: MIT
#include "tests/engine/remesh/scan_shapes.h"

#include <map>

namespace rattan::test {

CubeSurface cube_surface(std::uint32_t n, const std::function<Vec3d(const Vec3d&)>& f) {
  CubeSurface s;
  std::map<std::array<std::uint32_t, 3>, std::uint32_t> ids;
  const auto vertex = [&](const std::array<std::uint32_t, 3>& g) {
    const auto [at, fresh] = ids.emplace(g, static_cast<std::uint32_t>(s.positions.size()));
    if (fresh) {
      const Vec3d p = Vec3d(g[0], g[1], g[2]) * (2.0 / n) - Vec3d::Ones();
      s.positions.push_back(f(p).cast<float>().cast<double>());
    }
    return at->second;
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const std::uint32_t side : {0U, n}) {
      for (std::uint32_t j = 0; j < n; ++j) {
        for (std::uint32_t i = 0; i < n; ++i) {
          const auto corner = [&](std::uint32_t a, std::uint32_t b) {
            std::array<std::uint32_t, 3> g{};
            g[axis] = side;
            g[(axis + 1) % 3] = a;
            g[(axis + 2) % 3] = b;
            return vertex(g);
          };
          const std::uint32_t a = corner(i, j);
          const std::uint32_t b = corner(i + 1, j);
          const std::uint32_t c = corner(i + 1, j + 1);
          const std::uint32_t d = corner(i, j + 1);
          if (side == n) {
            s.quads.push_back({a, b, c, d});
          } else {
            s.quads.push_back({a, d, c, b});
          }
        }
      }
    }
  }
  return s;
}

Soup cube_scan(std::uint32_t n, const std::function<Vec3d(const Vec3d&)>& f) {
  const CubeSurface c = cube_surface(n, f);
  Soup s;
  s.positions = c.positions;
  for (const auto& q : c.quads) {
    s.triangles.push_back({q[0], q[1], q[2]});
    s.triangles.push_back({q[0], q[2], q[3]});
  }
  return s;
}

PolygonMesh cube_remesh(std::uint32_t n, const std::function<Vec3d(const Vec3d&)>& f) {
  const CubeSurface c = cube_surface(n, f);
  PolygonMesh m;
  m.positions = c.positions;
  for (const auto& q : c.quads) {
    m.add_face(q);
  }
  return m;
}

PolygonMesh grid_remesh(std::uint32_t nu, std::uint32_t nv,
                        const std::function<Vec3d(double, double)>& f) {
  PolygonMesh m;
  for (std::uint32_t j = 0; j <= nv; ++j) {
    for (std::uint32_t i = 0; i <= nu; ++i) {
      m.positions.push_back(f(double(i) / nu, double(j) / nv));
    }
  }
  for (std::uint32_t j = 0; j < nv; ++j) {
    for (std::uint32_t i = 0; i < nu; ++i) {
      const std::uint32_t a = j * (nu + 1) + i;
      const std::array<std::uint32_t, 4> q{a, a + 1, a + nu + 2, a + nu + 1};
      m.add_face(q);
    }
  }
  return m;
}

}  // namespace rattan::test
