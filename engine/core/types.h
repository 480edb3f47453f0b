// SPDX-License-Identifier: MIT
#pragma once

// Vectors, and the ids that must not be mixed up.

#include <array>
#include <compare>
#include <cstdint>
#include <functional>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace rattan {

using Vec2d = Eigen::Vector2d;
using Vec3f = Eigen::Vector3f;
using Vec3d = Eigen::Vector3d;

/// An integer that converts to nothing by itself. Ids of the whole scan are 64 bits wide; positions
/// within one tile are plain std::uint32_t ("local" in names).
template <class Tag, class Integer>
struct StrongId {
  using ValueType = Integer;
  Integer value{};

  constexpr StrongId() = default;
  constexpr explicit StrongId(Integer v) : value(v) {}
  friend constexpr auto operator<=>(StrongId, StrongId) = default;
  constexpr StrongId& operator++() {
    ++value;
    return *this;
  }
};

using TileId = StrongId<struct TileTag, std::uint32_t>;
/// Vertex of the repaired scan, numbered along the space-filling curve.
using VertexId = StrongId<struct VertexTag, std::uint64_t>;
/// Triangle of the repaired scan, in the order of (lowest vertex, ...).
using TriangleId = StrongId<struct TriangleTag, std::uint64_t>;

/// Corners in tile-local vertex numbers, counter-clockwise seen from outside.
using LocalTriangle = std::array<std::uint32_t, 3>;

}  // namespace rattan

template <class Tag, class Integer>
struct std::hash<rattan::StrongId<Tag, Integer>> {
  std::size_t operator()(rattan::StrongId<Tag, Integer> id) const noexcept {
    return std::hash<Integer>{}(id.value);
  }
};
