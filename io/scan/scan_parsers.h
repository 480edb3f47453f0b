// SPDX-License-Identifier: MIT
#pragma once

// What the readers of the single formats share; internal to io/.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/mesh/scan_sink.h"
#include "io/file/byte_source.h"
#include "io/scan/scan_reader.h"

namespace rattan {

inline constexpr const char* kSupportedFormats = "PLY (ASCII or binary), OBJ or OFF";

/// Gathers vertices and triangles into blocks for the sink, and counts.
class ScanBlocks {
 public:
  ScanBlocks(ScanSink& sink, ScanFileInfo& info, std::size_t block_records)
      : sink_(sink), info_(info), capacity_(block_records > 0 ? block_records : 1) {
    vertices_.reserve(capacity_);
    triangles_.reserve(capacity_);
  }

  void add_vertex(double x, double y, double z) {
    vertices_.emplace_back(x, y, z);
    if (vertices_.size() == capacity_) {
      flush_vertices();
    }
  }
  void add_triangle(std::uint64_t a, std::uint64_t b, std::uint64_t c) {
    triangles_.push_back({a, b, c});
    if (triangles_.size() == capacity_) {
      flush_triangles();
    }
  }
  /// One polygon, corner by corner, as a fan around its first corner.
  void begin_polygon() { corners_ = 0; }
  void add_corner(std::uint64_t vertex) {
    if (corners_ >= 2) {
      add_triangle(first_, previous_, vertex);
    } else if (corners_ == 0) {
      first_ = vertex;
    }
    previous_ = vertex;
    ++corners_;
  }
  void end_polygon() {
    if (corners_ != 3) {
      ++(corners_ > 3 ? info_.polygons : info_.small_faces);
    }
  }
  /// Hands out what is left.
  void flush() {
    flush_triangles();
    flush_vertices();
  }
  std::uint64_t vertices() const { return vertices_done_ + vertices_.size(); }
  std::uint64_t triangles() const { return triangles_done_ + triangles_.size(); }

 private:
  void flush_vertices() {
    if (!vertices_.empty()) {
      sink_.add_vertices(vertices_);
      vertices_done_ += vertices_.size();
      vertices_.clear();
    }
  }
  void flush_triangles() {
    if (!triangles_.empty()) {
      flush_vertices();  // so that triangles come after those of their vertices that were read
      sink_.add_triangles(triangles_);
      triangles_done_ += triangles_.size();
      triangles_.clear();
    }
  }

  ScanSink& sink_;
  ScanFileInfo& info_;
  std::size_t capacity_;
  std::vector<Vec3d> vertices_;
  std::vector<std::array<std::uint64_t, 3>> triangles_;
  std::uint64_t vertices_done_ = 0;
  std::uint64_t triangles_done_ = 0;
  std::uint64_t corners_ = 0;
  std::uint64_t first_ = 0;
  std::uint64_t previous_ = 0;
};

void read_ply(ByteSource& source, ScanBlocks& blocks, ScanFileInfo& info);
void read_obj(ByteSource& source, ScanBlocks& blocks, ScanFileInfo& info);
void read_off(ByteSource& source, ScanBlocks& blocks, ScanFileInfo& info);
/// Whether the line can start an OFF file: OFF, COFF, NOFF, ... alone or before counts.
bool is_off_keyword(std::string_view line);

}  // namespace rattan
