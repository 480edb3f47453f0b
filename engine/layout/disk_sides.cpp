// SPDX-License-Identifier: MIT
#include "engine/layout/disk_sides.h"

#include "engine/core/errors.h"

namespace rattan::layout {
namespace {

void ensure_connected(const std::vector<std::uint32_t>& twin) {
  const std::size_t triangles = twin.size() / 3;
  std::vector<std::uint8_t> seen(triangles, 0);
  std::vector<std::uint32_t> open{0};
  seen[0] = 1;
  std::size_t reached = 1;
  while (!open.empty()) {
    const std::uint32_t t = open.back();
    open.pop_back();
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t other = twin[3 * t + k];
      if (other != kNoSide && seen[other / 3] == 0) {
        seen[other / 3] = 1;
        ++reached;
        open.push_back(other / 3);
      }
    }
  }
  ensure(reached == triangles, "A chart is connected");
}

}  // namespace

DiskSides match_sides(std::span<const std::array<std::uint32_t, 3>> triangle,
                      std::size_t vertices) {
  ensure(!triangle.empty(), "A chart has triangles");
  const std::size_t sides = 3 * triangle.size();
  std::vector<std::uint32_t> begin(vertices + 2, 0);
  for (const std::array<std::uint32_t, 3>& t : triangle) {
    ensure(t[0] != t[1] && t[1] != t[2] && t[2] != t[0], "A triangle has three vertices");
    for (const std::uint32_t v : t) {
      ensure(v < vertices, "Corners of triangles exist");
      ++begin[v + 2];
    }
  }
  for (std::size_t v = 2; v < begin.size(); ++v) {
    ensure(begin[v] > 0, "Each vertex of a chart has a triangle");
    begin[v] += begin[v - 1];
  }
  std::vector<std::uint32_t> leaving(sides);
  for (std::uint32_t s = 0; s < sides; ++s) {
    leaving[begin[triangle[s / 3][s % 3] + 1]++] = s;
  }
  const auto end_of = [&](std::uint32_t side) { return triangle[side / 3][next_side(side) % 3]; };
  DiskSides result;
  result.twin.assign(sides, kNoSide);
  std::size_t edges = 0;
  std::size_t rim_sides = 0;
  std::vector<std::uint32_t> rim_after(vertices, kNoSide);
  std::uint32_t first = kNoSide;
  for (std::uint32_t s = 0; s < sides; ++s) {
    const std::uint32_t from = triangle[s / 3][s % 3];
    const std::uint32_t to = end_of(s);
    std::uint32_t found = 0;
    for (std::uint32_t i = begin[to]; i < begin[to + 1]; ++i) {
      if (end_of(leaving[i]) == from) {
        result.twin[s] = leaving[i];
        ++found;
      }
    }
    std::uint32_t alike = 0;
    for (std::uint32_t i = begin[from]; i < begin[from + 1]; ++i) {
      alike += end_of(leaving[i]) == to ? 1 : 0;
    }
    ensure(found <= 1 && alike == 1, "A chart is manifold");
    edges += found == 0 || result.twin[s] > s ? 1 : 0;
    if (found == 0) {
      ensure(rim_after[from] == kNoSide, "A chart's rim passes each vertex once");
      rim_after[from] = s;
      first = first == kNoSide ? s : first;
      ++rim_sides;
    }
  }
  ensure(first != kNoSide, "A chart has a rim");
  std::uint32_t side = first;
  do {
    result.rim.push_back(side);
    side = rim_after[end_of(side)];
    ensure(side != kNoSide, "A chart's rim is closed");
  } while (side != first && result.rim.size() <= rim_sides);
  ensure(result.rim.size() == rim_sides, "A chart has one rim");
  ensure(vertices + triangle.size() == edges + 1, "A chart is a disk");
  ensure_connected(result.twin);
  return result;
}

}  // namespace rattan::layout
