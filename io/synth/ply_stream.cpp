// SPDX-License-Identifier: MIT
#include "io/synth/ply_stream.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <unistd.h>

#include "engine/core/errors.h"

namespace rattan::synth {
namespace {

constexpr std::size_t kBufferBytes = std::size_t{1} << 20;
constexpr std::size_t kVertexBytes = 12;
constexpr std::size_t kTriangleBytes = 13;

}  // namespace

PlyStream::PlyStream(const std::string& path, std::uint64_t vertices, std::uint64_t triangles,
                     const std::string& comment)
    : path_(path), partial_path_(path + ".part") {
  descriptor_ = ::open(partial_path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (descriptor_ < 0) {
    throw UsageError(partial_path_ + ": the file cannot be made: " + std::strerror(errno) +
                     ". Check the folder and its permissions.");
  }
  const std::string index = vertices > 0x7fffffffU ? "uint" : "int";
  const std::string header =
      "ply\nformat binary_little_endian 1.0\ncomment " + comment + "\nelement vertex " +
      std::to_string(vertices) +
      "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
      std::to_string(triangles) + "\nproperty list uchar " + index +
      " vertex_indices\nend_header\n";
  vertices_.bytes.resize(kBufferBytes);
  triangles_.bytes.resize(kBufferBytes);
  vertices_end_ = header.size() + vertices * kVertexBytes;
  triangles_end_ = vertices_end_ + triangles * kTriangleBytes;
  total_bytes_ = triangles_end_;
  triangles_.at = vertices_end_;
  std::memcpy(vertices_.bytes.data(), header.data(), header.size());
  vertices_.used = header.size();
}

PlyStream::~PlyStream() {
  if (descriptor_ >= 0) {
    ::close(descriptor_);
    std::remove(partial_path_.c_str());
  }
}

void PlyStream::add_vertex(const Vec3f& p) {
  if (vertices_.used + kVertexBytes > vertices_.bytes.size()) {
    flush(vertices_);
  }
  std::memcpy(vertices_.bytes.data() + vertices_.used, p.data(), kVertexBytes);
  vertices_.used += kVertexBytes;
}

void PlyStream::add_triangle(const std::array<std::uint32_t, 3>& t) {
  if (triangles_.used + kTriangleBytes > triangles_.bytes.size()) {
    flush(triangles_);
  }
  char* out = triangles_.bytes.data() + triangles_.used;
  *out = 3;
  std::memcpy(out + 1, t.data(), kTriangleBytes - 1);
  triangles_.used += kTriangleBytes;
}

void PlyStream::flush(Section& section) {
  const char* from = section.bytes.data();
  while (section.used > 0) {
    const ssize_t put = ::pwrite(descriptor_, from, section.used, static_cast<off_t>(section.at));
    if (put < 0 && errno == EINTR) {
      continue;
    }
    if (put <= 0) {
      throw ResourceError(partial_path_ + ": writing failed: " + std::strerror(errno) +
                          ". The scan needs " + std::to_string(total_bytes_) + " bytes on disk.");
    }
    from += put;
    section.at += static_cast<std::uint64_t>(put);
    section.used -= static_cast<std::size_t>(put);
  }
}

void PlyStream::finish() {
  flush(vertices_);
  flush(triangles_);
  ensure(vertices_.at == vertices_end_ && triangles_.at == triangles_end_,
         "the synthesised scan has the counts of its header");
  if (::fsync(descriptor_) != 0 || ::close(descriptor_) != 0) {
    descriptor_ = -1;
    std::remove(partial_path_.c_str());
    throw ResourceError(partial_path_ + ": writing failed: " + std::strerror(errno) +
                        ". The scan needs " + std::to_string(total_bytes_) + " bytes on disk.");
  }
  descriptor_ = -1;
  if (std::rename(partial_path_.c_str(), path_.c_str()) != 0) {
    const std::string why = std::strerror(errno);
    std::remove(partial_path_.c_str());
    throw UsageError(path_ + ": the file cannot be replaced: " + why + ". Name another file.");
  }
}

}  // namespace rattan::synth
