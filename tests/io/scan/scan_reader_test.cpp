// SPDX-License-Identifier: MIT
#include "io/scan/scan_reader.h"

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include "engine/core/errors.h"
#include "tests/io/scan/scan_files.h"

namespace rattan {
namespace {

using ::testing::AllOf;
using testing::CollectedScan;
using ::testing::HasSubstr;
using testing::TemporaryFile;

// What reading the bytes complains about.
std::string complaint(const std::string& name, const std::string& bytes) {
  const TemporaryFile file(name);
  try {
    testing::read_bytes(file, bytes);
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr(file.path()));
    return error.what();
  }
  return "nothing";
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

const std::string kPlyHead =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float "
    "z\nelement face 1\nproperty list uchar int vertex_index\nend_header\n";
const std::string kPlyBody = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

struct Variant {
  std::string name;
  std::string bytes;
};

std::vector<Variant> variants() {
  using namespace testing;
  return {
      {"a.ply", ascii_ply()},
      {"crlf.ply", ascii_ply("\r\n")},
      {"little.ply", plain_binary_ply(false)},
      {"big.ply", plain_binary_ply(true)},
      {"crlf_little.ply", replaced(replaced(plain_binary_ply(false), "ply\n", "ply\r\n"),
                                   "end_header\n", "end_header\r\n")},
      {"rich_float.ply", rich_binary_ply<float, std::uint32_t>(false, "float", "uint")},
      {"rich_double.ply", rich_binary_ply<double, std::int16_t>(true, "float64", "int16")},
      {"rich_float_big.ply", rich_binary_ply<float, std::uint8_t>(true, "float32", "uchar")},
      {"rich_double_64.ply", rich_binary_ply<double, std::uint64_t>(false, "double", "uint64")},
      {"a.obj", obj()},
      {"crlf.obj", obj("\r\n")},
      {"a.off", off()},
      {"same_line.off", replaced(off(), "OFF # a test\n# counts\n5 5 0", "OFF 5 5 0")},
      {"no_edges.off", replaced(off(), "5 5 0", "5 5")},
      {"colours.off", replaced(off(), "OFF", "COFF")},
      {"normals.off", replaced(off(), "OFF", "NOFF")},
      {"all_prefixes.off", coloured_off()},
      {"coloured.ply", coloured_ply()},
      {"a.ply.gz", gzipped(ascii_ply())},
      {"a.obj.gz", gzipped(obj())},
      {"members.ply.gz", gzipped(ascii_ply().substr(0, 300)) + gzipped(ascii_ply().substr(300))},
      {"padded.ply.gz", gzipped(ascii_ply()) + std::string(1000, '\0')},
      {"a.ply.zst", zstd_compressed(rich_binary_ply<float, std::uint32_t>(true, "float", "uint"))},
      {"frames.off.zst", zstd_compressed(off().substr(0, 50)) + zstd_compressed(off().substr(50))},
      {"skippable.off.zst",
       std::string("\x50\x2a\x4d\x18\x02\0\0\0ab", 10) + zstd_compressed(off())},
      {"no_extension_gz", gzipped(off())},
      {"headless.off", replaced(off(), "OFF # a test\n", "")},
      {"mark.obj", std::string("\xef\xbb\xbf") + obj()},
      {"no_extension_obj", obj()},
      {"no_extension_ply", ascii_ply()},
      {"wrong_extension.obj", plain_binary_ply(false)}};
}

TEST(ScanReader, ReadsEveryVariantAlike) {
  for (const Variant& v : variants()) {
    SCOPED_TRACE(v.name);
    const TemporaryFile file(v.name);
    ScanFileInfo info;
    EXPECT_EQ(testing::read_bytes(file, v.bytes, {}, &info), testing::pyramid());
    EXPECT_EQ(info.vertices, 5U);
    EXPECT_EQ(info.triangles, 6U);
    EXPECT_EQ(info.polygons, 1U);
    EXPECT_EQ(info.small_faces, 0U);
    EXPECT_EQ(info.bytes, v.bytes.size());
    EXPECT_EQ(info.bytes_read, v.bytes.size());
    EXPECT_TRUE(info.sha256.empty());
  }
}

TEST(ScanReader, DoesNotDependOnTheBuffer) {
  for (const Variant& v : variants()) {
    SCOPED_TRACE(v.name);
    const TemporaryFile file(v.name);
    std::string hash;
    for (std::size_t bytes = 1; bytes < 40; ++bytes) {
      ScanFileInfo info;
      info.want_sha256 = true;
      EXPECT_EQ(testing::read_bytes(file, v.bytes, {bytes, bytes % 4}, &info), testing::pyramid());
      EXPECT_TRUE(hash.empty() || info.sha256 == hash);
      hash = info.sha256;
      EXPECT_EQ(hash.size(), 64U);
    }
  }
}

TEST(ScanReader, HashesTheWholeFile) {
  const TemporaryFile file("hash.obj");
  ScanFileInfo info;
  info.want_sha256 = true;
  testing::read_bytes(file, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", {}, &info);
  EXPECT_EQ(info.sha256, "697b00ab13410c52a542d2e9c63711fcc04e9cbf6c0d3439a9b43cc812e6e713");
}

TEST(ScanReader, HashesOnASingleThread) {
  const oneapi::tbb::global_control one(oneapi::tbb::global_control::max_allowed_parallelism, 1);
  const TemporaryFile file("hash.obj");
  ScanFileInfo info;
  info.want_sha256 = true;
  testing::read_bytes(file, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", {4, 1}, &info);
  EXPECT_EQ(info.sha256, "697b00ab13410c52a542d2e9c63711fcc04e9cbf6c0d3439a9b43cc812e6e713");
}

TEST(ScanReader, ParsesNumbersExactly) {
  const TemporaryFile file("numbers.obj");
  const std::vector<std::string> words = {"0",
                                          "-0",
                                          "+1.5",
                                          ".5",
                                          "5.",
                                          "1e3",
                                          "-2.5E-3",
                                          "0.1",
                                          "123456789",
                                          "1e400",
                                          "1e-400",
                                          "nan",
                                          "-inf",
                                          "3.14159265358979323846",
                                          "1e22",
                                          "1e23",
                                          "0.30000000000000004",
                                          "9007199254740993",
                                          "4503599627370496.5",
                                          "1234567.891",
                                          "0.000000000000000000000000123",
                                          "-179.99999999999997"};
  std::string text;
  for (const std::string& w : words) {
    text += "v " + w + " " + w + " 0\n";
  }
  const CollectedScan scan = testing::read_bytes(file, text + "f 1 2 3\n");
  ASSERT_EQ(scan.vertices.size(), words.size());
  for (std::size_t k = 0; k < words.size(); ++k) {
    const double expected = std::strtod(words[k].c_str(), nullptr);
    const double got = scan.vertices[k].x();
    EXPECT_TRUE(got == expected || (std::isnan(got) && std::isnan(expected))) << words[k];
    EXPECT_EQ(std::signbit(got), std::signbit(expected)) << words[k];
  }
}

TEST(ScanReader, ReadsTriangleStrips) {
  const TemporaryFile file("strips.ply");
  const CollectedScan scan = testing::read_bytes(
      file,
      "ply\nformat ascii 1.0\nelement vertex 6\nproperty int x\nproperty int y\nproperty int z\n"
      "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
      "0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n1 2 0\n8 0 1 2 3 -1 3 5 4\n");
  EXPECT_EQ(scan.triangles,
            (std::vector<std::array<std::uint64_t, 3>>{{0, 1, 2}, {2, 1, 3}, {3, 5, 4}}));
}

TEST(ScanReader, TakesFacesBeforeTheirVertices) {
  const TemporaryFile file("order");
  const CollectedScan from_obj =
      testing::read_bytes(file, "o early\nf 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n");
  const CollectedScan from_ply = testing::read_bytes(
      file,
      "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_index\nelement vertex "
      "3\nproperty float x\nproperty float y\nproperty float z\nend_header\n3 0 1 2\n" +
          std::string("0 0 0\n1 0 0\n0 1 0\n"));
  EXPECT_EQ(from_obj, from_ply);
}

TEST(ScanReader, GivesVerticesBeforeTheTrianglesThatUseThem) {
  struct OrderSink final : ScanSink {
    std::uint64_t vertices = 0;
    void add_vertices(std::span<const Vec3d> positions) override { vertices += positions.size(); }
    void add_triangles(std::span<const std::array<std::uint64_t, 3>> triangles) override {
      for (const auto& t : triangles) {
        EXPECT_LT(std::max({t[0], t[1], t[2]}), vertices);
      }
    }
  } sink;
  const TemporaryFile file("order.ply", testing::plain_binary_ply(false));
  read_scan(file.path(), sink, nullptr, {4096, 4});
  EXPECT_EQ(sink.vertices, 5U);
}

TEST(ScanReader, LetsTheSinkStopIt) {
  struct StoppingSink final : ScanSink {
    void add_vertices(std::span<const Vec3d>) override { throw Cancelled("stopped"); }
    void add_triangles(std::span<const std::array<std::uint64_t, 3>>) override {}
  } sink;
  const TemporaryFile file("stop.ply", testing::ascii_ply());
  ScanFileInfo info;
  info.want_sha256 = true;
  EXPECT_THROW(read_scan(file.path(), sink, &info, {16, 1}), Cancelled);
}

TEST(ScanReader, CountsFacesWithoutAnInside) {
  const TemporaryFile file("small.obj");
  ScanFileInfo info;
  testing::read_bytes(file, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\nf 1\nf 1 2 3\n", {}, &info);
  EXPECT_EQ(info.small_faces, 2U);
  EXPECT_EQ(info.triangles, 1U);
}

TEST(ScanReader, NamesWhatIsWrongWithAFile) {
  EXPECT_THAT(complaint("empty.ply", ""), HasSubstr("empty"));
  EXPECT_THAT(complaint("what.xyz", "1 2 3\n"), HasSubstr("PLY"));
  EXPECT_THAT(complaint("a.ply.gz", "\x1f\x8b\x08"), AllOf(HasSubstr("byte 3"), HasSubstr("cut")));
  EXPECT_THAT(complaint("a.ply.zst", "\x28\xb5\x2f\xfd"),
              AllOf(HasSubstr("byte 4"), HasSubstr("cut")));
  EXPECT_THAT(complaint("twice.gz", testing::gzipped(testing::gzipped(testing::obj()))),
              HasSubstr("twice"));
  EXPECT_THAT(complaint("a.obj", "PK\x03\x04"), HasSubstr("ZIP"));
  EXPECT_THAT(complaint("a.obj", "v 0 0 \x80\xff\n"), HasSubstr("\"??\""));
  EXPECT_THAT(complaint("a.obj", "v 0 0 \xc3\xa9\n"), HasSubstr("\"\xc3\xa9\""));
  CollectedScan sink;
  EXPECT_THROW(read_scan("/nonexistent/scan.ply", sink), InputError);
  EXPECT_THROW(read_scan(std::filesystem::temp_directory_path().string(), sink), InputError);
}

TEST(ScanReader, NamesWhatIsWrongWithAPly) {
  const auto ply = [](const std::string& from, const std::string& to) {
    return complaint("bad.ply", replaced(kPlyHead + kPlyBody, from, to));
  };
  EXPECT_EQ(complaint("good.ply", kPlyHead + kPlyBody), "nothing");
  EXPECT_THAT(ply("0 1 0", "0 1,5 0"), AllOf(HasSubstr("line 12"), HasSubstr("1,5")));
  EXPECT_THAT(ply("0 1 0", "0 1"), HasSubstr("line 12"));
  EXPECT_THAT(ply("3 0 1 2", "3 0 1 3"), AllOf(HasSubstr("line 13"), HasSubstr("vertex 3")));
  EXPECT_THAT(ply("3 0 1 2", "3 0 1 -1"), AllOf(HasSubstr("line 13"), HasSubstr("vertex -1")));
  EXPECT_THAT(ply("3 0 1 2", "-3 0 1 2"), AllOf(HasSubstr("line 13"), HasSubstr("length -3")));
  EXPECT_THAT(ply("3 0 1 2", "4 0 1 2"), HasSubstr("line ends"));
  EXPECT_THAT(ply("3 0 1 2\n", ""), HasSubstr("ends before face 0"));
  EXPECT_THAT(ply("vertex 3", "vertex -3"), HasSubstr("line 3"));
  EXPECT_THAT(ply("vertex 3", "vertex 99999999999999999999"), HasSubstr("line 3"));
  EXPECT_THAT(ply("vertex 3", "vertex 0"), HasSubstr("no vertices"));
  EXPECT_THAT(ply("face 1", "face 0"), HasSubstr("point cloud"));
  EXPECT_THAT(ply("float y", "float w"), HasSubstr("coordinate y"));
  EXPECT_THAT(ply("float y", "quad y"), HasSubstr("quad"));
  EXPECT_THAT(ply("int vertex_index", "float vertex_index"), HasSubstr("vertex_indices"));
  EXPECT_THAT(ply("ascii", "morse"), HasSubstr("morse"));
  EXPECT_THAT(ply("format ascii 1.0\n", ""), HasSubstr("format"));
  EXPECT_THAT(ply("end_header\n", ""), HasSubstr("line 9"));
  EXPECT_THAT(ply("element face", "element vertex"), HasSubstr("twice"));
  EXPECT_THAT(ply("3 0 1 2", "2 0 1"), HasSubstr("no triangles"));

  std::string binary = testing::plain_binary_ply(false);
  EXPECT_THAT(complaint("cut.ply", binary.substr(0, binary.size() - 1)),
              HasSubstr("byte " + std::to_string(binary.size() - 1)));
  const std::size_t last = binary.size() - 4;
  binary[last] = 5;
  EXPECT_THAT(complaint("index.ply", binary),
              AllOf(HasSubstr("byte " + std::to_string(last)), HasSubstr("vertex 5")));
  binary[last + 3] = '\xff';
  EXPECT_THAT(complaint("index.ply", binary), HasSubstr("vertex -"));
  EXPECT_THAT(complaint("count.ply", replaced(testing::plain_binary_ply(true), "vertex 5",
                                              "vertex 281474976710656")),
              HasSubstr("too early"));
}

TEST(ScanReader, NamesWhatIsWrongWithAnObj) {
  const std::string good = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  const auto changed = [&](const std::string& from, const std::string& to) {
    return complaint("bad.obj", replaced(good, from, to));
  };
  EXPECT_EQ(complaint("good.obj", good), "nothing");
  EXPECT_THAT(changed("v 1 0 0", "v 1 O 0"), AllOf(HasSubstr("line 2"), HasSubstr("\"O\"")));
  EXPECT_THAT(changed("v 1 0 0", "v 1 0"), AllOf(HasSubstr("line 2"), HasSubstr("fewer")));
  EXPECT_THAT(changed("1 2 3", "1 2 0"), AllOf(HasSubstr("line 4"), HasSubstr("vertex 0")));
  EXPECT_THAT(changed("1 2 3", "1 2 4"), AllOf(HasSubstr("line 4"), HasSubstr("vertex 4")));
  EXPECT_THAT(changed("1 2 3", "1 2 -4"), AllOf(HasSubstr("line 4"), HasSubstr("vertex -4")));
  EXPECT_THAT(changed("1 2 3", "1 2 -9223372036854775808"), HasSubstr("line 4"));
  EXPECT_THAT(changed("1 2 3", "1 2 x"), AllOf(HasSubstr("line 4"), HasSubstr("\"x\"")));
  EXPECT_THAT(changed("f 1 2 3", ""), HasSubstr("no triangles"));
  EXPECT_THAT(complaint("wire.obj", "v 0 0 0\nv 1 0 0\nl 1 2\n"), HasSubstr("wireframe"));
  EXPECT_THAT(complaint("none.obj", "# nothing\n"), HasSubstr("no vertices"));
}

TEST(ScanReader, ReadsStlAsTheSoupItIs) {
  using namespace testing;
  std::string uncounted = binary_stl("streamed");
  std::fill(uncounted.begin() + 80, uncounted.begin() + 84, '\0');
  // One facet a line, a loop of four corners, and what some programs add.
  const std::string quad =
      "solid\nfacet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 0\nvertex 1 1 0 vertex 0 1 0 "
      "endloop endfacet\ncolor 1 0 0\nendsolid\nsolid two\nendsolid two\n";
  const std::vector<Variant> files = {{"text.stl", ascii_stl()},
                                      {"crlf.stl", ascii_stl("\r\n")},
                                      {"capitals.stl", ascii_stl("\n", true)},
                                      {"text_without_a_name", ascii_stl()},
                                      {"binary.stl", binary_stl("made by a test")},
                                      {"solid.stl", binary_stl("solid but binary")},
                                      {"zeros.stl", binary_stl(std::string(80, '\0'))},
                                      {"uncounted.stl", uncounted},
                                      {"binary_without_a_name", binary_stl("anything")},
                                      {"trailing.stl", binary_stl("x") + "and more"},
                                      {"binary.stl.gz", gzipped(binary_stl("solid but binary"))},
                                      {"uncounted.stl.zst", zstd_compressed(uncounted)}};
  for (const Variant& v : files) {
    SCOPED_TRACE(v.name);
    const TemporaryFile file(v.name);
    for (const std::size_t buffer : {std::size_t{1}, std::size_t{1} << 20}) {
      ScanFileInfo info;
      EXPECT_EQ(read_bytes(file, v.bytes, {buffer, 3}, &info), pyramid_soup());
      EXPECT_EQ(info.triangles, 6U);
      EXPECT_FALSE(info.colours);
    }
  }
  ScanFileInfo info;
  const CollectedScan scan = read_bytes(TemporaryFile("quad.stl"), quad, {}, &info);
  EXPECT_EQ(scan.vertices.size(), 4U);
  EXPECT_EQ(scan.triangles.size(), 2U);
  EXPECT_EQ(info.polygons, 1U);
}

TEST(ScanReader, NamesWhatIsWrongWithAnStl) {
  const std::string text = testing::ascii_stl();
  const std::string binary = testing::binary_stl("solid but binary");
  EXPECT_THAT(complaint("a.stl", "solid x\n"), HasSubstr("endsolid"));
  EXPECT_THAT(complaint("a.stl", replaced(text, "vertex", "corner")),
              AllOf(HasSubstr("line 4"), HasSubstr("corner")));
  EXPECT_THAT(complaint("a.stl", replaced(text, "vertex 0", "vertex zero")),
              AllOf(HasSubstr("line 4"), HasSubstr("zero")));
  EXPECT_THAT(complaint("cut.stl", binary.substr(0, binary.size() - 1)),
              AllOf(HasSubstr("byte 383"), HasSubstr("5 of the 6")));
  EXPECT_THAT(complaint("cut.stl.gz", testing::gzipped(binary.substr(0, binary.size() - 1))),
              AllOf(HasSubstr("byte 383 of the decompressed"), HasSubstr("6 of 6")));
  EXPECT_THAT(complaint("head.stl", testing::binary_stl("x").substr(0, 50)), HasSubstr("84 bytes"));
}

// The encoder renumbers, so meshes are compared by the corners of their triangles.
std::vector<std::array<std::array<double, 3>, 3>> corners_of(const CollectedScan& scan) {
  std::vector<std::array<std::array<double, 3>, 3>> all;
  for (const auto& t : scan.triangles) {
    std::array<std::array<double, 3>, 3> corners{};
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3d& p = scan.vertices.at(t[k]);
      corners[k] = {p[0], p[1], p[2]};
    }
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    all.push_back(corners);
  }
  std::sort(all.begin(), all.end());
  return all;
}

TEST(ScanReader, ReadsDraco) {
  using namespace testing;
  for (const bool sequential : {false, true}) {
    for (const int speed : {0, 5, 10}) {
      for (const bool colours : {false, true}) {
        const std::string bytes =
            draco_file({.sequential = sequential, .speed = speed, .colours = colours});
        for (const std::string& packed : {bytes, gzipped(bytes)}) {
          ScanFileInfo info;
          const CollectedScan scan = read_bytes(TemporaryFile("a.drc"), packed, {}, &info);
          EXPECT_EQ(scan.vertices.size(), 5U);
          EXPECT_EQ(corners_of(scan), corners_of(pyramid()));
          ASSERT_EQ(scan.colours.size(), colours ? 5U : 0U);
          EXPECT_EQ(info.colours, colours);
          for (std::size_t v = 0; v < scan.colours.size(); ++v) {
            const auto& wanted = pyramid().vertices;
            const auto same = std::find(wanted.begin(), wanted.end(), scan.vertices[v]);
            ASSERT_NE(same, wanted.end());
            EXPECT_EQ(scan.colours[v],
                      test_colour(static_cast<std::size_t>(same - wanted.begin())));
          }
        }
      }
    }
  }
}

TEST(ScanReader, RefusesDracoFilesThatAskForTooMuch) {
  const std::string whole = testing::draco_file({});
  EXPECT_THAT(complaint("cut.drc", whole.substr(0, whole.size() / 2)), HasSubstr("Draco"));
  EXPECT_THAT(complaint("head.drc", "DRACO\x02\x02"), HasSubstr("header"));
  EXPECT_THAT(complaint("cloud.drc", std::string("DRACO\x02\x03\0\0\0\0", 11)),
              HasSubstr("point cloud"));
  const std::string huge("DRACO\x02\x02\x01\x01\0\0\0\xff\xff\xff\x7f\xff\xff\xff\x7f", 20);
  EXPECT_THAT(complaint("huge.drc", huge), HasSubstr("cannot be"));
  const TemporaryFile file("large.drc");
  EXPECT_THROW(testing::read_bytes(file, whole, {.memory_bytes = 300}), ResourceError);
  EXPECT_THROW(testing::read_bytes(file, whole, {.memory_bytes = 10}), ResourceError);
}

TEST(ScanReader, RefusesDracoPositionsThatAreNoNumbers) {
  // Bytes that are neither true nor false in place of three floats; how they stand in the file is:
  // positions, of type float, three components, not normalised.
  std::string bytes = testing::draco_file({.sequential = true});
  const std::size_t at = bytes.find(std::string("\x00\x09\x03\x00", 4));
  ASSERT_NE(at, std::string::npos);
  bytes[at + 1] = static_cast<char>(draco::DT_BOOL);
  EXPECT_THAT(complaint("bool.drc", bytes), HasSubstr("of a kind that cannot be read"));
}

TEST(ScanReader, DeliversColours) {
  using namespace testing;
  const auto colours = [](const std::string& name, const std::string& bytes) {
    const TemporaryFile file(name);
    const CollectedScan scan = read_bytes(file, bytes, {16, 2});
    EXPECT_EQ(scan.colours.size(), scan.vertices.size()) << name;
    return scan.colours;
  };
  std::vector<std::array<std::uint8_t, 4>> wanted;
  for (std::size_t v = 0; v < kPyramidVertices.size(); ++v) {
    wanted.push_back(test_colour(v));
  }
  EXPECT_EQ(colours("c.ply", coloured_ply()), wanted);
  EXPECT_EQ(colours("c.off", coloured_off()), wanted);
  const std::array<std::uint8_t, 4> shares{26, 51, 77, 255};
  EXPECT_EQ(colours("c.obj", obj()), (std::vector<std::array<std::uint8_t, 4>>(5, shares)));

  // Three vertices in every way to write one colour.
  const std::string face = "\n1 0 0 @\n0 1 0 @\n3 0 1 2\n";
  const auto ply = [&](const std::string& properties, const std::string& values) {
    std::string s = kPlyHead + "0 0 0 @" + face;
    s = replaced(s, "element face", properties + "element face");
    for (int k = 0; k < 3; ++k) {
      s = replaced(s, "@", values);
    }
    return colours("one.ply", s).front();
  };
  const auto rgb = [](const std::string& type, const std::string& prefix = "") {
    std::string s;
    for (const char* name : {"red", "green", "blue"}) {
      s += "property " + type + " " + prefix + name + "\n";
    }
    return s;
  };
  using Rgba8 = std::array<std::uint8_t, 4>;
  EXPECT_EQ(ply(rgb("uchar"), "1 0 128"), (Rgba8{1, 0, 128, 255}));
  EXPECT_EQ(ply(rgb("uchar", "diffuse_"), "1 0 1"), (Rgba8{1, 0, 1, 255}));
  EXPECT_EQ(ply(rgb("ushort"), "65535 257 128"), (Rgba8{255, 1, 0, 255}));
  EXPECT_EQ(ply(rgb("float"), "1 0.5 nan"), (Rgba8{255, 128, 0, 255}));
  EXPECT_EQ(ply(rgb("double") + "property double alpha\n", "0.2 -3 0 0.4"), (Rgba8{51, 0, 0, 102}));
  EXPECT_EQ(ply(rgb("float"), "255 128 0"), (Rgba8{255, 128, 0, 255}));

  const auto coff = [&](const std::string& values) {
    std::string s = "COFF\n3 1 0\n0 0 0 @" + face;
    for (int k = 0; k < 3; ++k) {
      s = replaced(s, "@", values);
    }
    return colours("one.off", s).front();
  };
  EXPECT_EQ(coff("1 0 1"), (Rgba8{1, 0, 1, 255}));
  EXPECT_EQ(coff("1.0 0 1"), (Rgba8{255, 0, 255, 255}));
  EXPECT_EQ(coff("1 0 1 1"), (Rgba8{255, 0, 255, 255}));
  EXPECT_EQ(coff("1 0 1 40"), (Rgba8{1, 0, 1, 40}));
  EXPECT_EQ(coff(""), (Rgba8{255, 255, 255, 255}));
  // Whether an OBJ has colours is settled by its first vertex.
  EXPECT_EQ(colours("mixed.obj", "v 0 0 0 0 0 1 0\nv 1 0 0\nv 0 1 0 9 8 7\nf 1 2 3\n"),
            (std::vector<Rgba8>{{0, 0, 255, 0}, {255, 255, 255, 255}, {9, 8, 7, 255}}));
  const TemporaryFile weights("weights.obj");
  EXPECT_TRUE(
      read_bytes(weights, "v 0 0 0 1\nv 1 0 0 1 1 1\nv 0 1 0 1\nf 1 2 3\n").colours.empty());
}

TEST(ScanReader, LetsSignedIndicesReachBeyondTwoToThe31) {
  // The face comes first, so it is read before the vertices turn out to be missing. The size of a
  // compressed file tells nothing about its content.
  std::string bytes =
      "ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list uchar int "
      "vertex_indices\nelement vertex 3000000000\nproperty float x\nproperty float y\nproperty "
      "float z\nend_header\n";
  testing::append(bytes, std::uint8_t{3});
  for (const std::uint32_t index : {0U, 1U, 2999999999U}) {
    testing::append(bytes, index);
  }
  EXPECT_THAT(complaint("beyond.ply.gz", testing::gzipped(bytes)),
              HasSubstr("inside element \"vertex\""));
  EXPECT_THAT(
      complaint("fewer.ply.gz", testing::gzipped(replaced(bytes, "3000000000", "2999999999"))),
      HasSubstr("vertex 2999999999 of 2999999999"));
  EXPECT_THAT(
      complaint("fewer.ply.gz", testing::gzipped(replaced(bytes, "3000000000", "2000000000"))),
      HasSubstr("vertex -1294967297 of 2000000000"));
  EXPECT_THAT(complaint("short.ply", bytes), HasSubstr("too early"));
}

TEST(ScanReader, TidiesPolygons) {
  const TemporaryFile file("polygons.obj");
  ScanFileInfo info;
  const std::string vertices = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 2 2\n";
  const CollectedScan scan = testing::read_bytes(
      file, vertices + "f 3 4 1 2\nf 1 2 3 3\nf 2 3 4 2\nf 1 1 2 2\n", {}, &info);
  EXPECT_EQ(scan.triangles, (std::vector<std::array<std::uint64_t, 3>>{
                                {0, 1, 2}, {1, 2, 3}, {0, 1, 2}, {0, 2, 3}}));
  EXPECT_EQ(info.polygons, 1U);
  EXPECT_EQ(info.small_faces, 1U);
  EXPECT_EQ(info.triangles, 4U);

  // One beyond what is gathered is cut as it comes.
  std::string large = vertices + "f";
  for (int k = 0; k < 10000; ++k) {
    large += k % 2 == 0 ? " 1" : " 2";
  }
  EXPECT_EQ(testing::read_bytes(file, large + "\n", {}, &info).triangles.size(), 9998U);
  EXPECT_EQ(info.polygons, 1U);
}

TEST(ScanReader, NamesWhatIsWrongWithAnOff) {
  const std::string good = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  const auto changed = [&](const std::string& from, const std::string& to) {
    return complaint("bad.off", replaced(good, from, to));
  };
  EXPECT_EQ(complaint("good.off", good), "nothing");
  EXPECT_THAT(changed("3 1 0", "x 1 0"), AllOf(HasSubstr("line 2"), HasSubstr("vertices")));
  EXPECT_THAT(changed("3 1 0", "3 -1 0"), AllOf(HasSubstr("line 2"), HasSubstr("faces")));
  EXPECT_THAT(changed("3 1 0", "3 2 0"), HasSubstr("ends before face 1"));
  EXPECT_THAT(changed("3 1 0", "3"), HasSubstr("faces"));
  EXPECT_THAT(changed("0 1 2", "0 1 3"), AllOf(HasSubstr("line 6"), HasSubstr("vertex 3")));
  EXPECT_THAT(changed("0 1 2", "0 1"), HasSubstr("fewer"));
  EXPECT_THAT(changed("1 0 0", "1 a 0"), AllOf(HasSubstr("line 4"), HasSubstr("\"a\"")));
  EXPECT_THAT(changed("OFF", "OFF BINARY"), HasSubstr("binary"));
  EXPECT_THAT(changed("OFF", "4OFF"), HasSubstr("three-dimensional"));
  EXPECT_THAT(complaint("short.off", "OFF\n"), HasSubstr("ends before"));
}

TEST(ScanReader, ReadsTheSampleScans) {
  const char* folder = std::getenv("RATTAN_DATA");
  if (folder == nullptr) {
    GTEST_SKIP() << "RATTAN_DATA is not set: the sample scans are not read";
  }
  const std::map<std::string, std::uint64_t> triangles = {
      {"bun_zipper.ply", 69451},  {"nefertiti.obj", 99938},  {"koala.obj", 99994},
      {"gargoyle.obj", 49980},    {"rocker-arm.obj", 20088}, {"fandisk.obj", 12946},
      {"fertility.off", 9000},    {"3holes.off", 7200},      {"demosthenes-low-res.obj", 16719},
      {"plane_holes.obj", 16747}, {"spot.obj", 5856},        {"bunny25k.obj", 24999}};
  for (const auto& [name, count] : triangles) {
    SCOPED_TRACE(name);
    CollectedScan scan;
    ScanFileInfo info;
    ASSERT_NO_THROW(read_scan((std::filesystem::path(folder) / name).string(), scan, &info));
    EXPECT_EQ(info.triangles, count);
    EXPECT_EQ(scan.triangles.size(), count);
    EXPECT_EQ(scan.vertices.size(), info.vertices);
  }
}

}  // namespace
}  // namespace rattan
