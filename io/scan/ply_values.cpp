// SPDX-License-Identifier: MIT
#include "io/scan/ply_values.h"

#include <algorithm>
#include <string>

namespace rattan {

PlyColour::PlyColour(const PlyElement& element) {
  for (const char* prefix : {"", "diffuse_"}) {
    static constexpr const char* kNames[] = {"red", "green", "blue", "alpha"};
    int count = 0;
    while (count < 4) {
      const int k = element.find(std::string(prefix) + kNames[count]);
      if (k < 0 || element.properties[static_cast<std::size_t>(k)].is_list) {
        break;
      }
      property_[count++] = k;
    }
    if (count >= 3) {
      count_ = count;
      break;
    }
  }
  for (int c = 0; c < count_; ++c) {
    type_[c] = element.properties[static_cast<std::size_t>(property_[c])].type;
    at_[c] = element.bytes_before(property_[c]);
  }
  is_bytes_ = std::all_of(type_, type_ + count_, [](PlyType t) { return t == PlyType::kUint8; });
}

ScanColour PlyColour::of(double* values) const {
  if (type_[0] == PlyType::kFloat32 || type_[0] == PlyType::kFloat64) {
    return colour_of_numbers(values, count_);
  }
  if (type_[0] == PlyType::kUint16) {
    for (int c = 0; c < count_; ++c) {
      values[c] /= 257.0;
    }
  }
  if (count_ == 3) {
    values[3] = 255.0;
  }
  // With a component at 255, alpha or not, none is taken for a share of 1.
  double bytes[4] = {values[0], values[1], values[2], 255.0};
  ScanColour colour = colour_of_numbers(bytes, 4);
  bytes[0] = values[3];
  colour[3] = colour_of_numbers(bytes, 4)[0];
  return colour;
}

}  // namespace rattan
