// SPDX-License-Identifier: MIT
#pragma once

// Writes the vertices and the triangles of a binary PLY side by side, each into its section of the
// file, so that one pass makes both; internal to io/synth.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/core/types.h"

namespace rattan::synth {

class PlyStream {
 public:
  /// Counts are fixed from the start. Throws UsageError if the file cannot be made.
  PlyStream(const std::string& path, std::uint64_t vertices, std::uint64_t triangles,
            const std::string& comment);
  /// Removes the unfinished file unless finish() has run.
  ~PlyStream();
  PlyStream(const PlyStream&) = delete;
  PlyStream& operator=(const PlyStream&) = delete;

  void add_vertex(const Vec3f& p);
  void add_triangle(const std::array<std::uint32_t, 3>& t);
  /// Flushes, syncs and gives the file its name. Both counts must have been met.
  void finish();

 private:
  struct Section {
    std::uint64_t at = 0;  // in the file
    std::size_t used = 0;  // of bytes
    std::vector<char> bytes;
  };
  void flush(Section& section);

  std::string path_;
  std::string partial_path_;
  int descriptor_ = -1;
  std::uint64_t total_bytes_ = 0;
  std::uint64_t triangles_end_ = 0;
  std::uint64_t vertices_end_ = 0;
  Section vertices_;
  Section triangles_;
};

}  // namespace rattan::synth
