// SPDX-License-Identifier: MIT
//
// Based on: the VTK file formats' description of VTKHDF, and what the reader of VTK 9.1 asks for:
// one-dimensional datasets for scalars, texts of variable length, a Type of fixed length.
#include "io/export/vtkhdf_writer.h"

#include <algorithm>
#include <utility>

#include "engine/core/errors.h"
#include "engine/core/memory_budget.h"
#include "io/file/atomic_file.h"
#include "io/store/checksum.h"
#include "io/store/hdf5_handles.h"
#include "io/store/stage_file.h"

namespace rattan {

using hdf5::Handle;
using hdf5::Session;

namespace {

constexpr const char* kRemedy = "Check the disk, or write elsewhere.";
constexpr std::uint8_t kVtkTriangle = 5;
constexpr std::uint64_t kCorners = 3;

hid_t type_of(ArrayType type) {
  switch (type) {
    case ArrayType::kUint8:
      return H5T_STD_U8LE;
    case ArrayType::kInt32:
      return H5T_STD_I32LE;
    case ArrayType::kInt64:
      return H5T_STD_I64LE;
    case ArrayType::kFloat:
      return H5T_IEEE_F32LE;
    case ArrayType::kDouble:
      return H5T_IEEE_F64LE;
  }
  throw InternalError("an array has a type");
}

Handle file_access() {
  Handle access(H5Pcreate(H5P_FILE_ACCESS));
  H5Pset_fclose_degree(access.get(), H5F_CLOSE_STRONG);
  // Readable since HDF5 1.8, with checksums on the library's own records.
  H5Pset_libver_bounds(access.get(), H5F_LIBVER_V18, H5F_LIBVER_V18);
  // AtomicFile has locked it, and network file systems often lack locks.
  H5Pset_file_locking(access.get(), false, true);
  return access;
}

/// The same bytes whenever they are written.
Handle without_times(hid_t kind) {
  Handle properties(H5Pcreate(kind));
  H5Pset_obj_track_times(properties.get(), false);
  return properties;
}

Handle contiguous() {
  Handle properties = without_times(H5P_DATASET_CREATE);
  H5Pset_layout(properties.get(), H5D_CONTIGUOUS);
  // Every row gets written: no need to fill the space before.
  H5Pset_fill_time(properties.get(), H5D_FILL_TIME_NEVER);
  H5Pset_alloc_time(properties.get(), H5D_ALLOC_TIME_EARLY);
  return properties;
}

}  // namespace

class VtkHdfWriter::File {
 public:
  File(const std::string& path, std::uint64_t points, std::uint64_t triangles)
      : target_(path), points_(points), triangles_(triangles) {
    const Session session;
    file_ = Handle(H5Fcreate(target_.temporary_path().c_str(), H5F_ACC_TRUNC,
                             without_times(H5P_FILE_CREATE).get(), file_access().get()));
    check(file_.valid(), "create");
    const Handle grouping = without_times(H5P_GROUP_CREATE);
    for (const char* name :
         {"/VTKHDF", "/VTKHDF/PointData", "/VTKHDF/CellData", "/VTKHDF/FieldData"}) {
      const Handle group(H5Gcreate2(file_.get(), name, H5P_DEFAULT, grouping.get(), H5P_DEFAULT));
      check(group.valid(), "create a group in");
      if (std::string_view(name) == "/VTKHDF") {
        describe(group.get());
      }
    }
    write_count("NumberOfPoints", points_);
    write_count("NumberOfCells", triangles_);
    write_count("NumberOfConnectivityIds", kCorners * triangles_);
    position_array_ = create("/VTKHDF/", {"Points", ArrayType::kDouble, 3}, points_);
    corner_array_ =
        create("/VTKHDF/", {"Connectivity", ArrayType::kInt64, 1}, kCorners * triangles_);
    offset_array_ = create("/VTKHDF/", {"Offsets", ArrayType::kInt64, 1}, triangles_ + 1);
    type_array_ = create("/VTKHDF/", {"Types", ArrayType::kUint8, 1}, triangles_);
    const std::int64_t zero = 0;
    write_rows(offset_array_, 0, std::as_bytes(std::span(&zero, 1)));
  }

  std::size_t add_array(Place place, const DataArray& array) {
    const Session session;
    return place == Place::kPoint ? create("/VTKHDF/PointData/", array, points_)
                                  : create("/VTKHDF/CellData/", array, triangles_);
  }

  void write_field(const std::string& name, hid_t type, const std::vector<hsize_t>& extent,
                   const void* values) {
    const Session session;
    write_small("/VTKHDF/FieldData/" + name, type, extent, values);
  }

  void write_texts(const std::string& name, const std::vector<std::string>& texts) {
    const Session session;
    const Handle type(H5Tcopy(H5T_C_S1));
    H5Tset_size(type.get(), H5T_VARIABLE);
    std::vector<const char*> pointers;
    pointers.reserve(texts.size());
    for (const std::string& text : texts) {
      pointers.push_back(text.c_str());
    }
    write_small("/VTKHDF/FieldData/" + name, type.get(), {texts.size()}, pointers.data());
  }

