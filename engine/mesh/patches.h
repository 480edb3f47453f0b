// SPDX-License-Identifier: MIT
#pragma once

// Patches: sets of triangles connected across edges, with the turn that would orient them alike.
// Found block by block, joined over the blocks' borders.

#include <cstdint>
#include <utility>
#include <vector>

namespace rattan {

/// Union-find whose elements also know their parity relative to the root of their set.
class ParityUnionFind {
 public:
  explicit ParityUnionFind(std::uint32_t size = 0) { reset(size); }
  void reset(std::uint32_t size) {
    parent_.resize(size);
    for (std::uint32_t i = 0; i < size; ++i) {
      parent_[i] = std::uint64_t{i} << 1;
    }
  }
  std::uint32_t size() const { return static_cast<std::uint32_t>(parent_.size()); }

  /// Root, and the parity of `i` relative to it.
  std::pair<std::uint32_t, std::uint32_t> find(std::uint32_t i) {
    std::uint64_t up = parent_[i];
    while (true) {
      const std::uint64_t above = parent_[up >> 1];
      if (above >> 1 == up >> 1) {
        return {static_cast<std::uint32_t>(up >> 1), static_cast<std::uint32_t>(up & 1)};
      }
      up = above ^ (up & 1);
      parent_[i] = up;
    }
  }
  /// States that a and b differ by `parity`. The lower root stays. False: contradicts what is
  /// known.
  bool unite(std::uint32_t a, std::uint32_t b, std::uint32_t parity) {
    auto [ra, pa] = find(a);
    auto [rb, pb] = find(b);
    if (ra == rb) {
      return (pa ^ pb) == parity;
    }
    if (rb < ra) {
      std::swap(ra, rb);
    }
    parent_[rb] = std::uint64_t{ra} << 1 | (pa ^ pb ^ parity);
    return true;
  }

 private:
  std::vector<std::uint64_t> parent_;  ///< parent << 1 | parity relative to it
};

/// A patch of one block that reaches the block's border.
struct Patch {
  std::uint64_t plain = 0;         ///< owned triangles of parity 0
  std::uint64_t turned = 0;        ///< owned triangles of parity 1
  std::uint32_t first_parity = 0;  ///< parity of its first owned triangle
  bool conflict = false;           ///< one-sided within the block
};

/// One triangle seen by its own block or by another that it touches: both emit a link with the same
/// `pair` (own block << 32 | other block), in the same order of triangles.
struct PatchLink {
  std::uint64_t pair = 0;
  std::uint64_t patch = 0;  ///< global patch << 1 | parity of the triangle
};

/// What becomes of each patch.
struct PatchFate {
  bool flip = false;       ///< turn its triangles of parity 0 (else those of parity 1)
  bool one_sided = false;  ///< its component cannot be oriented
};

/// Collects patches block by block and joins those that share triangles.
class PatchJoiner {
 public:
  /// Returns the global number of the first of `patches`.
  std::uint64_t add(const std::vector<Patch>& patches);
  std::uint64_t patch_count() const { return patches_.size(); }

  void begin_joining();
  /// The two ends of one triangle's link.
  void join(std::uint64_t patch_a, std::uint64_t patch_b);
  /// Each component takes the orientation of most of its triangles; on a tie that of its first one.
  /// Sets components().
  std::vector<PatchFate> resolve();
  std::uint64_t components() const { return components_; }
  bool any_one_sided() const { return one_sided_ > 0; }
  std::uint64_t one_sided() const { return one_sided_; }  ///< components

 private:
  std::vector<Patch> patches_;
  ParityUnionFind sets_;
  std::uint64_t components_ = 0;
  std::uint64_t one_sided_ = 0;
};

}  // namespace rattan
