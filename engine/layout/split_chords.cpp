// SPDX-License-Identifier: MIT
#include "engine/layout/disk_sides.h"
#include "engine/layout/flat_disk.h"

namespace rattan::layout {
namespace {

/// How much thicker than the floor triangles on the rim alone must be.
constexpr double kRimMargin = 4.0;

/// Nothing but splitting its sides can change its shape.
bool stuck(const FlatDisk& disk, std::uint32_t t) {
  const std::array<std::uint32_t, 3>& c = disk.triangle[t];
  return disk.fixed[c[0]] != 0 && disk.fixed[c[1]] != 0 && disk.fixed[c[2]] != 0 &&
         thickness(disk, t) < kRimMargin * kLeastThickness;
}

class ChordSplitter {
 public:
  explicit ChordSplitter(FlatDisk& disk)
      : disk_(disk), twin_(match_sides(disk.triangle, disk.position.size()).twin) {}

  void run(Chords which) {
    for (std::uint32_t t = 0; t < disk_.triangle.size(); ++t) {
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t side = 3 * t + k;
        const std::uint32_t a = start(side);
        const std::uint32_t b = start(next_side(side));
        if (twin_[side] != kNoSide && disk_.fixed[a] != 0 && disk_.fixed[b] != 0 &&
            (which == Chords::kAll || same_side(disk_, a, b) || stuck(disk_, t) ||
             stuck(disk_, twin_[side] / 3))) {
          split(side);
        }
      }
    }
  }

 private:
  std::uint32_t start(std::uint32_t side) const { return disk_.triangle[side / 3][side % 3]; }

  void join(std::uint32_t a, std::uint32_t b) {
    twin_[a] = b;
    if (b != kNoSide) {
      twin_[b] = a;
    }
  }

  /// Divides the triangle of a side at m on it: the first half and the side before go to a new
  /// triangle, whose first half is returned.
  std::uint32_t halve(std::uint32_t side, std::uint32_t m) {
    const std::uint32_t t = side / 3;
    const std::uint32_t k = side % 3;
    const std::uint32_t before = previous_side(side);
    const auto added = static_cast<std::uint32_t>(disk_.triangle.size());
    std::array<std::uint32_t, 3> corners = disk_.triangle[t];
    const std::uint32_t beyond = twin_[before];
    corners[(k + 1) % 3] = m;
    disk_.triangle.push_back(corners);
    disk_.triangle[t][k] = m;
    twin_.resize(twin_.size() + 3, kNoSide);
    join(3 * added + before % 3, beyond);
    join(3 * added + (k + 1) % 3, before);
    return 3 * added + k;
  }

  void split(std::uint32_t side) {
    const std::uint32_t other = twin_[side];
    const std::uint32_t a = start(side);
    const std::uint32_t b = start(other);
    const auto m = static_cast<std::uint32_t>(disk_.position.size());
    const Vec3d middle = 0.5 * (disk_.position[a] + disk_.position[b]);
    const Vec2d flat = 0.5 * (disk_.uv[a] + disk_.uv[b]);
    disk_.position.push_back(middle);
    disk_.uv.push_back(flat);
    disk_.fixed.push_back(0);
    disk_.made.push_back({a, b});
    const std::uint32_t from_a = halve(side, m);   // side: now m to b
    const std::uint32_t from_b = halve(other, m);  // other: now m to a
    join(from_a, other);
    join(from_b, side);
  }

  FlatDisk& disk_;
  std::vector<std::uint32_t> twin_;
};

}  // namespace

void split_chords(FlatDisk& disk, Chords which) {
  // Matching sides is dear; most disks have nothing to split.
  std::size_t joined = 0;
  std::size_t rim = 0;
  for (const std::array<std::uint32_t, 3>& c : disk.triangle) {
    for (int k = 0; k < 3; ++k) {
      joined += disk.fixed[c[k]] != 0 && disk.fixed[c[(k + 1) % 3]] != 0 ? 1 : 0;
    }
  }
  for (const std::uint8_t f : disk.fixed) {
    rim += f;
  }
  if (joined > rim) {
    ChordSplitter(disk).run(which);
  }
}

}  // namespace rattan::layout