  void write_positions(std::uint64_t first, std::span<const Vec3d> positions) {
    const Session session;
    write_rows(position_array_, first, std::as_bytes(positions));
  }

  void write_triangles(std::uint64_t first, std::span<const std::array<std::int64_t, 3>> corners) {
    const Session session;
    write_rows(corner_array_, kCorners * first, std::as_bytes(corners));
    std::vector<std::int64_t> ends(corners.size());
    for (std::size_t i = 0; i < ends.size(); ++i) {
      ends[i] = static_cast<std::int64_t>(kCorners * (first + i + 1));
    }
    write_rows(offset_array_, first + 1, std::as_bytes(std::span(ends)));
    const std::vector<std::uint8_t> types(corners.size(), kVtkTriangle);
    write_rows(type_array_, first, std::as_bytes(std::span(types)));
  }

  void write(std::size_t array, std::uint64_t first, std::span<const std::byte> rows) {
    const Session session;
    write_rows(array, first, rows);
  }

  void commit() {
    {
      const Session session;
      for (Array& a : arrays_) {
        ensure(a.written == a.rows, "all rows of an export are written");
        a.dataset = Handle();
      }
      const bool closed = H5Fflush(file_.get(), H5F_SCOPE_GLOBAL) >= 0;
      check(closed, "write");
      file_ = Handle();
      file_ =
          Handle(H5Fopen(target_.temporary_path().c_str(), H5F_ACC_RDONLY, file_access().get()));
      check(file_.valid(), "read back");
    }
    verify();
    {
      const Session session;
      for (Array& a : arrays_) {
        a.dataset = Handle();
      }
      file_ = Handle();
    }
    target_.commit();
  }

  std::uint64_t data_bytes() const {
    std::uint64_t bytes = 0;
    for (const Array& a : arrays_) {
      bytes += a.rows * a.spec.row_bytes();
    }
    return bytes;
  }

