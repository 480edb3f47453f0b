// SPDX-License-Identifier: MIT
#include "io/store/hdf5_handles.h"

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

void fail(const std::string& path, const std::string& what) {
  std::string text;
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, append_message, &text);
  H5Eclear2(H5E_DEFAULT);
  const auto says = [&](const char* words) { return text.find(words) != std::string::npos; };
  if (says("No space left") || says("Disk quota exceeded") || says("File too large")) {
    throw DiskFull(path + ": cannot " + what + ": the disk is full");
  }
  if (says("Permission denied") || says("Read-only file system") || says("Input/output error") ||
      says("No such file or directory") || says("Not a directory") || says("Too many open files")) {
    throw ResourceError(path + ": cannot " + what + " (" + text +
                        "). Check the directory, or choose another with --work-dir.");
  }
  throw InternalError(path + ": cannot " + what + " (" + text + ")");
}

}  // namespace rattan::hdf5
