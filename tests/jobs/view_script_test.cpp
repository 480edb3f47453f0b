// SPDX-License-Identifier: MIT
// Scripts decoded the way a page does it are the mesh they were made from.

#include "jobs/view_script.h"

#include <algorithm>
#include <array>
#include <map>

#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/io/test_meshes.h"

namespace rattan {
namespace {

using testing::cube;
using testing::torus;

struct Decoded {
  nlohmann::json head;
  std::vector<Vec3d> positions;
  std::vector<std::vector<std::uint32_t>> faces;
};

Decoded decode(const std::string& script) {
  Decoded out;
  EXPECT_EQ(script.rfind("rattan_view(", 0), 0U);
  EXPECT_EQ(script.substr(script.size() - 3), ");\n");
  out.head = nlohmann::json::parse(script.substr(12, script.size() - 15));
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::vector<std::uint8_t> bytes;
  std::uint32_t word = 0;
  int bits = 0;
  for (const char c : out.head["data"].get<std::string>()) {
    if (c == '=') {
      break;
    }
    word = word << 6 | static_cast<std::uint32_t>(digits.find(c));
    bits += 6;
    if (bits >= 8) {
      bits -= 8;
      bytes.push_back(static_cast<std::uint8_t>(word >> bits & 255U));
    }
  }
  std::size_t at = 0;
  const auto get = [&] {
    std::uint32_t value = 0;
    for (int shift = 0;; shift += 7) {
      const std::uint8_t b = bytes.at(at++);
      value |= static_cast<std::uint32_t>(b & 127U) << shift;
      if (b < 128) {
        return value;
      }
    }
  };
  std::vector<std::array<int, 3>> steps;
  std::array<int, 3> last{};
  for (const auto& group : out.head["groups"]) {
    const std::size_t n = group[0];
    for (std::size_t f = 0; f < group[1]; ++f) {
      std::vector<std::uint32_t> face;
      for (std::size_t k = 0; k < n; ++k) {
        const std::uint32_t code = get();
        if (code == 0) {
          std::array<int, 3> is = last;
          if (n == 4 && k == 3) {
            for (std::size_t i = 0; i < 3; ++i) {
              is[i] = steps[face[0]][i] + steps[face[2]][i] - steps[face[1]][i];
            }
          }
          for (std::size_t i = 0; i < 3; ++i) {
            const std::uint32_t d = get();
            is[i] += (d & 1U) != 0 ? -static_cast<int>(d / 2) - 1 : static_cast<int>(d / 2);
          }
          face.push_back(static_cast<std::uint32_t>(steps.size()));
          steps.push_back(is);
        } else {
          face.push_back(static_cast<std::uint32_t>(steps.size()) - code);
        }
        last = steps.at(face.back());
      }
      out.faces.push_back(face);
    }
  }
  EXPECT_EQ(at, bytes.size());
  EXPECT_EQ(out.head["vertices"], steps.size());
  const double scale = out.head["scale"];
  for (const auto& s : steps) {
    out.positions.emplace_back(s[0] * scale, s[1] * scale, s[2] * scale);
  }
  return out;
}

Vec3d middle_of(const PolygonMesh& mesh) {
  Vec3d low = mesh.positions[0];
  Vec3d high = low;
  for (const Vec3d& p : mesh.positions) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return 0.5 * (low + high);
}

void expect_same(const PolygonMesh& mesh, const Decoded& decoded) {
  ASSERT_EQ(decoded.faces.size(), mesh.face_count());
  EXPECT_EQ(decoded.positions.size(), mesh.vertex_count());
  std::vector<std::size_t> order;
  for (const std::size_t degree : {4, 3, 5, 6, 7, 8}) {
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
      if (mesh.degree(f) == degree) {
        order.push_back(f);
      }
    }
  }
  const Vec3d middle = middle_of(mesh);
  const double tolerance = 1.01 * decoded.head["scale"].get<double>();
  std::map<std::uint32_t, std::uint32_t> vertex;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const auto face = mesh.face(order[i]);
    ASSERT_EQ(decoded.faces[i].size(), face.size());
    // The same cycle, begun anywhere.
    bool any = false;
    for (std::size_t turn = 0; turn < face.size() && !any; ++turn) {
      bool all = true;
      for (std::size_t k = 0; k < face.size(); ++k) {
        const Vec3d p = mesh.positions[face[(k + turn) % face.size()]] - middle;
        all = all && (decoded.positions[decoded.faces[i][k]] - p).cwiseAbs().maxCoeff() < tolerance;
      }
      for (std::size_t k = 0; all && k < face.size(); ++k) {
        const auto [at, fresh] =
            vertex.emplace(decoded.faces[i][k], face[(k + turn) % face.size()]);
        EXPECT_EQ(at->second, face[(k + turn) % face.size()]);
      }
      any = all;
    }
    EXPECT_TRUE(any) << "face " << order[i];
  }
}

