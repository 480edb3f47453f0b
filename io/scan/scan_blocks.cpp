// SPDX-License-Identifier: MIT
#include "io/scan/scan_blocks.h"

#include <algorithm>
#include <cmath>

namespace rattan {
namespace {

// A face of more corners is no polygon of a scan; it is cut as it comes, so that a hostile one
// costs no memory.
constexpr std::size_t kMaxPolygon = 4096;

}  // namespace

ScanBlocks::ScanBlocks(ScanSink& sink, ScanFileInfo& info, std::size_t block_records)
    : sink_(sink), info_(info), capacity_(std::max<std::size_t>(block_records, 1)) {
  vertices_.reserve(capacity_);
  triangles_.reserve(capacity_);
}

void ScanBlocks::add_further_corner(std::uint64_t vertex) {
  if (corners_ == 3) {
    polygon_.assign(head_.begin(), head_.end());
  }
  if (corners_ >= kMaxPolygon) {
    if (corners_ == kMaxPolygon) {
      for (std::size_t k = 2; k < polygon_.size(); ++k) {
        add_triangle(polygon_[0], polygon_[k - 1], polygon_[k]);
      }
    }
    add_triangle(polygon_[0], polygon_.back(), vertex);
    polygon_.back() = vertex;
    return;
  }
  polygon_.push_back(vertex);
}

void ScanBlocks::finish_polygon() {
  ++info_.polygons;
  if (corners_ > kMaxPolygon) {
    return;
  }
  // Many programs write a triangle as a quad with a corner given twice.
  polygon_.erase(std::unique(polygon_.begin(), polygon_.end()), polygon_.end());
  while (polygon_.size() > 1 && polygon_.front() == polygon_.back()) {
    polygon_.pop_back();
  }
  if (polygon_.size() <= 3) {
    --info_.polygons;
    if (polygon_.size() == 3) {
      add_triangle(polygon_[0], polygon_[1], polygon_[2]);
    } else {
      ++info_.small_faces;
    }
    return;
  }
  // A face that is given twice then has the same first corner, and so the same fan.
  std::rotate(polygon_.begin(), std::min_element(polygon_.begin(), polygon_.end()), polygon_.end());
  sizes_.push_back(static_cast<std::uint32_t>(polygon_.size()));
  polygon_corners_.insert(polygon_corners_.end(), polygon_.begin(), polygon_.end());
  polygon_triangles_ += polygon_.size() - 2;
  if (polygon_corners_.size() >= capacity_) {
    flush_polygons();
  }
}

void ScanBlocks::flush() {
  flush_triangles();
  flush_polygons();
  flush_vertices();
}

void ScanBlocks::flush_vertices() {
  if (vertices_.empty()) {
    return;
  }
  sink_.add_vertices(vertices_);
  if (info_.colours) {
    sink_.add_colours(colours_);
    colours_.clear();
  }
  vertices_done_ += vertices_.size();
  vertices_.clear();
}

// Faces come after those of their vertices that were read.
void ScanBlocks::flush_triangles() {
  if (!triangles_.empty()) {
    flush_vertices();
    sink_.add_triangles(triangles_);
    triangles_done_ += triangles_.size();
    triangles_.clear();
  }
}

void ScanBlocks::flush_polygons() {
  if (!sizes_.empty()) {
    flush_vertices();
    sink_.add_polygons(sizes_, polygon_corners_);
    sizes_.clear();
    polygon_corners_.clear();
  }
}

ScanColour colour_of_numbers(const double* values, int count) {
  double highest = 0.0;
  for (int k = 0; k < count; ++k) {
    highest = std::max(highest, values[k]);  // false for NaN
  }
  const double scale = highest > 1.0 ? 1.0 : 255.0;
  ScanColour colour{0, 0, 0, 255};
  for (int k = 0; k < count; ++k) {
    const double value = values[k] * scale + 0.5;
    colour[static_cast<std::size_t>(k)] =
        value >= 255.0 ? 255 : (value > 0.0 ? static_cast<std::uint8_t>(value) : 0);
  }
  return colour;
}

}  // namespace rattan
