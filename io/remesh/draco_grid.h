// SPDX-License-Identifier: MIT
#pragma once

// What all Draco files of Rattan have in common: the grid of quantised positions, and what travels
// in the metadata. Internal to io/.

#include <array>
#include <cstdint>
#include <limits>
#include <memory>

#include <draco/core/quantization_utils.h>

#include "engine/core/types.h"
#include "io/remesh/remesh_metadata.h"

namespace draco {
class GeometryMetadata;
class Mesh;
}  // namespace draco

namespace rattan {

struct PositionBox {
  Vec3d low = Vec3d::Constant(std::numeric_limits<double>::infinity());
  Vec3d high = -low;

  void add(const Vec3d& p) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  double largest_side() const { return (high - low).maxCoeff(); }
  double largest_coordinate(const Vec3d& offset) const;
};

/// Where the grid of quantised positions lies.
struct PositionGrid {
  int bits = 0;
  float low[3] = {0.0F, 0.0F, 0.0F};
  float range = 1.0F;
  double step = 0.0;  ///< distance of neighbouring quantised positions, per axis
  /// No coordinate is further than this from what was meant; half a step plus float32 rounding.
  double bound = 0.0;
  Vec3d shift{0.0, 0.0, 0.0};   ///< file position = mesh position + shift
  Vec3d origin{0.0, 0.0, 0.0};  ///< full position = file position + origin
  bool full = true;             ///< the origin is zero

  Vec3f to_file(const Vec3d& p) const { return (p + shift).cast<float>(); }
};

/// The step positions are quantised with unless told otherwise: 1e-5 of the bounding box diagonal,
/// well below the distance a remesh keeps from its scan, or 1/200 of the mean edge if that is less,
/// which keeps normals of small faces within about a tenth of a degree.
double default_accuracy(const PositionBox& box, double mean_edge);

/// Throws UsageError unless `bits` is 0 or from kLeastPositionBits to kMostPositionBits (see
/// draco_polygons.h).
void check_position_bits(int bits);

/// The grid for positions in `box`, relative to `origin`. With 0 bits, the fewest whose step is at
/// most `accuracy`.
PositionGrid choose_position_grid(const PositionBox& box, const Vec3d& origin, int bits,
                                  double accuracy);

/// What Draco's quantiser makes of positions in the file, by its own arithmetic.
class GridRounding {
 public:
  explicit GridRounding(const PositionGrid& grid);
  std::array<float, 3> operator()(const Vec3f& in) const;

 private:
  std::array<float, 3> low_;
  draco::Quantizer quantizer_;
  draco::Dequantizer dequantizer_;
};

/// With the origin, where the grid has one.
std::unique_ptr<draco::GeometryMetadata> draco_metadata(const RemeshMetadata& metadata,
                                                        const PositionGrid& grid);
/// What draco_metadata() put there; empty for other files.
RemeshMetadata metadata_of(const draco::Mesh& mesh);

}  // namespace rattan
