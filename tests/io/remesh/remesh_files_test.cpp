// SPDX-License-Identifier: MIT
// Remeshes through every format and back.

#include <csignal>
#include <cstdlib>
#include <fstream>
#include <sys/resource.h>
#include <tuple>

#include <gtest/gtest.h>

#include "engine/core/errors.h"
#include "io/file/atomic_file.h"
#include "io/remesh/draco_polygons.h"
#include "io/remesh/mesh_identity.h"
#include "io/remesh/remesh_reader.h"
#include "io/remesh/remesh_writer.h"
#include "tests/io/test_meshes.h"

namespace rattan {
namespace {

using testing::all_meshes;
using testing::NamedMesh;
using testing::ScratchDirectory;

RemeshMetadata some_metadata() {
  RemeshMetadata m;
  m.version = "9.8.7";
  m.options = "--faces 100";
  m.input_hash = "abcdef";
  return m;
}

int euler(const PolygonMesh& m) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (std::size_t f = 0; f < m.face_count(); ++f) {
    const auto face = m.face(f);
    for (std::size_t i = 0; i < face.size(); ++i) {
      edges.push_back(std::minmax({face[i], face[(i + 1) % face.size()]}));
    }
  }
  std::sort(edges.begin(), edges.end());
  const auto last = std::unique(edges.begin(), edges.end());
  return static_cast<int>(m.vertex_count()) - static_cast<int>(last - edges.begin()) +
         static_cast<int>(m.face_count());
}

PolygonMesh moved(PolygonMesh mesh, const Vec3d& by) {
  for (Vec3d& p : mesh.positions) {
    p += by;
  }
  return mesh;
}

class EveryFormat : public ::testing::TestWithParam<const char*> {};

TEST_P(EveryFormat, BringsEveryMeshBack) {
  const ScratchDirectory scratch;
  for (const NamedMesh& named : all_meshes()) {
    SCOPED_TRACE(named.name);
    const std::string path = scratch.file(named.name + std::string(GetParam()));
    WriteResult result;
    ASSERT_NO_THROW(result = write_remesh(named.mesh, some_metadata(), path));
    const PolygonMesh read = read_polygons(path);
    EXPECT_EQ(read.vertex_count(), named.mesh.vertex_count());
    EXPECT_EQ(read.face_count(), named.mesh.face_count());
    EXPECT_EQ(euler(read), euler(named.mesh));
    EXPECT_EQ(result.faces, named.mesh.face_count());
    EXPECT_EQ(result.bytes, std::filesystem::file_size(path));
    if (std::string(GetParam()) != ".drc") {
      EXPECT_EQ(difference_in_order(named.mesh, read), "");
      EXPECT_EQ(difference_as_meshes(named.mesh, read), "");
    }
  }
  EXPECT_EQ(scratch.names().size(), all_meshes().size());
}

TEST_P(EveryFormat, WritesTheSameBytesTwice) {
  const ScratchDirectory scratch;
  const std::string a = scratch.file(std::string("a") + GetParam());
  const std::string b = scratch.file(std::string("b") + GetParam());
  write_remesh(testing::torus(20, 14, 5), some_metadata(), a);
  write_remesh(testing::torus(20, 14, 5), some_metadata(), b);
  EXPECT_EQ(read_file(a), read_file(b));
}

TEST_P(EveryFormat, KeepsGeoreferencedPositions) {
  const ScratchDirectory scratch;
  const std::string path = scratch.file(std::string("geo") + GetParam());
  const PolygonMesh mesh = testing::wavy_grid(30, 20);
  RemeshMetadata metadata = some_metadata();
  metadata.origin = Vec3d(3.5e6 + 0.123456789, -5.1e6 + 0.3, 412.25);
  const WriteResult result = write_remesh(mesh, metadata, path);
  const PolygonMesh full = read_polygons_full(path);
  // Match by position: the grid's points are 0.1 apart.
  ASSERT_EQ(full.vertex_count(), mesh.vertex_count());
  double worst = 0.0;
  for (const Vec3d& p : mesh.positions) {
    double nearest = 1e9;
    for (const Vec3d& q : full.positions) {
      nearest = std::min(nearest, (q - p - metadata.origin).cwiseAbs().maxCoeff());
    }
    worst = std::max(worst, nearest);
  }
  EXPECT_LE(worst, std::max(2e-9, result.position_bound + 2e-9));
  EXPECT_LE(worst, 1e-4);
  if (std::string(GetParam()) == ".drc") {
    EXPECT_EQ(result.origin, metadata.origin);
    RemeshMetadata read;
    read_polygons(path, &read);
    EXPECT_EQ(read.origin, metadata.origin);
  } else {
    EXPECT_TRUE(result.origin.isZero(0.0));
    EXPECT_EQ(difference_in_order(moved(mesh, metadata.origin), full), "");
  }
}

TEST_P(EveryFormat, ReplacesAnOlderFile) {
  const ScratchDirectory scratch;
  const std::string path = scratch.file(std::string("old") + GetParam());
  std::ofstream(path) << "something older";
  write_remesh(testing::cube(), some_metadata(), path);
  EXPECT_EQ(read_polygons(path).face_count(), 6U);
  EXPECT_EQ(scratch.names().size(), 1U);
}

TEST_P(EveryFormat, LeavesNothingWhenTheFileComesBackDamaged) {
  const ScratchDirectory scratch;
  const std::string path = scratch.file(std::string("mesh") + GetParam());
  std::ofstream(path) << "the older file";
  WriteOptions options;
  // The temporary is swapped for a file of another mesh, whole but not what was meant.
  const std::string other = scratch.file(std::string("other") + GetParam());
  PolygonMesh torn = testing::torus(12, 8);
  torn.positions[5] += Vec3d(0.25, 0.0, 0.0);
  write_remesh(torn, some_metadata(), other);
  options.before_verify = [&](const std::string& temporary) {
    std::ofstream(temporary, std::ios::trunc | std::ios::binary) << read_file(other);
  };
  EXPECT_THROW(write_remesh(testing::torus(12, 8), some_metadata(), path, options), InternalError);
  std::filesystem::remove(other);
  EXPECT_EQ(scratch.names().size(), 1U);
  EXPECT_EQ(read_file(path), "the older file");
}

TEST_P(EveryFormat, EveryTruncatedFileIsRefusedOrDiffers) {
  const ScratchDirectory scratch;
  const std::string path = scratch.file(std::string("whole") + GetParam());
  const PolygonMesh mesh = testing::prism(7);
  write_remesh(mesh, some_metadata(), path);
  const std::string bytes = read_file(path);
  const PolygonMesh whole = read_polygons(path);
  const std::string cut = scratch.file(std::string("cut") + GetParam());
  for (std::size_t size = 0; size + 3 < bytes.size(); ++size) {
    std::ofstream(cut, std::ios::trunc | std::ios::binary) << bytes.substr(0, size);
    try {
      EXPECT_NE(difference_as_meshes(whole, read_polygons(cut)), "") << size;
    } catch (const InputError& e) {
      EXPECT_NE(std::string(e.what()).find(cut), std::string::npos);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Io, EveryFormat, ::testing::Values(".drc", ".obj", ".ply", ".off"),
                         [](const auto& format) { return std::string(format.param + 1); });

TEST(RemeshWriter, RefusesUnwritableDirectories) {
  const ScratchDirectory scratch;
  for (const std::string& path : {scratch.file("missing/out.drc"), std::string("/proc/out.drc"),
                                  std::string("/proc/out.obj")}) {
    try {
      write_remesh(testing::cube(), {}, path);
      ADD_FAILURE() << path;
    } catch (const InputError& e) {
      EXPECT_NE(std::string(e.what()).find(path), std::string::npos);
      EXPECT_NE(std::string(e.what()).find("Give a directory"), std::string::npos);
    }
  }
  EXPECT_TRUE(scratch.names().empty());
}

TEST(RemeshWriter, AFullDiskLeavesNothing) {
  const ScratchDirectory scratch;
  const std::string path = scratch.file("big.obj");
  std::ofstream(path) << "older";
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  rlimit low = before;
  low.rlim_cur = 4096;
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &low), 0);
  bool refused = false;
  std::string said;
  try {
    write_remesh(testing::wavy_grid(40, 40), {}, path);
  } catch (const ResourceError& e) {
    refused = true;
    said = e.what();
  }
  ::setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_TRUE(refused);
  EXPECT_NE(said.find("Make room"), std::string::npos);
  EXPECT_EQ(scratch.names().size(), 1U);
  EXPECT_EQ(read_file(path), "older");
}

TEST(RemeshWriter, RefusesOtherExtensionsAndBits) {
  const ScratchDirectory scratch;
  EXPECT_THROW(write_remesh(testing::cube(), {}, scratch.file("a.stl")), UsageError);
  WriteOptions options;
  options.position_bits = 31;
  EXPECT_THROW(write_remesh(testing::cube(), {}, scratch.file("a.drc"), options), UsageError);
  EXPECT_TRUE(scratch.names().empty());
}

TEST(RemeshWriter, RefusesBrokenMeshes) {
  const ScratchDirectory scratch;
  PolygonMesh repeats = testing::cube();
  repeats.corners[0] = repeats.corners[1];
  EXPECT_THROW(write_remesh(repeats, {}, scratch.file("a.obj")), InternalError);
  PolygonMesh infinite = testing::cube();
  infinite.positions[3][1] = std::numeric_limits<double>::infinity();
  EXPECT_THROW(write_remesh(infinite, {}, scratch.file("a.drc")), InternalError);
  // Three faces on an edge: Draco would tear it, which reading back must notice.
  PolygonMesh fin = testing::cube();
  fin.positions.emplace_back(2, 2, 2);
  testing::add(fin, {0, 1, 8});
  EXPECT_THROW(write_remesh(fin, {}, scratch.file("a.drc")), InternalError);
  EXPECT_NO_THROW(write_remesh(fin, {}, scratch.file("a.obj")));
  EXPECT_EQ(scratch.names().size(), 1U);
}

TEST(RemeshWriter, LeavesOutVerticesWithoutFaces) {
  const ScratchDirectory scratch;
  PolygonMesh mesh = testing::cube();
  mesh.positions.insert(mesh.positions.begin() + 4, Vec3d(7, 7, 7));
  for (std::uint32_t& v : mesh.corners) {
    v += v >= 4 ? 1 : 0;
  }
  for (const char* name : {"a.drc", "a.obj", "a.ply", "a.off"}) {
    EXPECT_EQ(write_remesh(mesh, {}, scratch.file(name)).vertices, 8U);
    EXPECT_EQ(read_polygons(scratch.file(name)).vertex_count(), 8U);
  }
}

TEST(Draco, KeepsMetadataAndFullCoordinatesWhereFloatsCan) {
  const ScratchDirectory scratch;
  const std::string path = scratch.file("m.drc");
  RemeshMetadata metadata = some_metadata();
  metadata.origin = Vec3d(1.0, 2.0, 3.0);
  metadata.options = std::string(1000, 'x');
  const WriteResult result = write_remesh(testing::torus(20, 10), metadata, path);
  EXPECT_TRUE(result.origin.isZero(0.0));
  RemeshMetadata read;
  const PolygonMesh mesh = read_polygons(path, &read);
  EXPECT_EQ(read.version, "9.8.7");
  EXPECT_EQ(read.options, metadata.options);
  EXPECT_EQ(read.input_hash, "abcdef");
  EXPECT_TRUE(read.origin.isZero(0.0));
  Vec3d mean = Vec3d::Zero();
  for (const Vec3d& p : mesh.positions) {
    mean += p / static_cast<double>(mesh.vertex_count());
  }
  EXPECT_LT((mean - metadata.origin).norm(), 1e-3);
}

TEST(Draco, MeetsTheAccuracyAsked) {
  const PolygonMesh mesh = testing::torus(60, 30);
  for (const double accuracy : {1e-2, 1e-3, 1e-4, 1e-5}) {
    DracoOptions options;
    options.accuracy = accuracy;
    const DracoEncoding e = encode_draco(mesh, {}, options);
    EXPECT_LE(e.step, accuracy * 1.001);
    EXPECT_TRUE(e.step > accuracy * 0.45 || e.position_bits == kLeastPositionBits);
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
      EXPECT_LE((e.expected.positions[v] + e.origin - mesh.positions[v]).cwiseAbs().maxCoeff(),
                0.51 * accuracy + 3e-7);
    }
  }
}

