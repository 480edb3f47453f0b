// SPDX-License-Identifier: MIT
// The comparison that vouches for Draco files lets pass what is the same mesh, and nothing else.

#include "io/layout/textured_mesh.h"

#include <algorithm>
#include <numeric>
#include <random>

#include <gtest/gtest.h>

#include "tests/engine/layout/polygon_layout.h"

namespace rattan {
namespace {

TexturedMesh textured(const PolygonMesh& polygons, bool colours) {
  testing::PolygonLayoutOptions options;
  options.colours = colours;
  testing::PolygonLayout layout(polygons, options);
  TexturedMesh mesh;
  for (const Vec3d& p : layout.positions) {
    mesh.position.push_back(
        {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])});
  }
  mesh.colour = layout.colours;
  layout.for_each_chart([&](const LayoutChart& chart) {
    for (std::size_t v = 0; v < chart.uv.size(); ++v) {
      mesh.uv.push_back({static_cast<float>(chart.uv[v][0]), static_cast<float>(chart.uv[v][1])});
      mesh.vertex.push_back(static_cast<std::uint32_t>(chart.vertex[v]));
      mesh.chart.push_back(chart.chart);
    }
    const auto first = static_cast<std::uint32_t>(chart.first_texture_vertex);
    for (const auto& [a, b, c] : chart.triangle) {
      mesh.triangle.push_back({first + a, first + b, first + c});
    }
  });
  return mesh;
}

/// Another numbering of everything, and other first corners.
TexturedMesh renumbered(const TexturedMesh& mesh, unsigned seed) {
  std::mt19937 random(seed);
  const auto order = [&](std::size_t n) {
    std::vector<std::uint32_t> out(n);
    std::iota(out.begin(), out.end(), 0U);
    std::shuffle(out.begin(), out.end(), random);
    return out;
  };
  const auto vertex = order(mesh.position.size());
  const auto texture = order(mesh.uv.size());
  TexturedMesh out = mesh;
  for (std::size_t v = 0; v < vertex.size(); ++v) {
    out.position[vertex[v]] = mesh.position[v];
    if (!mesh.colour.empty()) {
      out.colour[vertex[v]] = mesh.colour[v];
    }
  }
  for (std::size_t t = 0; t < texture.size(); ++t) {
    out.uv[texture[t]] = mesh.uv[t];
    out.vertex[texture[t]] = vertex[mesh.vertex[t]];
    out.chart[texture[t]] = mesh.chart[t];
  }
  for (auto& triangle : out.triangle) {
    for (std::uint32_t& c : triangle) {
      c = texture[c];
    }
    std::rotate(triangle.begin(), triangle.begin() + random() % 3, triangle.end());
  }
  std::shuffle(out.triangle.begin(), out.triangle.end(), random);
  return out;
}

TEST(TexturedMesh, IsTheSameHoweverNumbered) {
  for (const auto& [name, polygons] : testing::polygon_meshes()) {
    SCOPED_TRACE(name);
    for (unsigned seed = 0; seed < 4; ++seed) {
      const TexturedMesh mesh = textured(polygons, seed % 2 == 0);
      EXPECT_EQ(difference_of(mesh, renumbered(mesh, seed)), "");
    }
  }
}

/// All in one place, so that only connections tell triangles apart.
TEST(TexturedMesh, IsTheSameEvenIfAllIsAlike) {
  for (const auto& [name, polygons] : testing::polygon_meshes()) {
    SCOPED_TRACE(name);
    TexturedMesh mesh = textured(polygons, false);
    mesh.position.assign(mesh.position.size(), {1.0F, 2.0F, 3.0F});
    EXPECT_EQ(difference_of(mesh, renumbered(mesh, 7)), "");
    TexturedMesh torn = renumbered(mesh, 8);
    torn.vertex[torn.triangle[0][0]] = torn.vertex[torn.triangle[1][1]];
    EXPECT_NE(difference_of(mesh, torn), "");
  }
}

TEST(TexturedMesh, DiffersByAnything) {
  const TexturedMesh mesh = textured(testing::polygon_torus(6, 5, 4), true);
  const auto differs = [&](const auto& change) {
    TexturedMesh other = renumbered(mesh, 3);
    change(other);
    EXPECT_NE(difference_of(mesh, other), "");
    EXPECT_NE(difference_of(other, mesh), "");
  };
  differs([](TexturedMesh& m) { m.position[5][1] += 1e-5F; });
  differs([](TexturedMesh& m) { m.uv[5][0] += 1e-5F; });
  differs([](TexturedMesh& m) { m.chart[5] ^= 1U; });
  differs([](TexturedMesh& m) { m.colour[5][2] ^= 1U; });
  differs([](TexturedMesh& m) { std::swap(m.triangle[9][0], m.triangle[9][1]); });
  differs([](TexturedMesh& m) { m.triangle[9] = m.triangle[8]; });
  differs([](TexturedMesh& m) { m.triangle.pop_back(); });
  // A vertex apart from itself, in the same place.
  differs([](TexturedMesh& m) {
    m.position.push_back(m.position[m.vertex[4]]);
    m.colour.push_back(m.colour[m.vertex[4]]);
    m.vertex[4] = static_cast<std::uint32_t>(m.position.size() - 1);
  });
}

/// Two vertices in one place, as repair leaves them, must not swap their fans.
TEST(TexturedMesh, DiffersByWhichFanHoldsAVertex) {
  TexturedMesh mesh = textured(testing::polygon_grid(4, 4), false);
  const TexturedMesh twin = mesh;
  const auto vertices = static_cast<std::uint32_t>(mesh.position.size());
  const auto points = static_cast<std::uint32_t>(mesh.uv.size());
  mesh.position.insert(mesh.position.end(), twin.position.begin(), twin.position.end());
  mesh.uv.insert(mesh.uv.end(), twin.uv.begin(), twin.uv.end());
  mesh.chart.insert(mesh.chart.end(), twin.chart.begin(), twin.chart.end());
  for (const std::uint32_t v : twin.vertex) {
    mesh.vertex.push_back(v + vertices);
  }
  for (const auto& [a, b, c] : twin.triangle) {
    mesh.triangle.push_back({a + points, b + points, c + points});
  }
  EXPECT_EQ(difference_of(mesh, renumbered(mesh, 1)), "");
  TexturedMesh swapped = mesh;
  const std::uint32_t corner = 5 * 16;  // the first of chart 5, which four charts share
  for (std::size_t t = 0; t < mesh.vertex.size(); ++t) {
    // At one vertex, one chart of either copy goes to the other copy.
    if (mesh.chart[t] == mesh.chart[corner] && mesh.vertex[t] % vertices == mesh.vertex[corner]) {
      swapped.vertex[t] = (mesh.vertex[t] + vertices) % (2 * vertices);
    }
  }
  EXPECT_NE(difference_of(mesh, renumbered(swapped, 2)), "");
}

}  // namespace
}  // namespace rattan