  ~File() {
    const Session session;
    for (Array& a : arrays_) {
      a.dataset = Handle();
    }
    file_ = Handle();
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;

 private:
  struct Array {
    DataArray spec;
    std::string path;
    std::uint64_t rows = 0;
    std::uint64_t written = 0;
    Handle dataset;
  };
  struct Block {
    std::size_t array = 0;
    std::uint64_t first = 0;
    std::uint64_t rows = 0;
    std::uint64_t sum = 0;
  };

  void check(bool done, const char* what) const {
    if (done) {
      return;
    }
    try {
      hdf5::fail(target_.path(), std::string(what) + " the file", kRemedy);
    } catch (const DiskFull&) {
      throw ResourceError(target_.path() + ": the disk is full; the file takes " +
                          format_bytes(data_bytes()) + ". Make room, or write elsewhere.");
    }
  }

  void describe(hid_t group) {
    const std::array<std::int64_t, 2> version{1, 0};
    const hsize_t two = 2;
    const Handle pair(H5Screate_simple(1, &two, nullptr));
    const Handle numbers(
        H5Acreate2(group, "Version", H5T_STD_I64LE, pair.get(), H5P_DEFAULT, H5P_DEFAULT));
    check(numbers.valid() && H5Awrite(numbers.get(), H5T_NATIVE_INT64, version.data()) >= 0,
          "describe");
    const std::string kind = "UnstructuredGrid";
    const Handle text(H5Tcopy(H5T_C_S1));
    H5Tset_size(text.get(), kind.size());
    H5Tset_strpad(text.get(), H5T_STR_NULLPAD);
    const Handle scalar(H5Screate(H5S_SCALAR));
    const Handle type(
        H5Acreate2(group, "Type", text.get(), scalar.get(), H5P_DEFAULT, H5P_DEFAULT));
    check(type.valid() && H5Awrite(type.get(), text.get(), kind.data()) >= 0, "describe");
  }

  void write_count(const char* name, std::uint64_t count) {
    const auto value = static_cast<std::int64_t>(count);
    write_small(std::string("/VTKHDF/") + name, H5T_STD_I64LE, {1}, &value);
  }

  void write_small(const std::string& path, hid_t type, const std::vector<hsize_t>& extent,
                   const void* values) {
    const Handle space(H5Screate_simple(static_cast<int>(extent.size()), extent.data(), nullptr));
    const Handle creation = without_times(H5P_DATASET_CREATE);
    const Handle dataset(H5Dcreate2(file_.get(), path.c_str(), type, space.get(), H5P_DEFAULT,
                                    creation.get(), H5P_DEFAULT));
    check(dataset.valid() &&
              H5Dwrite(dataset.get(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) >= 0,
          "write");
  }

  std::size_t create(const std::string& folder, const DataArray& spec, std::uint64_t rows) {
    Array& a = arrays_.emplace_back();
    a.spec = spec;
    a.path = folder + spec.name;
    a.rows = rows;
    const std::array<hsize_t, 2> extent{rows, static_cast<hsize_t>(spec.components)};
    // VTK takes a second dimension for components only where there are several.
    const Handle space(H5Screate_simple(spec.components > 1 ? 2 : 1, extent.data(), nullptr));
    a.dataset = Handle(H5Dcreate2(file_.get(), a.path.c_str(), type_of(spec.type), space.get(),
                                  H5P_DEFAULT, contiguous().get(), H5P_DEFAULT));
    check(a.dataset.valid(), "make room in");
    return arrays_.size() - 1;
  }

  /// Selects rows of a dataset; the memory's space is returned.
  static Handle select(const Array& a, std::uint64_t first, std::uint64_t rows,
                       const Handle& space) {
    const std::array<hsize_t, 2> start{first, 0};
    const std::array<hsize_t, 2> count{rows, static_cast<hsize_t>(a.spec.components)};
    H5Sselect_hyperslab(space.get(), H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr);
    return Handle(H5Screate_simple(a.spec.components > 1 ? 2 : 1, count.data(), nullptr));
  }

  void write_rows(std::size_t array, std::uint64_t first, std::span<const std::byte> bytes) {
    Array& a = arrays_[array];
    const std::size_t row = a.spec.row_bytes();
    const std::uint64_t rows = bytes.size() / row;
    ensure(rows * row == bytes.size() && first + rows <= a.rows, "a block lies in its array");
    if (rows == 0) {
      return;
    }
    const Handle space(H5Dget_space(a.dataset.get()));
    const Handle memory = select(a, first, rows, space);
    check(H5Dwrite(a.dataset.get(), type_of(a.spec.type), memory.get(), space.get(), H5P_DEFAULT,
                   bytes.data()) >= 0,
          "write");
    a.written += rows;
    blocks_.push_back({array, first, rows, checksum(bytes, first)});
  }

  void verify() {
    std::vector<std::byte> bytes;
    for (const Block& b : blocks_) {
      const Session session;
      Array& a = arrays_[b.array];
      if (!a.dataset.valid()) {
        a.dataset = Handle(H5Dopen2(file_.get(), a.path.c_str(), H5P_DEFAULT));
      }
      bytes.resize(b.rows * a.spec.row_bytes());
      bool same = a.dataset.valid();
      if (same) {
        const Handle space(H5Dget_space(a.dataset.get()));
        const Handle memory = select(a, b.first, b.rows, space);
        same = H5Dread(a.dataset.get(), type_of(a.spec.type), memory.get(), space.get(),
                       H5P_DEFAULT, bytes.data()) >= 0 &&
               checksum(bytes, b.first) == b.sum;
      }
      if (!same) {
        throw ResourceError(target_.path() + ": what was written to " + a.path +
                            " doesn't come back as it was. " + kRemedy);
      }
    }
  }

  AtomicFile target_;
  std::uint64_t points_;
  std::uint64_t triangles_;
  Handle file_;
  std::vector<Array> arrays_;
  std::vector<Block> blocks_;
  std::size_t position_array_ = 0;
  std::size_t corner_array_ = 0;
  std::size_t offset_array_ = 0;
  std::size_t type_array_ = 0;
};

VtkHdfWriter::VtkHdfWriter(const std::string& path, std::uint64_t points, std::uint64_t triangles)
    : file_(std::make_unique<File>(path, points, triangles)) {}

VtkHdfWriter::~VtkHdfWriter() = default;

std::size_t VtkHdfWriter::add_array(Place place, const DataArray& array) {
  return file_->add_array(place, array);
}

void VtkHdfWriter::add_field(const std::string& name, std::span<const double> values,
                             int components) {
  const auto width = static_cast<std::size_t>(components);
  std::vector<hsize_t> extent{values.size() / width};
  if (components > 1) {
    extent.push_back(width);
  }
  file_->write_field(name, H5T_IEEE_F64LE, extent, values.data());
}

void VtkHdfWriter::add_field(const std::string& name, std::span<const std::int64_t> values) {
  file_->write_field(name, H5T_STD_I64LE, {values.size()}, values.data());
}

void VtkHdfWriter::add_field(const std::string& name, const std::vector<std::string>& texts) {
  file_->write_texts(name, texts);
}

void VtkHdfWriter::write_points(std::uint64_t first, std::span<const Vec3d> positions) {
  file_->write_positions(first, positions);
}

void VtkHdfWriter::write_triangles(std::uint64_t first,
                                   std::span<const std::array<std::int64_t, 3>> corners) {
  file_->write_triangles(first, corners);
}

void VtkHdfWriter::write(std::size_t array, std::uint64_t first, std::span<const std::byte> rows) {
  file_->write(array, first, rows);
}

void VtkHdfWriter::commit() {
  file_->commit();
}

std::uint64_t VtkHdfWriter::data_bytes() const {
  return file_->data_bytes();
}

}  // namespace rattan
