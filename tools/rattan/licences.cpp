// SPDX-License-Identifier: MIT
#include "tools/rattan/licences.h"

#include <algorithm>
#include <filesystem>

#include <fmt/format.h>

namespace rattan {

namespace {

namespace fs = std::filesystem;

/// Where an installed program, or the bundle, has the texts; empty if nowhere.
fs::path installed_texts() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  const fs::path texts =
      program.parent_path().parent_path() / "share" / "doc" / "rattan" / "licenses";
  return fs::is_directory(texts, error) ? texts : fs::path();
}

}  // namespace

std::string describe_licences() {
  std::string text(own_licence());
  text += "\nRattan uses these libraries (licence of most of the files of each):\n\n";
  std::size_t name = 0;
  std::size_t version = 0;
  for (const Licence& l : library_licences()) {
    name = std::max(name, l.package.size());
    version = std::max(version, l.version.size());
  }
  bool debian = false;
  for (const Licence& l : library_licences()) {
    text += fmt::format("{:<{}}  {:<{}}  {}\n", l.package, name, l.version, version, l.licence);
    debian = debian || l.debian;
  }
  if (const fs::path texts = installed_texts(); !texts.empty()) {
    text += fmt::format("\nTheir texts are in {}, one file a package.\n", texts.string());
  }
  if (debian) {
    text += "\nDebian keeps the text of a package in /usr/share/doc/PACKAGE/copyright.\n";
  }
  return text;
}

}  // namespace rattan
