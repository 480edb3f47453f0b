// SPDX-License-Identifier: MIT
#pragma once

// From candidates to feature curves. Part of features.cpp.

#include <cstdint>
#include <vector>

#include "engine/mesh/features.h"

namespace rattan {

struct FeatureCandidate {
  std::uint64_t lo = 0;
  std::uint64_t hi = 0;
  Vec3f p_lo{0.0F, 0.0F, 0.0F};
  Vec3f p_hi{0.0F, 0.0F, 0.0F};
  float bend = 0.0F;      ///< squared distance of the two unit normals
  float rest = 0.0F;      ///< mean of the same over the other edges around the ends
  std::uint8_t seen = 0;  ///< bit 0: sharp from lo, bit 1: from hi
  bool boundary = false;
  bool ragged = false;
};

/// Collects what the tiles found; in memory from there on.
class FeatureBuilder {
 public:
  /// `strong`: bend from which an edge is sharp by itself.
  FeatureBuilder(const FeatureOptions& options, double strong)
      : options_(options), strong_(strong) {}

  /// Joins both halves of edges inside a tile, and drops what can't become a curve whatever other
  /// tiles have found. Touches nothing but its argument.
  void reduce_tile(std::uint64_t first, std::uint32_t owned,
                   std::vector<FeatureCandidate>& found) const;
  /// `sharp`: length of all sharp edges of the tile, in units.
  void add(const std::vector<FeatureCandidate>& found, std::uint64_t sharp) {
    edges_.insert(edges_.end(), found.begin(), found.end());
    sharp_ += sharp;
  }
  double strong() const { return strong_; }
  /// A length as an integer, so that sums don't depend on their order.
  std::uint64_t units(double length) const;
  /// Leaves the clear curves of what was added; true if they are most of what is sharp.
  bool find_clear();
  /// Then, with all that is sharp added once more: adds the rest of it as ragged curves.
  void add_ragged();
  FeatureSet finish();

 private:
  struct Curve {
    std::uint32_t first = 0;  ///< into walk_
    std::uint32_t count = 0;
    std::uint32_t from = 0;  ///< local vertices
    std::uint32_t to = 0;
    double length = 0.0;
    double strong_length = 0.0;
    double turn = 0.0;  ///< mean from edge to edge, radians
    double zigzag = 0.0;
    double contrast = 0.0;  ///< how much more it bends than the surface beside it
    bool closed = false;
    bool boundary = false;
    bool ragged = false;
  };

  void drop(const std::vector<std::uint8_t>& keep);
  void connect();
  std::uint32_t other_end(std::uint32_t edge, std::uint32_t v) const {
    return ends_[edge][0] == v ? ends_[edge][1] : ends_[edge][0];
  }
  std::uint32_t valence(std::uint32_t v) const { return begin_[v + 1] - begin_[v]; }
  Vec3d position(std::uint32_t v) const { return positions_[v].cast<double>(); }
  double length(std::uint32_t edge) const {
    return (position(ends_[edge][1]) - position(ends_[edge][0])).norm();
  }
  /// `node`: one a vertex, curves end there.
  void trace(const std::vector<std::uint8_t>& node);
  std::vector<std::uint8_t> plain_nodes() const;
  void measure(Curve& c) const;
  template <class Bad>
  bool drop_curves(const Bad& bad);
  template <class Bad>
  void drop_all(const Bad& bad);
  /// Leaves curves that are long, smooth and sharp, and short ones in between.
  void drop_noise();
  void drop_short();
  /// Drops ragged curves that are less sharp, and what is short.
  void keep_ragged(double strong);
  std::size_t ragged_corners();
  std::vector<std::uint8_t> find_corners() const;
  /// Nodes where the chords of ragged curves between them would leave these too far.
  void divide_ragged(std::vector<std::uint8_t>& node);
  void divide(const std::vector<std::uint32_t>& path, std::size_t first, std::size_t last,
              std::vector<std::uint8_t>& node) const;
  void list_followed(FeatureSet& set) const;

  FeatureOptions options_;
  double strong_;
  std::uint64_t sharp_ = 0;
  std::vector<FeatureCandidate> found_;  ///< clear curves, while the rest is looked for
  bool clear_ = false;
  std::vector<FeatureCandidate> edges_;
  std::vector<std::array<std::uint32_t, 2>> ends_;  ///< local vertices of each edge
  std::vector<std::uint64_t> ids_;                  ///< global ids of local vertices, ascending
  std::vector<Vec3f> positions_;
  std::vector<std::uint32_t> begin_, around_;  ///< edges around each vertex
  std::vector<Curve> curves_;
  std::vector<std::uint32_t> walk_;  ///< edges of the curves, in order
};

}  // namespace rattan
