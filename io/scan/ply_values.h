// SPDX-License-Identifier: MIT
#pragma once

// The values of PLY properties: numbers from the bytes of a binary file, colours from numbers;
// internal to io/.

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "io/scan/ply_header.h"
#include "io/scan/scan_blocks.h"

namespace rattan {

/// The Word that begins at p, of any alignment. `Swap`: its bytes are in the other order than this
/// machine's.
template <class Word, bool Swap>
Word load_word(const char* p) {
  Word word;
  std::memcpy(&word, p, sizeof(Word));
  if constexpr (Swap && sizeof(Word) == 2) {
    word = static_cast<Word>(__builtin_bswap16(static_cast<std::uint16_t>(word)));
  } else if constexpr (Swap && sizeof(Word) == 4) {
    word = static_cast<Word>(__builtin_bswap32(static_cast<std::uint32_t>(word)));
  } else if constexpr (Swap && sizeof(Word) == 8) {
    word = static_cast<Word>(__builtin_bswap64(static_cast<std::uint64_t>(word)));
  }
  return word;
}

/// Integer types only. A 64-bit unsigned beyond the signed range turns negative, which every caller
/// refuses.
template <bool Swap>
std::int64_t load_integer(PlyType type, const char* p) {
  switch (type) {
    case PlyType::kInt8:
      return load_word<std::int8_t, Swap>(p);
    case PlyType::kUint8:
      return load_word<std::uint8_t, Swap>(p);
    case PlyType::kInt16:
      return load_word<std::int16_t, Swap>(p);
    case PlyType::kUint16:
      return load_word<std::uint16_t, Swap>(p);
    case PlyType::kInt32:
      return load_word<std::int32_t, Swap>(p);
    case PlyType::kUint32:
      return load_word<std::uint32_t, Swap>(p);
    default:
      return load_word<std::int64_t, Swap>(p);
  }
}

template <bool Swap>
double load_number(PlyType type, const char* p) {
  switch (type) {
    case PlyType::kFloat32:
      return std::bit_cast<float>(load_word<std::uint32_t, Swap>(p));
    case PlyType::kFloat64:
      return std::bit_cast<double>(load_word<std::uint64_t, Swap>(p));
    case PlyType::kUint64:
      return static_cast<double>(load_word<std::uint64_t, Swap>(p));
    default:
      return static_cast<double>(load_integer<Swap>(type, p));
  }
}

/// The colour of a vertex among the properties of its element: red, green, blue, perhaps alpha, or
/// the same names after "diffuse_".
class PlyColour {
 public:
  PlyColour() = default;
  explicit PlyColour(const PlyElement& element);

  /// Components: 0 (no colours), 3 or 4.
  int count() const { return count_; }
  int property(int component) const { return property_[component]; }
  /// Which component the k-th property is; -1: none.
  int component_of(int k) const {
    for (int c = 0; c < count_; ++c) {
      if (property_[c] == k) {
        return c;
      }
    }
    return -1;
  }
  /// From count() values as they stand in the file.
  ScanColour of(double* values) const;

  /// From the binary record that begins at p. Pre: colours, and the element has no list.
  template <bool Swap>
  ScanColour in_record(const char* p) const {
    if (is_bytes_) {
      ScanColour colour{0, 0, 0, 255};
      for (int c = 0; c < count_; ++c) {
        colour[static_cast<std::size_t>(c)] = static_cast<std::uint8_t>(p[at_[c]]);
      }
      return colour;
    }
    double values[4] = {};
    for (int c = 0; c < count_; ++c) {
      values[c] = load_number<Swap>(type_[c], p + at_[c]);
    }
    return of(values);
  }

 private:
  int count_ = 0;
  int property_[4] = {-1, -1, -1, -1};
  PlyType type_[4] = {};
  std::size_t at_[4] = {};  // bytes into a record without lists
  bool is_bytes_ = false;
};

}  // namespace rattan
