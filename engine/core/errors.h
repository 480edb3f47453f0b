// SPDX-License-Identifier: MIT
#pragma once

// The exceptions that may cross a folder boundary. tools/ maps each to one exit code.

#include <cstdint>
#include <stdexcept>
#include <string>

namespace rattan {

/// Base of all below. what() is a whole sentence for the user.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The command line or an option cannot be understood. Exit code 2.
class UsageError : public Error {
 public:
  using Error::Error;
};

/// The input cannot be used: names the file, the place, what is wrong and the remedy. Exit code 3.
class InputError : public Error {
 public:
  /// `place` is e.g. "line 12" or "byte 4096"; may be empty.
  InputError(const std::string& file, const std::string& place, const std::string& problem,
             const std::string& remedy)
      : Error(file + (place.empty() ? "" : ": " + place) + ": " + problem + ". " + remedy + ".") {}
};

/// Memory budget or disk ran out: says how much is needed. Exit code 4.
class ResourceError : public Error {
 public:
  using Error::Error;
};

/// Interrupted with the work saved; the same command resumes. Exit code 75.
class Cancelled : public Error {
 public:
  using Error::Error;
};

/// A promise of Rattan's own code is broken. Exit code 1.
class InternalError : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

/// Always-on check for cheap invariants.
inline void ensure(bool condition, const char* promise) {
  if (!condition) {
    throw InternalError(promise);
  }
}

}  // namespace rattan
