// SPDX-License-Identifier: MIT
#pragma once

// `rattan --licenses`. What is listed is gathered when Rattan is built, see
// tools/package/licences.cmake.

#include <span>
#include <string>
#include <string_view>

namespace rattan {

/// Of a package whose library is linked in or loaded, or whose files are built in.
struct Licence {
  std::string_view package;
  std::string_view version;  ///< may be empty
  std::string_view licence;  ///< of most of its files
  bool debian;               ///< its text is in Debian's /usr/share/doc
};

/// Rattan's own, in full.
std::string_view own_licence();
/// By name.
std::span<const Licence> library_licences();

/// All of it as text for people, with the places where the texts are on this machine.
std::string describe_licences();

}  // namespace rattan
