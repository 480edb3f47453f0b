// SPDX-License-Identifier: MIT
#include "io/store/stage_file.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <unistd.h>
#include <utility>

#include "engine/core/errors.h"
#include "io/store/checksum.h"
#include "io/store/hdf5_handles.h"

namespace rattan {

namespace fs = std::filesystem;
using hdf5::Handle;
using hdf5::Session;

namespace {

constexpr hsize_t kHdf5Chunk = std::size_t{256} << 10;
constexpr const char* kIndexChecksum = "index_checksum";
constexpr std::uint64_t kOdd = 0x9e3779b97f4a7c15U;
constexpr const char* kFormat = "rattan_store";
constexpr const char* kFormatValue = "2";

Handle access_properties() {
  Handle access(H5Pcreate(H5P_FILE_ACCESS));
  H5Pset_fclose_degree(access.get(), H5F_CLOSE_STRONG);
  // The latest format carries checksums on all its own records.
  H5Pset_libver_bounds(access.get(), H5F_LIBVER_LATEST, H5F_LIBVER_LATEST);
  // Network file systems often lack locks; a job owns its work directory.
  H5Pset_file_locking(access.get(), false, true);
  H5AC_cache_config_t config;
  config.version = H5AC__CURR_CACHE_CONFIG_VERSION;
  if (H5Pget_mdc_config(access.get(), &config) >= 0) {
    config.set_initial_size = true;
    config.initial_size = std::size_t{512} << 10;
    config.min_size = std::size_t{256} << 10;
    config.max_size = std::size_t{1} << 20;
    H5Pset_mdc_config(access.get(), &config);
  }
  return access;
}

/// No chunk cache: our chunks go straight to the file.
Handle dataset_access() {
  Handle access(H5Pcreate(H5P_DATASET_ACCESS));
  H5Pset_chunk_cache(access.get(), 0, 0, 0.0);
  return access;
}

std::string group_of(const std::string& field) {
  std::string name = field;
  for (char& c : name) {
    c = c == '/' ? '.' : c;
  }
  return "/" + name;
}

[[noreturn]] void damaged(const fs::path& path, const std::string& what) {
  throw DamagedFile(path, "", what);
}

void write_string(hid_t object, const std::string& name, const std::string& value,
                  const std::string& path) {
  const Handle type(H5Tcopy(H5T_C_S1));
  H5Tset_size(type.get(), value.size() + 1);
  const Handle space(H5Screate(H5S_SCALAR));
  const Handle attribute(
      H5Acreate2(object, name.c_str(), type.get(), space.get(), H5P_DEFAULT, H5P_DEFAULT));
  if (!attribute.valid() || H5Awrite(attribute.get(), type.get(), value.c_str()) < 0) {
    hdf5::fail(path, "write attribute " + name);
  }
}

std::string read_string(hid_t object, const char* name, const fs::path& path) {
  const Handle attribute(H5Aopen(object, name, H5P_DEFAULT));
  const Handle type(attribute.valid() ? H5Aget_type(attribute.get()) : -1);
  if (!type.valid() || H5Tget_class(type.get()) != H5T_STRING ||
      H5Tis_variable_str(type.get()) > 0) {
    damaged(path, std::string("attribute ") + name + " is missing or no text");
  }
  std::string value(H5Tget_size(type.get()), '\0');
  if (H5Aread(attribute.get(), type.get(), value.data()) < 0) {
    damaged(path, std::string("attribute ") + name + " cannot be read");
  }
  value.resize(std::strlen(value.c_str()));
  return value;
}

extern "C" {
herr_t collect_link(hid_t, const char* name, const H5L_info_t*, void* names) {
  static_cast<std::vector<std::string>*>(names)->emplace_back(name);
  return 0;
}
}

bool exists(hid_t file, const std::string& name) {
  return H5Lexists(file, name.c_str(), H5P_DEFAULT) > 0;
}

std::uint64_t index_checksum(const std::string& field, const std::vector<ChunkRecord>& records) {
  const std::uint64_t seed = checksum(std::as_bytes(std::span(field)));
  return checksum(std::as_bytes(std::span(records)), seed);
}

}  // namespace

DamagedFile::DamagedFile(const fs::path& path, const std::string& place, const std::string& what)
    : InputError(path.string(), place, what, "The file is damaged; run the job again"),
      path_(path) {}

void sync_path(const fs::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  bool synced = descriptor >= 0 && ::fsync(descriptor) == 0;
  const int error = errno;
  // Some network file systems cannot sync a directory; its changes are there all the same.
  synced = synced || (descriptor >= 0 && error == EINVAL && fs::is_directory(path));
  if (descriptor >= 0) {
    ::close(descriptor);
  }
  if (!synced) {
    const bool full = error == ENOSPC || error == EDQUOT || error == EFBIG;
    const std::string text =
        path.string() + ": cannot be synced to disk (" + std::strerror(error) + ")";
    if (full) {
      throw DiskFull(text);
    }
    throw ResourceError(text + ". Check the disk, or choose another directory with --work-dir.");
  }
}

StageFile::~StageFile() {
  const fs::path at = path();
  close();
  if (discarded_ || !committed_) {
    std::error_code ignored;
    fs::remove(at, ignored);
  }
}

fs::path StageFile::path() const {
  fs::path p = path_;
  if (!committed_) {
    p += kPartialSuffix;
  }
  return p;
}

std::unique_ptr<StageFile> StageFile::create(const fs::path& path) {
  std::unique_ptr<StageFile> file(new StageFile(path));
  const Session session;
  const Handle access = access_properties();
  const Handle creation(H5Pcreate(H5P_FILE_CREATE));
  H5Pset_obj_track_times(creation.get(), false);  // of the root group
  file->file_ = H5Fcreate(file->path().c_str(), H5F_ACC_TRUNC, creation.get(), access.get());
  if (file->file_ < 0) {
    hdf5::fail(file->path().string(), "create the file");
  }
  return file;
}

std::unique_ptr<StageFile> StageFile::open(const fs::path& path) {
  std::unique_ptr<StageFile> file(new StageFile(path));
  file->committed_ = true;
  file->sealed_ = true;
  const Session session;
  try {
    file->open_sealed();
    file->load_contents();
  } catch (const DamagedFile&) {
    throw;
  } catch (const std::exception& e) {  // a count that cannot be
    damaged(path, e.what());
  }
  return file;
}

void StageFile::open_sealed() {
  const Handle access = access_properties();
  file_ = H5Fopen(path().c_str(), H5F_ACC_RDONLY, access.get());
  if (file_ < 0) {
    damaged(path(), "this is not a readable HDF5 file");
  }
}

void StageFile::close() noexcept {
  if (file_ >= 0) {
    try {
      const Session session;
      for (const auto& [name, set] : datasets_) {
        H5Dclose(set.id);
      }
      H5Fclose(file_);
      H5Eclear2(H5E_DEFAULT);
    } catch (...) {  // nothing more can be done for a file that does not close
    }
  }
  datasets_.clear();
  file_ = -1;
}

StageFile::Dataset& StageFile::dataset(const std::string& field, bool may_create) {
  const auto known = datasets_.find(field);
  if (known != datasets_.end()) {
    return known->second;
  }
  const std::string name = group_of(field) + "/data";
  const Handle access = dataset_access();
  Dataset set;
  if (!may_create || exists(file_, group_of(field))) {
    set.id = H5Dopen2(file_, name.c_str(), access.get());
    if (set.id < 0) {
      damaged(path(), "the data of " + field + " cannot be opened");
    }
    const Handle space(H5Dget_space(set.id));
    set.bytes = static_cast<std::uint64_t>(H5Sget_simple_extent_npoints(space.get()));
  } else {
    const hsize_t size = 0;
    const hsize_t unlimited = H5S_UNLIMITED;
    const Handle space(H5Screate_simple(1, &size, &unlimited));
    const Handle creation(H5Pcreate(H5P_DATASET_CREATE));
    H5Pset_chunk(creation.get(), 1, &kHdf5Chunk);
    H5Pset_obj_track_times(creation.get(), false);  // equal work gives equal files
    H5Pset_fill_time(creation.get(), H5D_FILL_TIME_NEVER);
    const Handle group_creation(H5Pcreate(H5P_GROUP_CREATE));
    H5Pset_obj_track_times(group_creation.get(), false);
    const Handle group(
        H5Gcreate2(file_, group_of(field).c_str(), H5P_DEFAULT, group_creation.get(), H5P_DEFAULT));
    set.id = H5Dcreate2(file_, name.c_str(), H5T_NATIVE_UINT8, space.get(), H5P_DEFAULT,
                        creation.get(), access.get());
    if (set.id < 0) {
      hdf5::fail(path().string(), "create field " + field);
    }
  }
  return datasets_.emplace(field, set).first->second;
}

std::uint64_t StageFile::append(const std::string& field, std::span<const std::byte> bytes) {
  std::uint64_t offset = 0;
  {
    const Session session;
    Dataset& set = dataset(field, true);
    offset = set.bytes;
    const hsize_t size = offset + bytes.size();
    if (H5Dset_extent(set.id, &size) < 0) {
      hdf5::fail(path().string(), "extend field " + field);
    }
    set.bytes = size;
    live_bytes_ += bytes.size();
    most_bytes_ = std::max(most_bytes_, live_bytes_);
  }
  overwrite(field, offset, bytes);
  return offset;
}

void StageFile::overwrite(const std::string& field, std::uint64_t offset,
                          std::span<const std::byte> bytes) {
  if (bytes.empty()) {
    return;
  }
  const Session session;
  const Dataset& set = dataset(field, false);
  const hsize_t start = offset;
  const hsize_t count = bytes.size();
  const Handle file_space(H5Dget_space(set.id));
  const Handle memory_space(H5Screate_simple(1, &count, nullptr));
  if (H5Sselect_hyperslab(file_space.get(), H5S_SELECT_SET, &start, nullptr, &count, nullptr) < 0 ||
      H5Dwrite(set.id, H5T_NATIVE_UINT8, memory_space.get(), file_space.get(), H5P_DEFAULT,
               bytes.data()) < 0) {
    hdf5::fail(path().string(), "write field " + field);
  }
}

void StageFile::read(const std::string& field, std::uint64_t offset, std::span<std::byte> bytes) {
  if (bytes.empty()) {
    return;
  }
  const Session session;
  const Dataset& set = dataset(field, false);
  if (offset > set.bytes || bytes.size() > set.bytes - offset) {
    damaged(path(), "field " + field + " is shorter than its index says");
  }
  const hsize_t start = offset;
  const hsize_t count = bytes.size();
  const Handle file_space(H5Dget_space(set.id));
  const Handle memory_space(H5Screate_simple(1, &count, nullptr));
  if (H5Sselect_hyperslab(file_space.get(), H5S_SELECT_SET, &start, nullptr, &count, nullptr) < 0 ||
      H5Dread(set.id, H5T_NATIVE_UINT8, memory_space.get(), file_space.get(), H5P_DEFAULT,
              bytes.data()) < 0) {
    damaged(path(), "field " + field + " cannot be read");
  }
}

void StageFile::erase_field(const std::string& field) {
  const Session session;
  const auto known = datasets_.find(field);
  if (known != datasets_.end()) {
    live_bytes_ -= std::min<std::uint64_t>(live_bytes_, known->second.bytes);
    H5Dclose(known->second.id);
    datasets_.erase(known);
  }
  if (!exists(file_, group_of(field))) {
    return;
  }
  if (H5Ldelete(file_, group_of(field).c_str(), H5P_DEFAULT) < 0) {
    hdf5::fail(path().string(), "erase field " + field);
  }
}

void StageFile::seal(const Contents& contents) {
  ensure(!sealed_, "a stage file is sealed once");
  const std::string name = path().string();
  const Session session;
  for (const auto& [field, records] : contents) {
    if (!datasets_.contains(field)) {
      dataset(field, true);  // all its chunks are empty
    }
    const std::array<hsize_t, 2> size = {records.size(), 4};
    const Handle space(H5Screate_simple(2, size.data(), nullptr));
    const Handle creation(H5Pcreate(H5P_DATASET_CREATE));
    H5Pset_obj_track_times(creation.get(), false);
    const Handle index(H5Dcreate2(file_, (group_of(field) + "/index").c_str(), H5T_NATIVE_UINT64,
                                  space.get(), H5P_DEFAULT, creation.get(), H5P_DEFAULT));
    static_assert(sizeof(ChunkRecord) == 4 * sizeof(std::uint64_t));
    // Small data wait in a buffer, and closing would say nothing.
    if (!index.valid() ||
        H5Dwrite(index.get(), H5T_NATIVE_UINT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, records.data()) <
            0 ||
        H5Dflush(index.get()) < 0) {
      hdf5::fail(name, "write the index of " + field);
    }
    write_string(index.get(), "field", field, name);
    const std::uint64_t sum = index_checksum(field, records);
    write_string(index.get(), kIndexChecksum, std::to_string(sum), name);
    seal_sum_ = seal_sum_ * kOdd + sum;
  }
  write_string(file_, kFormat, kFormatValue, name);
  for (const auto& [field, set] : datasets_) {
    H5Dclose(set.id);
  }
  datasets_.clear();
  if (H5Fflush(file_, H5F_SCOPE_LOCAL) < 0) {
    hdf5::fail(name, "write the file");
  }
  const bool closed = H5Fclose(file_) >= 0;
  file_ = -1;
  if (!closed) {
    hdf5::fail(name, "close the file");
  }
  sealed_ = true;
  open_sealed();
}

void StageFile::commit() {
  ensure(sealed_ && !committed_, "a file is committed once it is sealed");
  const fs::path partial = path();
  sync_path(partial);
  std::error_code error;
  fs::rename(partial, path_, error);
  if (error) {
    throw ResourceError(path_.string() + ": cannot take its name (" + error.message() +
                        "). Check the directory, or choose another with --work-dir.");
  }
  committed_ = true;
}

void StageFile::load_contents() {
  if (read_string(file_, kFormat, path_) != kFormatValue) {
    damaged(path_, "this is no store file of this version of Rattan");
  }
  std::vector<std::string> names;
  if (H5Literate(file_, H5_INDEX_NAME, H5_ITER_INC, nullptr, collect_link, &names) < 0) {
    damaged(path_, "its list of fields cannot be read");
  }
  for (const std::string& name : names) {
    const Handle index(H5Dopen2(file_, ("/" + name + "/index").c_str(), H5P_DEFAULT));
    if (!index.valid()) {
      damaged(path_, "the index of " + name + " cannot be read");
    }
    const Handle space(H5Dget_space(index.get()));
    std::array<hsize_t, 2> size{};
    if (H5Sget_simple_extent_ndims(space.get()) != 2 ||
        H5Sget_simple_extent_dims(space.get(), size.data(), nullptr) != 2 || size[1] != 4 ||
        H5Dget_storage_size(index.get()) < size[0] * sizeof(ChunkRecord)) {
      damaged(path_, "the index of " + name + " has a wrong shape");
    }
    const std::string field = read_string(index.get(), "field", path_);
    std::vector<ChunkRecord> records(size[0]);
    if (size[0] > 0 && H5Dread(index.get(), H5T_NATIVE_UINT64, H5S_ALL, H5S_ALL, H5P_DEFAULT,
                               records.data()) < 0) {
      damaged(path_, "the index of " + field + " cannot be read");
    }
    if (read_string(index.get(), kIndexChecksum, path_) !=
        std::to_string(index_checksum(field, records))) {
      damaged(path_, "the index of " + field + " does not match its checksum");
    }
    contents_[field] = std::move(records);
  }
  for (const auto& [field, records] : contents_) {
    seal_sum_ = seal_sum_ * kOdd + index_checksum(field, records);
  }
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path_, error);
  live_bytes_ = most_bytes_ = error ? 0 : size;
}

}  // namespace rattan
