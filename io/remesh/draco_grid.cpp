// SPDX-License-Identifier: MIT
#include "io/remesh/draco_grid.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <draco/mesh/mesh.h>

#include "engine/core/errors.h"
#include "io/remesh/draco_polygons.h"

namespace rattan {
namespace {

constexpr const char* kGenerator = "generator";
constexpr const char* kOptions = "options";
constexpr const char* kInputHash = "input_sha256";
constexpr const char* kOrigin = "origin";

double float_ulp(double magnitude) {
  const float m = static_cast<float>(magnitude);
  return static_cast<double>(std::nextafter(m, std::numeric_limits<float>::infinity())) -
         static_cast<double>(m);
}

}  // namespace

double PositionBox::largest_coordinate(const Vec3d& offset) const {
  return std::max((low + offset).cwiseAbs().maxCoeff(), (high + offset).cwiseAbs().maxCoeff());
}

double default_accuracy(const PositionBox& box, double mean_edge) {
  return std::min(1e-5 * (box.high - box.low).norm(), mean_edge / 200.0);
}

void check_position_bits(int bits) {
  if (bits != 0 && (bits < kLeastPositionBits || bits > kMostPositionBits)) {
    throw UsageError("--position-bits takes " + std::to_string(kLeastPositionBits) + " to " +
                     std::to_string(kMostPositionBits) + ", not " + std::to_string(bits) + ".");
  }
}

PositionGrid choose_position_grid(const PositionBox& box, const Vec3d& origin, int bits,
                                  double accuracy) {
  const double side = box.largest_side();
  PositionGrid grid;
  grid.bits = bits;
  if (grid.bits == 0) {
    grid.bits = kLeastPositionBits;
    while (grid.bits < kMostPositionBits && side > accuracy * ((1 << grid.bits) - 1)) {
      ++grid.bits;
    }
  }
  grid.step = (side > 0.0 ? side : 1.0) / ((1 << grid.bits) - 1);
  // float32 must resolve a quarter of a step; else positions stay relative to the scan's origin, or
  // to the corner of the box where that origin is far off too.
  const auto fine = [&](const Vec3d& shift) {
    return float_ulp(box.largest_coordinate(shift)) <= 0.25 * grid.step;
  };
  grid.full = fine(origin) || (origin.isZero(0.0) && side == 0.0);
  grid.shift = grid.full ? origin : Vec3d::Zero();
  grid.origin = grid.full ? Vec3d::Zero() : origin;
  if (!grid.full && !fine(grid.shift)) {
    grid.shift = -box.low;
    grid.origin = origin + box.low;
  }
  // The grid Draco chooses by itself, in its own arithmetic. (Setting one explicitly goes through
  // decimals of six places in 1.5.5, which spoils any other range than whole numbers.)
  grid.range = 0.0F;
  for (int k = 0; k < 3; ++k) {
    grid.low[k] = static_cast<float>(box.low[k] + grid.shift[k]);
    const auto high = static_cast<float>(box.high[k] + grid.shift[k]);
    grid.range = std::max(grid.range, high - grid.low[k]);
  }
  if (grid.range == 0.0F) {
    grid.range = 1.0F;
  }
  grid.step = static_cast<double>(grid.range) / ((1 << grid.bits) - 1);
  // Draco's quantiser computes in float32, which rounds by a step or so at the finest grids.
  grid.bound = grid.step * (0.5 + std::ldexp(1.0, grid.bits - 22)) +
               3.0 * float_ulp(box.largest_coordinate(grid.shift));
  return grid;
}

GridRounding::GridRounding(const PositionGrid& grid) : low_{grid.low[0], grid.low[1], grid.low[2]} {
  quantizer_.Init(grid.range, (1 << grid.bits) - 1);
  ensure(dequantizer_.Init(grid.range, (1 << grid.bits) - 1), "Draco takes the quantisation range");
}

std::array<float, 3> GridRounding::operator()(const Vec3f& in) const {
  std::array<float, 3> out{};
  for (int k = 0; k < 3; ++k) {
    const auto i = static_cast<std::size_t>(k);
    out[i] = dequantizer_.DequantizeFloat(quantizer_.QuantizeFloat(in[k] - low_[i])) + low_[i];
  }
  return out;
}

std::unique_ptr<draco::GeometryMetadata> draco_metadata(const RemeshMetadata& metadata,
                                                        const PositionGrid& grid) {
  auto about = std::make_unique<draco::GeometryMetadata>();
  const auto add = [&](const char* name, const std::string& value) {
    if (!value.empty()) {
      about->AddEntryString(name, value);
    }
  };
  add(kGenerator, metadata.version.empty() ? "rattan" : "rattan " + metadata.version);
  add(kOptions, metadata.options);
  add(kInputHash, metadata.input_hash);
  if (!grid.full) {
    about->AddEntryDoubleArray(kOrigin, {grid.origin[0], grid.origin[1], grid.origin[2]});
  }
  return about;
}

RemeshMetadata metadata_of(const draco::Mesh& mesh) {
  RemeshMetadata out;
  const draco::GeometryMetadata* about = mesh.GetMetadata();
  if (about == nullptr) {
    return out;
  }
  if (about->GetEntryString(kGenerator, &out.version) && out.version.starts_with("rattan ")) {
    out.version.erase(0, 7);
  }
  about->GetEntryString(kOptions, &out.options);
  about->GetEntryString(kInputHash, &out.input_hash);
  std::vector<double> origin;
  if (about->GetEntryDoubleArray(kOrigin, &origin) && origin.size() == 3) {
    out.origin = Vec3d(origin[0], origin[1], origin[2]);
  }
  return out;
}

}  // namespace rattan
