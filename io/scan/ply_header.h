// SPDX-License-Identifier: MIT
#pragma once

// The header of a PLY file; internal to io/.

#include <cstdint>
#include <string>
#include <vector>

#include "io/file/byte_source.h"

namespace rattan {

enum class PlyType : std::uint8_t {
  kInt8,
  kUint8,
  kInt16,
  kUint16,
  kInt32,
  kUint32,
  kFloat32,
  kFloat64,
  kInt64,  // the 64-bit integers are beyond the original types; some writers of huge scans use them
  kUint64,
};

/// Bytes of one value.
std::size_t ply_size(PlyType type);
inline bool ply_is_integer(PlyType type) {
  return type != PlyType::kFloat32 && type != PlyType::kFloat64;
}

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::kFloat32;
  bool is_list = false;
  PlyType count_type = PlyType::kUint8;
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;

  std::size_t list_count() const;
  bool has_list() const { return list_count() > 0; }
  /// Bytes of a record's scalar properties and list counts: its size if no list holds anything.
  std::uint64_t least_bytes() const { return bytes_before(static_cast<int>(properties.size())); }
  /// Likewise of the properties before the k-th: where that begins.
  std::uint64_t bytes_before(int k) const;
  /// Position among the properties; -1 if there is none of that name.
  int find(std::string_view property) const;
};

enum class PlyEncoding : std::uint8_t { kAscii, kLittleEndian, kBigEndian };

struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::kAscii;
  std::vector<PlyElement> elements;

  const PlyElement* find(std::string_view element) const;
};

/// Leaves the source at the first byte after the header. Throws InputError.
PlyHeader read_ply_header(ByteSource& source);

}  // namespace rattan
