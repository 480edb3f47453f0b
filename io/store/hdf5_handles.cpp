// SPDX-License-Identifier: MIT
#include "io/store/hdf5_handles.h"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "engine/core/errors.h"
#include "io/store/stage_file.h"

namespace rattan::hdf5 {

namespace {

std::mutex library_mutex;

extern "C" {
// Collects the messages from the call that failed first to the one that was made.
herr_t append_message(unsigned /*level*/, const H5E_error2_t* error, void* text) {
  auto& all = *static_cast<std::string*>(text);
  if (error->desc != nullptr && all.size() < 2000) {
    all += all.empty() ? "" : "; ";
    all += error->desc;
  }
  return 0;
}
}

}  // namespace

Session::Session() : lock_(library_mutex) {
  // A file that could not be flushed would be tried again, with noise, when the process ends.
  static const bool started = [] {
    H5dont_atexit();
    return H5open() >= 0;
  }();
  ensure(started, "the HDF5 library starts");
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // per thread
}

namespace {

/// The error that the system gave, as the library's messages have it; 0 if it gave none.
int system_error(const std::string& text) {
  const std::string key = "errno = ";
  const std::size_t at = text.find(key);
  return at == std::string::npos ? 0 : std::atoi(text.c_str() + at + key.size());
}

}  // namespace

void fail(const std::string& path, const std::string& what, const std::string& remedy) {
  std::string text;
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, append_message, &text);
  H5Eclear2(H5E_DEFAULT);
  const int error = system_error(text);
  if (error == ENOSPC || error == EDQUOT || error == EFBIG) {
    throw DiskFull(path + ": cannot " + what + ": the disk is full");
  }
  if (error != 0) {
    throw ResourceError(path + ": cannot " + what + " (" + std::strerror(error) + "). " + remedy);
  }
  std::replace(text.begin(), text.end(), '\n', ' ');
  throw InternalError(path + ": cannot " + what + " (" + text + ")");
}

}  // namespace rattan::hdf5
