// SPDX-License-Identifier: MIT
#pragma once

// Lock, error text and handles of the HDF5 library. Included by sources of io only.

#include <mutex>
#include <string>
#include <utility>

#include <hdf5.h>

namespace rattan::hdf5 {

/// The library is used by one thread at a time, with its own printing off.
class Session {
 public:
  Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

 private:
  std::scoped_lock<std::mutex> lock_;
};

/// Throws what the last failed call on this thread deserves: DiskFull, another ResourceError if the
/// file cannot be written, else InternalError. `what` completes "<path>: cannot ...".
[[noreturn]] void fail(const std::string& path, const std::string& what,
                       const std::string& remedy =
                           "Check the disk and the directory, or choose another with --work-dir.");

/// Closes an id of any kind.
class Handle {
 public:
  Handle() = default;
  explicit Handle(hid_t id) : id_(id) {}
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(id_, other.id_);
    return *this;
  }
  ~Handle() {
    if (id_ >= 0) {
      H5Idec_ref(id_);
    }
  }
  hid_t get() const { return id_; }
  bool valid() const { return id_ >= 0; }

 private:
  hid_t id_ = -1;
};

}  // namespace rattan::hdf5