TEST(Draco, EveryNumberOfBitsAndSpeedComesBack) {
  const ScratchDirectory scratch;
  for (int bits = kLeastPositionBits; bits <= kMostPositionBits; ++bits) {
    WriteOptions options;
    options.position_bits = bits;
    options.draco_speed = bits % 6;
    // At 11 bits many of these vertices land on each other's grid points.
    EXPECT_NO_THROW(write_remesh(testing::torus(90, 70, 3), {}, scratch.file("m.drc"), options))
        << bits;
  }
}

TEST(Draco, VerticesThatFallTogetherStayApart) {
  const ScratchDirectory scratch;
  PolygonMesh mesh = testing::wavy_grid(40, 40);
  for (Vec3d& p : mesh.positions) {
    p *= 1e-5;
  }
  mesh = testing::join(mesh, moved(testing::cube(), Vec3d(5, 5, 5)));
  WriteOptions options;
  options.position_bits = kLeastPositionBits;
  write_remesh(mesh, {}, scratch.file("m.drc"), options);
  const PolygonMesh read = read_polygons(scratch.file("m.drc"));
  EXPECT_EQ(read.vertex_count(), mesh.vertex_count());
  EXPECT_EQ(euler(read), euler(mesh));
}

/// What the stock decoder makes of each mesh, compared corner by corner with our decoding.
TEST(Draco, TheStockDecoderReturnsThePolygons) {
  if (std::system("command -v draco_decoder >/dev/null 2>&1") != 0) {
    GTEST_SKIP() << "draco_decoder (package draco) is not installed: the check against the stock "
                    "decoder did NOT run";
  }
  const ScratchDirectory scratch;
  std::vector<NamedMesh> meshes = all_meshes();
  meshes.push_back({"large", testing::torus(150, 90, 11)});
  meshes.push_back({"quads", testing::merged(testing::torus(60, 40, 1), 0.5, 4, 1)});
  meshes.push_back({"polygons", testing::merged(testing::torus(60, 40, 1), 0.7, 9, 2)});
  for (const NamedMesh& named : meshes) {
    SCOPED_TRACE(named.name);
    const std::string drc = scratch.file("m.drc");
    const std::string obj = scratch.file("m.obj");
    write_remesh(named.mesh, some_metadata(), drc);
    ASSERT_EQ(std::system(("draco_decoder -i " + drc + " -o " + obj + " >/dev/null").c_str()), 0);
    const PolygonMesh ours = read_polygons(drc);
    PolygonMesh stock = read_polygons(obj);
    ASSERT_EQ(stock.vertex_count(), ours.vertex_count());
    ASSERT_EQ(stock.face_count(), named.mesh.face_count());
    for (std::size_t v = 0; v < ours.vertex_count(); ++v) {
      // The stock OBJ has six decimals.
      EXPECT_LT((stock.positions[v] - ours.positions[v]).cwiseAbs().maxCoeff(), 1.1e-6);
    }
    stock.positions = ours.positions;
    EXPECT_EQ(difference_as_meshes(ours, stock), "");
    const auto faces = [](const PolygonMesh& m) {
      std::vector<std::vector<std::uint32_t>> out;
      for (std::size_t f = 0; f < m.face_count(); ++f) {
        out.emplace_back(m.face(f).begin(), m.face(f).end());
        std::rotate(out.back().begin(), std::min_element(out.back().begin(), out.back().end()),
                    out.back().end());
      }
      std::sort(out.begin(), out.end());
      return out;
    };
    EXPECT_EQ(faces(stock), faces(ours));
  }
}