TEST(ViewScript, HoldsTheMesh) {
  for (const testing::NamedMesh& named : testing::all_meshes()) {
    SCOPED_TRACE(named.name);
    bool small = true;
    for (std::size_t f = 0; f < named.mesh.face_count(); ++f) {
      small = small && named.mesh.degree(f) <= 8;
    }
    if (small && named.mesh.face_count() > 0) {
      const Decoded decoded = decode(view_script(named.mesh, "m.drc"));
      EXPECT_EQ(decoded.head["faces"], named.mesh.face_count());
      expect_same(named.mesh, decoded);
    }
  }
}

TEST(ViewScript, IsCompact) {
  const PolygonMesh mesh = torus(100, 50, 9);
  EXPECT_LT(view_script(mesh, "m.drc").size(), 16 * mesh.face_count());
}

TEST(ViewScript, EscapesNames) {
  const std::string name = "a\"b</script>\n\xff\xe2\x80\xa8.drc";
  const std::string script = view_script(cube(), name);
  EXPECT_TRUE(
      std::all_of(script.begin(), script.end() - 1, [](char c) { return c >= ' ' && c <= '~'; }));
  EXPECT_EQ(decode(script).head["name"], "a\"b</script>\n\xef\xbf\xbd\xe2\x80\xa8.drc");
}

TEST(ViewScript, LooksFromARightHandedFrame) {
  const auto view = decode(view_script(torus(20, 10), "t")).head["view"];
  const auto row = [&](std::size_t k) { return Vec3d(view[k][0], view[k][1], view[k][2]); };
  EXPECT_LT((row(0).cross(row(1)) - row(2)).norm(), 1e-4);
  EXPECT_NEAR(row(0).norm(), 1.0, 1e-4);
}

TEST(ViewScript, ReducesLargeMeshesAndKeepsTheirShape) {
  const PolygonMesh mesh = torus(300, 150, 11);
  const Decoded decoded = decode(view_script(mesh, "t", {.most_faces = 4000}));
  EXPECT_EQ(decoded.head["faces"], mesh.face_count());
  EXPECT_LE(decoded.faces.size(), 4000U);
  EXPECT_GT(decoded.faces.size(), 1500U);
  // The area and the box of what it was, up to the corners cut.
  const auto area = [](const auto& positions, const auto& face) {
    Vec3d sum = Vec3d::Zero();
    for (std::size_t k = 1; k + 1 < face.size(); ++k) {
      sum += (positions[face[k]] - positions[face[0]])
                 .cross(positions[face[k + 1]] - positions[face[0]]);
    }
    return Vec3d(0.5 * sum);
  };
  double before = 0.0;
  double after = 0.0;
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    before += area(mesh.positions, mesh.face(f)).norm();
  }
  Vec3d low = Vec3d::Constant(1e30);
  Vec3d high = -low;
  for (const auto& face : decoded.faces) {
    const Vec3d a = area(decoded.positions, face);
    after += a.norm();
    for (const std::uint32_t v : face) {
      low = low.cwiseMin(decoded.positions[v]);
      high = high.cwiseMax(decoded.positions[v]);
    }
  }
  EXPECT_NEAR(after / before, 1.0, 0.04);
  // One normal a vertex.
  EXPECT_EQ(decoded.head["normals"].get<std::string>().size(),
            (2 * decoded.positions.size() + 2) / 3 * 4);
  EXPECT_FALSE(decode(view_script(cube(), "c")).head.contains("normals"));
  const Vec3d middle = middle_of(mesh);
  Vec3d extent = Vec3d::Zero();
  for (const Vec3d& p : mesh.positions) {
    extent = extent.cwiseMax(p - middle);
  }
  EXPECT_LT((0.5 * (high - low) - extent).norm(), 0.05 * extent.norm());
  EXPECT_EQ(view_script(mesh, "t", {.most_faces = 4000}),
            view_script(mesh, "t", {.most_faces = 4000}));
}

}  // namespace
}  // namespace rattan
