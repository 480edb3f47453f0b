// SPDX-License-Identifier: MIT
#pragma once

// Small scan files for the tests, and a sink that keeps what it gets.

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <unistd.h>
#include <utility>
#include <vector>
#include <zlib.h>
#include <zstd.h>

#include <draco/compression/expert_encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>

#include "engine/mesh/scan_sink.h"
#include "io/scan/scan_reader.h"

namespace rattan::testing {

struct CollectedScan final : ScanSink {
  std::vector<Vec3d> vertices;
  std::vector<std::array<std::uint8_t, 4>> colours;
  std::vector<std::array<std::uint64_t, 3>> triangles;

  void add_vertices(std::span<const Vec3d> positions) override {
    vertices.insert(vertices.end(), positions.begin(), positions.end());
  }
  void add_triangles(std::span<const std::array<std::uint64_t, 3>> t) override {
    triangles.insert(triangles.end(), t.begin(), t.end());
  }
  void add_colours(std::span<const std::array<std::uint8_t, 4>> c) override {
    colours.insert(colours.end(), c.begin(), c.end());
  }
  /// The same vertices in order, and the same triangles in any order.
  friend bool operator==(const CollectedScan& a, const CollectedScan& b) {
    const auto sorted = [](auto triangles) {
      std::sort(triangles.begin(), triangles.end());
      return triangles;
    };
    return a.vertices == b.vertices && sorted(a.triangles) == sorted(b.triangles);
  }
};

/// A file with the given bytes, removed with the object.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& name, const std::string& bytes = "")
      : path_((std::filesystem::temp_directory_path() /
               (std::string("rattan_") + std::to_string(::getpid()) + "_" + name))
                  .string()) {
    rewrite(bytes);
  }
  ~TemporaryFile() { std::remove(path_.c_str()); }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  void rewrite(const std::string& bytes) const {
    // Truncating a file in place makes some file systems wait for the disk on close.
    std::remove(path_.c_str());
    std::ofstream(path_, std::ios::binary | std::ios::trunc) << bytes;
  }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

/// Appends a value's bytes in the given order.
template <class T>
void append(std::string& bytes, T value, bool big_endian = false) {
  auto raw = std::bit_cast<std::array<char, sizeof(T)>>(value);
  if (big_endian) {
    for (std::size_t k = 0; k < sizeof(T) / 2; ++k) {
      std::swap(raw[k], raw[sizeof(T) - 1 - k]);
    }
  }
  bytes.append(raw.data(), raw.size());
}

inline CollectedScan read_bytes(const TemporaryFile& file, const std::string& bytes,
                                const ScanReadOptions& options = {}, ScanFileInfo* info = nullptr) {
  file.rewrite(bytes);
  CollectedScan scan;
  read_scan(file.path(), scan, info, options);
  return scan;
}

/// A pyramid over a square: 5 vertices, one quad and four triangles, so 6 triangles as fans.
inline const std::vector<std::array<double, 3>> kPyramidVertices = {
    {0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 0.5, 0.75}};
inline const std::vector<std::vector<std::uint32_t>> kPyramidFaces = {
    {0, 3, 2, 1}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};

inline CollectedScan pyramid() {
  CollectedScan scan;
  for (const auto& v : kPyramidVertices) {
    scan.vertices.emplace_back(v[0], v[1], v[2]);
  }
  for (const auto& f : kPyramidFaces) {
    for (std::size_t k = 2; k < f.size(); ++k) {
      scan.triangles.push_back({f[0], f[k - 1], f[k]});
    }
  }
  return scan;
}

inline std::string number(double value) {
  char text[40];
  std::snprintf(text, sizeof(text), "%.17g", value);
  return text;
}

inline std::string ascii_ply(const std::string& eol = "\n") {
  std::string s = "ply" + eol + "format ascii 1.0" + eol + "comment made by a test" + eol +
                  "obj_info num_cols 512" + eol + "element vertex 5" + eol + "property float x" +
                  eol + "property float y" + eol + "property float z" + eol +
                  "property float confidence" + eol + "element face 5" + eol +
                  "property list uchar int vertex_indices" + eol + "end_header" + eol;
  for (const auto& v : kPyramidVertices) {
    s += number(v[0]) + " " + number(v[1]) + "  " + number(v[2]) + " 0.5 " + eol;
  }
  for (const auto& f : kPyramidFaces) {
    s += std::to_string(f.size());
    for (const std::uint32_t i : f) {
      s += " ";
      s += std::to_string(i);
    }
    s += eol;
  }
  return s;
}

/// Elements and properties of all kinds around those that matter; T is the type of positions, I
/// that of indices.
template <class T, class I>
std::string rich_binary_ply(bool big, const std::string& t, const std::string& i) {
  std::string s = std::string("ply\nformat binary_") + (big ? "big" : "little") +
                  "_endian 1.0\nelement camera 2\nproperty double view\nproperty list ushort short "
                  "mask\nelement vertex 5\nproperty uchar red\nproperty " +
                  t + " z\nproperty " + t + " x\nproperty short label\nproperty " + t +
                  " y\nelement nothing 1000000000000\nelement face 5\nproperty uint material\n"
                  "property list int " +
                  i + " vertex_index\nproperty list uchar float texcoord\nend_header\n";
  for (int c = 0; c < 2; ++c) {
    append(s, 1.5, big);
    append(s, std::uint16_t{3}, big);
    for (int k = 0; k < 3; ++k) {
      append(s, std::int16_t{-1}, big);
    }
  }
  for (const auto& v : kPyramidVertices) {
    append(s, std::uint8_t{200}, big);
    append(s, static_cast<T>(v[2]), big);
    append(s, static_cast<T>(v[0]), big);
    append(s, std::int16_t{7}, big);
    append(s, static_cast<T>(v[1]), big);
  }
  for (const auto& f : kPyramidFaces) {
    append(s, std::uint32_t{9}, big);
    append(s, static_cast<std::int32_t>(f.size()), big);
    for (const std::uint32_t k : f) {
      append(s, static_cast<I>(k), big);
    }
    append(s, std::uint8_t{2}, big);
    append(s, 0.25F, big);
    append(s, 0.5F, big);
  }
  return s;
}

/// The layout that nearly every scanner writes.
inline std::string plain_binary_ply(bool big) {
  std::string s = std::string("ply\nformat binary_") + (big ? "big" : "little") +
                  "_endian 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty "
                  "float z\nelement face 5\nproperty list uchar int vertex_indices\nend_header\n";
  for (const auto& v : kPyramidVertices) {
    for (const double c : v) {
      append(s, static_cast<float>(c), big);
    }
  }
  for (const auto& f : kPyramidFaces) {
    append(s, static_cast<std::uint8_t>(f.size()), big);
    for (const std::uint32_t k : f) {
      append(s, static_cast<std::int32_t>(k), big);
    }
  }
  return s;
}

inline std::string obj(const std::string& eol = "\n") {
  std::string s = "# a test" + eol + "mtllib none.mtl" + eol + "o pyramid" + eol;
  for (const auto& v : kPyramidVertices) {
    s += "v " + number(v[0]) + " " + number(v[1]) + " " + number(v[2]) + " 0.1 0.2 0.3" + eol;
  }
  s += "vt 0 0" + eol + "vn 0 0 1" + eol + "f 1 4 3 2" + eol + "f 1/1 2/1 5/1" + eol +
       "f 2/1/1 3/1/1 5/1/1" + eol + "f -3//1 -2//1 \\" + eol + " -1//1" + eol +
       "f\t4  1 5 # last" + eol;
  return s;
}

inline std::string off() {
  std::string s = "OFF # a test\n# counts\n5 5 0\n\n";
  for (const auto& v : kPyramidVertices) {
    s += number(v[0]) + " " + number(v[1]) + " " + number(v[2]) + "\n";
  }
  for (const auto& f : kPyramidFaces) {
    s += std::to_string(f.size());
    for (const std::uint32_t i : f) {
      s += " ";
      s += std::to_string(i);
    }
    s += " 255 0 0 # red\n";
  }
  return s;
}

/// One of the colours of the files below: that of vertex v.
inline std::array<std::uint8_t, 4> test_colour(std::size_t v) {
  return {static_cast<std::uint8_t>(50 * v), static_cast<std::uint8_t>(255 - 50 * v), 7,
          static_cast<std::uint8_t>(200 + v)};
}

/// Colours with alpha of vertices, colours of faces.
inline std::string coloured_ply() {
  std::string s =
      "ply\nformat binary_little_endian 1.0\nelement vertex 5\nproperty double x\nproperty double "
      "y\nproperty double z\nproperty uchar red\nproperty uchar green\nproperty uchar "
      "blue\nproperty uchar alpha\nelement face 5\nproperty uchar red\nproperty list uchar int "
      "vertex_indices\nproperty uchar green\nproperty uchar blue\nend_header\n";
  for (std::size_t v = 0; v < kPyramidVertices.size(); ++v) {
    for (const double c : kPyramidVertices[v]) {
      append(s, c);
    }
    for (const std::uint8_t c : test_colour(v)) {
      append(s, c);
    }
  }
  for (const auto& f : kPyramidFaces) {
    append(s, std::uint8_t{3});
    append(s, static_cast<std::uint8_t>(f.size()));
    for (const std::uint32_t k : f) {
      append(s, static_cast<std::int32_t>(k));
    }
    append(s, std::uint8_t{3});
    append(s, std::uint8_t{3});
  }
  return s;
}

inline std::string coloured_off() {
  std::string s = "STCNOFF\n5 5 0\n";
  for (std::size_t v = 0; v < kPyramidVertices.size(); ++v) {
    for (const double c : kPyramidVertices[v]) {
      s += number(c) + " ";
    }
    s += "0 0 1 ";
    for (const std::uint8_t c : test_colour(v)) {
      s += std::to_string(c) + " ";
    }
    s += "0.5 0.5\n";
  }
  const std::string plain = off();
  return s + plain.substr(plain.find("4 0"));
}

/// The corners of the pyramid's triangles, three a triangle.
inline CollectedScan pyramid_soup() {
  const CollectedScan indexed = pyramid();
  CollectedScan soup;
  for (const auto& t : indexed.triangles) {
    const std::uint64_t first = soup.vertices.size();
    for (const std::uint64_t v : t) {
      soup.vertices.push_back(indexed.vertices[v]);
    }
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  return soup;
}

inline std::string ascii_stl(const std::string& eol = "\n", bool upper = false) {
  std::string s = "solid a test" + eol;
  const CollectedScan soup = pyramid_soup();
  for (const auto& t : soup.triangles) {
    s += "  facet normal 0 0 1" + eol + "    outer loop" + eol;
    for (const std::uint64_t v : t) {
      s += "      vertex " + number(soup.vertices[v].x()) + " " + number(soup.vertices[v].y()) +
           " " + number(soup.vertices[v].z()) + eol;
    }
    s += "    endloop" + eol + "  endfacet" + eol;
  }
  s += "endsolid a test" + eol;
  if (upper) {
    for (char& c : s) {
      c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
    }
  }
  return s;
}

inline std::string binary_stl(const std::string& title) {
  std::string s = title;
  s.resize(80, ' ');
  const CollectedScan soup = pyramid_soup();
  append(s, static_cast<std::uint32_t>(soup.triangles.size()));
  for (const auto& t : soup.triangles) {
    for (int k = 0; k < 3; ++k) {
      append(s, 0.0F);
    }
    for (const std::uint64_t v : t) {
      for (int axis = 0; axis < 3; ++axis) {
        append(s, static_cast<float>(soup.vertices[v][axis]));
      }
    }
    append(s, std::uint16_t{0});
  }
  return s;
}

struct DracoFile {
  bool sequential = false;
  int speed = 5;
  bool colours = false;
  /// Not quantised below 1.
  int position_bits = 0;
};

/// The pyramid. Vertices are renumbered by the encoder.
inline std::string draco_file(const DracoFile& wanted) {
  const CollectedScan scan = pyramid();
  draco::TriangleSoupMeshBuilder builder;
  builder.Start(static_cast<int>(scan.triangles.size()));
  const int position =
      builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  const int colour = wanted.colours
                         ? builder.AddAttribute(draco::GeometryAttribute::COLOR, 4, draco::DT_UINT8)
                         : -1;
  for (std::size_t t = 0; t < scan.triangles.size(); ++t) {
    std::array<std::array<float, 3>, 3> p{};
    std::array<std::array<std::uint8_t, 4>, 3> c{};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint64_t v = scan.triangles[t][k];
      for (int axis = 0; axis < 3; ++axis) {
        p[k][static_cast<std::size_t>(axis)] = static_cast<float>(scan.vertices[v][axis]);
      }
      c[k] = test_colour(v);
    }
    const draco::FaceIndex face(static_cast<std::uint32_t>(t));
    builder.SetAttributeValuesForFace(position, face, p[0].data(), p[1].data(), p[2].data());
    if (wanted.colours) {
      builder.SetAttributeValuesForFace(colour, face, c[0].data(), c[1].data(), c[2].data());
    }
  }
  const std::unique_ptr<draco::Mesh> mesh = builder.Finalize();
  draco::ExpertEncoder encoder(*mesh);
  encoder.SetSpeedOptions(wanted.speed, wanted.speed);
  encoder.SetEncodingMethod(wanted.sequential ? draco::MESH_SEQUENTIAL_ENCODING
                                              : draco::MESH_EDGEBREAKER_ENCODING);
  if (wanted.position_bits > 0) {
    encoder.SetAttributeQuantization(position, wanted.position_bits);
  }
  draco::EncoderBuffer buffer;
  encoder.EncodeToBuffer(&buffer);
  return {buffer.data(), buffer.size()};
}

inline std::string gzipped(const std::string& bytes) {
  z_stream stream{};
  deflateInit2(&stream, 6, Z_DEFLATED, MAX_WBITS + 16, 8, Z_DEFAULT_STRATEGY);
  std::string out(deflateBound(&stream, bytes.size()) + 32, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  deflate(&stream, Z_FINISH);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

inline std::string zstd_compressed(const std::string& bytes) {
  std::string out(ZSTD_compressBound(bytes.size()), '\0');
  out.resize(ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), 3));
  return out;
}

}  // namespace rattan::testing
