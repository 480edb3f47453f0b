// SPDX-License-Identifier: MIT
#include "io/export/vtkhdf_writer.h"

#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <hdf5.h>

#include "engine/core/errors.h"
#include "io/file/atomic_file.h"

namespace rattan {
namespace {

namespace fs = std::filesystem;
using Place = VtkHdfWriter::Place;

class VtkHdfWriterTest : public ::testing::Test {
 protected:
  VtkHdfWriterTest() {
    std::string name = (fs::temp_directory_path() / "rattan_vtkhdf_XXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  ~VtkHdfWriterTest() override { fs::remove_all(folder_); }
  std::string path(const std::string& name = "a.vtkhdf") const { return (folder_ / name).string(); }

  fs::path folder_;
};

constexpr std::uint64_t kPoints = 7;
constexpr std::uint64_t kTriangles = 5;

std::vector<Vec3d> positions() {
  std::vector<Vec3d> p;
  for (std::size_t i = 0; i < kPoints; ++i) {
    p.emplace_back(1e6 + 0.1 * static_cast<double>(i), -2.0, 1.0 / static_cast<double>(i + 3));
  }
  return p;
}

std::vector<std::array<std::int64_t, 3>> triangles() {
  std::vector<std::array<std::int64_t, 3>> t;
  for (std::int64_t i = 0; i < static_cast<std::int64_t>(kTriangles); ++i) {
    t.push_back({i, i + 1, i + 2});
  }
  return t;
}

template <class T>
std::vector<std::byte> rows(std::size_t count, std::size_t width) {
  std::vector<T> values(count * width);
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = static_cast<T>(3 * i + 1);
  }
  const auto bytes = std::as_bytes(std::span(values));
  return {bytes.begin(), bytes.end()};
}

/// In blocks of `step` rows, the last block first.
template <class Write>
void in_blocks(std::uint64_t count, std::uint64_t step, const Write& write) {
  for (std::uint64_t first = (count - 1) / step * step;; first -= step) {
    write(first, std::min(step, count - first));
    if (first == 0) {
      return;
    }
  }
}

void write_file(const std::string& path, std::uint64_t step) {
  fs::remove(path);
  VtkHdfWriter file(path, kPoints, kTriangles);
  const std::size_t flags = file.add_array(Place::kPoint, {"flag", ArrayType::kUint8, 1});
  const std::size_t vectors = file.add_array(Place::kPoint, {"vector", ArrayType::kFloat, 3});
  const std::size_t tiles = file.add_array(Place::kCell, {"tile", ArrayType::kInt32, 1});
  const std::size_t energies = file.add_array(Place::kCell, {"energy", ArrayType::kDouble, 1});
  file.add_field("origin", std::vector<double>{1.0, 2.0, 3.0}, 3);
  file.add_field("counts", std::vector<std::int64_t>{4, 5});
  file.add_field("words", {"one", "and another"});
  const auto p = positions();
  const auto t = triangles();
  const auto part = [](const std::vector<std::byte>& all, std::uint64_t first, std::uint64_t n,
                       std::size_t row) {
    return std::span<const std::byte>(all).subspan(first * row, n * row);
  };
  in_blocks(kPoints, step, [&](std::uint64_t first, std::uint64_t n) {
    file.write_points(first, std::span(p).subspan(first, n));
    file.write(flags, first, part(rows<std::uint8_t>(kPoints, 1), first, n, 1));
    file.write(vectors, first, part(rows<float>(kPoints, 3), first, n, 12));
  });
  in_blocks(kTriangles, step, [&](std::uint64_t first, std::uint64_t n) {
    file.write_triangles(first, std::span(t).subspan(first, n));
    file.write(tiles, first, part(rows<std::int32_t>(kTriangles, 1), first, n, 4));
    file.write(energies, first, part(rows<double>(kTriangles, 1), first, n, 8));
  });
  EXPECT_EQ(file.data_bytes(),
            kPoints * (24 + 1 + 12) + kTriangles * (24 + 8 + 1 + 4 + 8) + sizeof(std::int64_t));
  EXPECT_FALSE(fs::exists(path));
  file.commit();
}

/// All rows of a dataset as numbers of the memory's type, and its extent.
template <class T>
std::vector<T> read_all(hid_t file, const char* path, hid_t type, std::vector<hsize_t>& extent) {
  const hid_t set = H5Dopen2(file, path, H5P_DEFAULT);
  const hid_t space = H5Dget_space(set);
  extent.resize(static_cast<std::size_t>(H5Sget_simple_extent_ndims(space)));
  H5Sget_simple_extent_dims(space, extent.data(), nullptr);
  std::vector<T> values(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
  EXPECT_GE(H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0) << path;
  H5Sclose(space);
  H5Dclose(set);
  return values;
}

TEST_F(VtkHdfWriterTest, HoldsWhatTheFormatAsksFor) {
  write_file(path(), 3);
  const hid_t file = H5Fopen(path().c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  ASSERT_GE(file, 0);
  const hid_t group = H5Gopen2(file, "/VTKHDF", H5P_DEFAULT);
  std::array<std::int64_t, 2> version{};
  const hid_t version_attribute = H5Aopen(group, "Version", H5P_DEFAULT);
  H5Aread(version_attribute, H5T_NATIVE_INT64, version.data());
  EXPECT_EQ(version, (std::array<std::int64_t, 2>{1, 0}));
  H5Aclose(version_attribute);
  const hid_t type_attribute = H5Aopen(group, "Type", H5P_DEFAULT);
  const hid_t type = H5Aget_type(type_attribute);
  EXPECT_EQ(H5Tget_class(type), H5T_STRING);
  EXPECT_EQ(H5Tis_variable_str(type), 0);
  EXPECT_EQ(H5Tget_cset(type), H5T_CSET_ASCII);
  std::string text(H5Tget_size(type), '\0');
  H5Aread(type_attribute, type, text.data());
  EXPECT_EQ(text, "UnstructuredGrid");
  H5Tclose(type);
  H5Aclose(type_attribute);
  H5Gclose(group);

  using Extent = std::vector<hsize_t>;
  Extent extent;
  const auto count = [&](const char* name) {
    const auto n = read_all<std::int64_t>(file, name, H5T_NATIVE_INT64, extent);
    EXPECT_EQ(extent, Extent{1});
    return static_cast<std::uint64_t>(n[0]);
  };
  EXPECT_EQ(count("/VTKHDF/NumberOfPoints"), kPoints);
  EXPECT_EQ(count("/VTKHDF/NumberOfCells"), kTriangles);
  EXPECT_EQ(count("/VTKHDF/NumberOfConnectivityIds"), 3 * kTriangles);
  const auto p = read_all<double>(file, "/VTKHDF/Points", H5T_NATIVE_DOUBLE, extent);
  EXPECT_EQ(extent, (Extent{kPoints, 3}));
  EXPECT_EQ(std::memcmp(p.data(), positions().data(), sizeof(double) * p.size()), 0);
  const auto ids = read_all<std::int64_t>(file, "/VTKHDF/Connectivity", H5T_NATIVE_INT64, extent);
  EXPECT_EQ(extent, Extent{3 * kTriangles});
  EXPECT_EQ(std::memcmp(ids.data(), triangles().data(), sizeof(std::int64_t) * ids.size()), 0);
  EXPECT_EQ(read_all<std::int64_t>(file, "/VTKHDF/Offsets", H5T_NATIVE_INT64, extent),
            (std::vector<std::int64_t>{0, 3, 6, 9, 12, 15}));
  EXPECT_EQ(read_all<std::uint8_t>(file, "/VTKHDF/Types", H5T_NATIVE_UINT8, extent),
            (std::vector<std::uint8_t>{5, 5, 5, 5, 5}));
  EXPECT_EQ(read_all<int>(file, "/VTKHDF/PointData/vector", H5T_NATIVE_INT, extent)[20], 61);
  EXPECT_EQ(extent, (Extent{kPoints, 3}));
  EXPECT_EQ(read_all<int>(file, "/VTKHDF/PointData/flag", H5T_NATIVE_INT, extent)[6], 19);
  EXPECT_EQ(extent, Extent{kPoints});
  EXPECT_EQ(read_all<int>(file, "/VTKHDF/CellData/tile", H5T_NATIVE_INT, extent),
            (std::vector<int>{1, 4, 7, 10, 13}));
  EXPECT_EQ(read_all<int>(file, "/VTKHDF/CellData/energy", H5T_NATIVE_INT, extent),
            (std::vector<int>{1, 4, 7, 10, 13}));
  EXPECT_EQ(read_all<int>(file, "/VTKHDF/FieldData/origin", H5T_NATIVE_INT, extent),
            (std::vector<int>{1, 2, 3}));
  EXPECT_EQ(extent, (Extent{1, 3}));
  EXPECT_EQ(read_all<int>(file, "/VTKHDF/FieldData/counts", H5T_NATIVE_INT, extent),
            (std::vector<int>{4, 5}));
  const hid_t memory = H5Tcopy(H5T_C_S1);
  H5Tset_size(memory, H5T_VARIABLE);
  const auto words = read_all<char*>(file, "/VTKHDF/FieldData/words", memory, extent);
  ASSERT_EQ(extent, Extent{2});
  EXPECT_STREQ(words[0], "one");
  EXPECT_STREQ(words[1], "and another");
  for (char* word : words) {
    H5free_memory(word);
  }
  H5Tclose(memory);
  H5Fclose(file);
}

TEST_F(VtkHdfWriterTest, BytesDoNotDependOnBlocks) {
  write_file(path(), 2);
  const std::string bytes = read_file(path());
  for (const std::uint64_t step : {1U, 3U, 100U}) {
    write_file(path("b.vtkhdf"), step);
    EXPECT_EQ(read_file(path("b.vtkhdf")), bytes) << step;
  }
}

TEST_F(VtkHdfWriterTest, WithoutCommitThereIsNoFile) {
  {
    VtkHdfWriter file(path(), kPoints, kTriangles);
    file.add_array(Place::kPoint, {"flag", ArrayType::kUint8, 1});
    file.write_points(0, positions());
  }
  EXPECT_TRUE(fs::is_empty(folder_));
}

TEST_F(VtkHdfWriterTest, RowsThatAreMissingOrTooManyAreNoticed) {
  {
    VtkHdfWriter file(path(), kPoints, kTriangles);
    file.write_points(0, positions());
    const auto t = triangles();
    file.write_triangles(0, std::span(t).first(4));
    EXPECT_THROW(file.commit(), InternalError);
  }
  VtkHdfWriter file(path(), kPoints, kTriangles);
  EXPECT_THROW(file.write_points(1, positions()), InternalError);
  const std::size_t array = file.add_array(Place::kPoint, {"vector", ArrayType::kFloat, 3});
  EXPECT_THROW(file.write(array, 0, rows<std::uint8_t>(13, 1)), InternalError);
}

TEST_F(VtkHdfWriterTest, OneWriterAtATime) {
  const VtkHdfWriter file(path(), kPoints, kTriangles);
  EXPECT_THROW(VtkHdfWriter(path(), kPoints, kTriangles), ResourceError);
  EXPECT_THROW(VtkHdfWriter(path("none/a.vtkhdf"), 1, 1), InputError);
}

}  // namespace
}  // namespace rattan