TEST(Draco, ReadsWhatTheStockEncoderWrites) {
  if (std::system("command -v draco_encoder >/dev/null 2>&1") != 0) {
    GTEST_SKIP() << "draco_encoder (package draco) is not installed: NOT compared";
  }
  const ScratchDirectory scratch;
  const PolygonMesh mesh = testing::torus(30, 20, 9);
  const std::string obj = scratch.file("m.obj");
  const std::string drc = scratch.file("m.drc");
  write_remesh(mesh, {}, obj);
  for (const char* polygons : {"-preserve_polygons", ""}) {
    ASSERT_EQ(std::system(("draco_encoder -cl 7 " + std::string(polygons) + " -i " + obj + " -o " +
                           drc + " >/dev/null")
                              .c_str()),
              0);
    const PolygonMesh read = read_polygons(drc);
    EXPECT_EQ(read.vertex_count(), mesh.vertex_count());
    EXPECT_EQ(euler(read), 0);
    EXPECT_EQ(read.corners.size(), *polygons != 0
                                       ? mesh.corners.size()
                                       : 3 * (mesh.corners.size() - 2 * mesh.face_count()));
  }
}

TEST(PolygonReader, ReadsForeignText) {
  const ScratchDirectory scratch;
  const auto read = [&](const std::string& name, const std::string& text) {
    std::ofstream(scratch.file(name), std::ios::binary) << text;
    return read_polygons(scratch.file(name));
  };
  const PolygonMesh obj = read("a.obj",
                               "# comment\r\nmtllib x.mtl\nv 0 0 0 1\r\nv +1 0 0\nvt 0 0\nv 1 1 0\n"
                               "v 0 1e0 0\nvn 0 0 1\nf 1/1/1 2//1 3/1 \\\n 4 # end\nf -4 -2 -1");
  EXPECT_EQ(obj.corners, (std::vector<std::uint32_t>{0, 1, 2, 3, 0, 2, 3}));
  EXPECT_EQ(obj.positions[1], Vec3d(1, 0, 0));
  const PolygonMesh off =
      read("a.OFF",
           "COFF # colours\n4 1\n0 0 0 255 0 0 255\n1 0 0 1 1 1 1\n\n1 1 0\n0 1 0\n"
           "4 0 1 2 3 255 0 0\n");
  EXPECT_EQ(off.degree(0), 4U);
  const PolygonMesh ply =
      read("a.ply",
           "ply\nformat ascii 1.0\ncomment x\nelement vertex 3\nproperty uchar red\n"
           "property float x\nproperty float y\nproperty float z\nelement face 1\n"
           "property list uchar int vertex_index\nproperty float quality\n"
           "element edge 1\nproperty int a\nend_header\n9 0 0 0\n9 1 0 0\n9 0 1 0\n"
           "3 0 1 2 0.5\n7\n");
  EXPECT_EQ(ply.corners, (std::vector<std::uint32_t>{0, 1, 2}));
  EXPECT_EQ(ply.positions[2], Vec3d(0, 1, 0));
  std::string big =
      "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty short x\n"
      "property short y\nproperty short z\nelement face 1\n"
      "property list uchar ushort vertex_indices\nend_header\n";
  for (const char c : {0, 0, 0, 0, 0, 0, 1, 2, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 3, 0, 0, 0, 1, 0, 2}) {
    big.push_back(c);
  }
  EXPECT_EQ(read("b.ply", big).positions[1], Vec3d(258, 0, 0));
}

