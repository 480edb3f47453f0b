// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "io/store/hdf5_store.h"

namespace rattan {

/// What stands for the content of an input file in a run that may be resumed: the same text as long
/// as the file is the same. Size and times tell at once; where they differ, as on another machine,
/// the content's hash does, if it is known.
class InputToken {
 public:
  /// `what` names the input in the store's notes.
  InputToken(Hdf5Store& store, std::string what, const std::string& path);
  const std::string& text() const { return text_; }
  /// SHA-256 of the file's bytes, once it has been read.
  void set_hash(const std::string& sha256);

 private:
  void save();

  Hdf5Store& store_;
  std::string what_;
  std::string identity_;
  std::string text_;
  std::string sha256_;
};

}  // namespace rattan
