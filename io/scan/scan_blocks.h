// SPDX-License-Identifier: MIT
#pragma once

// Vertices, colours and faces on their way from a reader to the sink; internal to io/.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/mesh/scan_sink.h"
#include "io/scan/scan_reader.h"

namespace rattan {

using ScanColour = std::array<std::uint8_t, 4>;

/// Gathers what a file holds into blocks for the sink, and counts.
class ScanBlocks {
 public:
  ScanBlocks(ScanSink& sink, ScanFileInfo& info, std::size_t block_records);

  void add_vertex(double x, double y, double z) {
    if (vertices_.size() == capacity_) {
      flush_vertices();
    }
    vertices_.emplace_back(x, y, z);
  }
  /// Before the first vertex, if each is followed by its colour.
  void expect_colours() { info_.colours = true; }
  /// Of the vertex added last.
  void add_colour(const ScanColour& colour) { colours_.push_back(colour); }

  void add_triangle(std::uint64_t a, std::uint64_t b, std::uint64_t c) {
    triangles_.push_back({a, b, c});
    if (triangles_.size() == capacity_) {
      flush_triangles();
    }
  }
  /// One face of any number of corners, corner by corner.
  void begin_polygon() { corners_ = 0; }
  void add_corner(std::uint64_t vertex) {
    if (corners_ < 3) {
      head_[corners_] = vertex;
    } else {
      add_further_corner(vertex);
    }
    ++corners_;
  }
  void end_polygon() {
    if (corners_ == 3) {
      add_triangle(head_[0], head_[1], head_[2]);
    } else if (corners_ < 3) {
      ++info_.small_faces;
    } else {
      finish_polygon();
    }
  }

  /// Hands out what is left.
  void flush();
  std::uint64_t vertices() const { return vertices_done_ + vertices_.size(); }
  /// Polygons count as what they are cut into.
  std::uint64_t triangles() const {
    return triangles_done_ + triangles_.size() + polygon_triangles_;
  }

 private:
  void add_further_corner(std::uint64_t vertex);
  void finish_polygon();
  void flush_vertices();
  void flush_triangles();
  void flush_polygons();

  ScanSink& sink_;
  ScanFileInfo& info_;
  std::size_t capacity_;
  std::vector<Vec3d> vertices_;
  std::vector<ScanColour> colours_;
  std::vector<std::array<std::uint64_t, 3>> triangles_;
  std::uint64_t vertices_done_ = 0;
  std::uint64_t triangles_done_ = 0;
  std::uint64_t polygon_triangles_ = 0;

  std::uint64_t corners_ = 0;  // of the face that is being added
  std::array<std::uint64_t, 3> head_{};
  std::vector<std::uint64_t> polygon_;  // it, from four corners on
  std::vector<std::uint32_t> sizes_;    // polygons that wait for the sink
  std::vector<std::uint64_t> polygon_corners_;
};

/// A colour given as numbers: up to 1 they mean shares of full colour, beyond 1 shares of 255.
/// `count` is 3 or 4, the last then being alpha.
ScanColour colour_of_numbers(const double* values, int count);

}  // namespace rattan