TEST(PolygonReader, SaysWhereTextIsWrong) {
  const ScratchDirectory scratch;
  const auto complaint = [&](const std::string& name, const std::string& text) -> std::string {
    std::ofstream(scratch.file(name), std::ios::binary) << text;
    try {
      read_polygons(scratch.file(name));
    } catch (const InputError& e) {
      return e.what();
    }
    return "nothing";
  };
  EXPECT_NE(complaint("a.obj", "v 0 0 0\nv 1 x 0\n").find("line 2"), std::string::npos);
  EXPECT_NE(complaint("a.obj", "v 0 0 0\nf 1 1\n").find("line 2"), std::string::npos);
  EXPECT_NE(complaint("a.obj", "v 0 0 0\nf 1 2 3\n").find("vertex 1 of 1"), std::string::npos);
  EXPECT_NE(complaint("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n").find("ends"), std::string::npos);
  EXPECT_NE(complaint("a.ply", "ply\nformat ascii 2\nfoo\n").find("line 3"), std::string::npos);
  EXPECT_NE(complaint("a.drc", "DRACO and then nothing").find("Draco"), std::string::npos);
  EXPECT_NE(complaint("none/a.drc", "").find("cannot be opened"), std::string::npos);
}

}  // namespace
}  // namespace rattan
