// SPDX-License-Identifier: MIT
#pragma once

// Triangles with data at points and cells as a VTKHDF file (version 1.0, an UnstructuredGrid of one
// piece), as VTK 9.1 and ParaView 5.10 read it and those that came later. Written in blocks, in any
// order of arrays: memory is that of a block, whatever the size of the file.

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/core/types.h"

namespace rattan {

enum class ArrayType : std::uint8_t { kUint8, kInt32, kInt64, kFloat, kDouble };

constexpr std::size_t type_bytes(ArrayType type) {
  return type == ArrayType::kUint8                                ? 1
         : type == ArrayType::kInt32 || type == ArrayType::kFloat ? 4
                                                                  : 8;
}

struct DataArray {
  std::string name;
  ArrayType type = ArrayType::kDouble;
  int components = 1;  ///< of six: xx, yy, zz, xy, yz, xz of a symmetric tensor

  std::size_t row_bytes() const { return type_bytes(type) * static_cast<std::size_t>(components); }
};

class VtkHdfWriter {
 public:
  enum class Place : std::uint8_t { kPoint, kCell };

  /// Throws InputError or ResourceError where the file cannot be made.
  VtkHdfWriter(const std::string& path, std::uint64_t points, std::uint64_t triangles);
  ~VtkHdfWriter();
  VtkHdfWriter(const VtkHdfWriter&) = delete;
  VtkHdfWriter& operator=(const VtkHdfWriter&) = delete;

  /// Before the first block is written. Returns the array's number.
  std::size_t add_array(Place place, const DataArray& array);
  /// Arrays without places: tuples of `components` numbers, or texts.
  void add_field(const std::string& name, std::span<const double> values, int components = 1);
  void add_field(const std::string& name, std::span<const std::int64_t> values);
  void add_field(const std::string& name, const std::vector<std::string>& texts);

  /// Blocks of rows [first, first + size). All rows of all arrays have to be written, once. Throw
  /// ResourceError when the disk is full.
  void write_points(std::uint64_t first, std::span<const Vec3d> positions);
  void write_triangles(std::uint64_t first, std::span<const std::array<std::int64_t, 3>> corners);
  void write(std::size_t array, std::uint64_t first, std::span<const std::byte> rows);

  /// Reads all blocks back, compares, and gives the file its name. Call once, last. Throws
  /// ResourceError.
  void commit();
  /// Bytes of all arrays as declared so far.
  std::uint64_t data_bytes() const;

 private:
  class File;
  std::unique_ptr<File> file_;
};

}  // namespace rattan
