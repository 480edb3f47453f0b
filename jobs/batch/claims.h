// SPDX-License-Identifier: MIT
#pragma once

// Which process works on a scan: DIR/.rattan/claims/<id>/ holds a WorkLock. Whoever has taken it
// reads the journal once more before it begins, as another process may have finished the scan.

#include <memory>
#include <optional>
#include <string>

#include "io/store/work_lock.h"

namespace rattan {

class Claim {
 public:
  /// Null if a living process has it, on whatever machine. Throws ResourceError where none can be
  /// taken.
  static std::unique_ptr<Claim> take(const std::string& directory, const std::string& id);
  ~Claim();
  Claim(const Claim&) = delete;
  Claim& operator=(const Claim&) = delete;

  /// Whether there is one, of anybody alive or dead.
  static bool left(const std::string& directory, const std::string& id);
  /// Who has it: "process 12 on host"; nothing if nobody does, or nobody alive.
  static std::optional<std::string> holder(const std::string& directory, const std::string& id);

 private:
  Claim(std::string root, const std::string& folder);

  std::string root_;  ///< DIR/.rattan/claims
  std::string folder_;
  std::optional<WorkLock> lock_;
};

/// Whether a process is at work in a work directory of `rattan remesh`: the child of a batch that
/// died needs some seconds to save its work.
bool work_in_use(const std::string& work_directory);

}  // namespace rattan
