// SPDX-License-Identifier: MIT
#pragma once

// What a program's command line takes, read from its parser: help screens, the manual page and the
// completion of shells are all made from this, so that none of them can be behind.

#include <cstddef>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace rattan {

struct OptionEntry {
  std::vector<std::string> names;  ///< "-o", "--output"; of a positional its one name, "SCAN"
  /// What stands for the value: the type name that was given to the option (FILE, DIR, SIZE, ...),
  /// else its choices, "edge|triangle", else N for numbers. Empty for flags.
  std::string value;
  std::vector<std::string> choices;  ///< the words among the values, if there are any
  std::string text;
  std::string usual;  ///< its default, as text; may be empty
  bool required = false;
  bool repeated = false;
  bool more = false;  ///< only in the full help

  bool takes_file() const;
  bool takes_folder() const;
  /// "-o, --output OUT".
  std::string spelled() const;
};

/// The group of --help, --version and the like.
inline constexpr const char* kHelpGroup = "Help";

struct OptionGroup {
  std::string name;
  std::vector<OptionEntry> options;
};

/// A program or one of its commands. What is hidden (group "") isn't in it.
struct CommandEntry {
  std::string name;  ///< "rattan remesh"
  std::string text;
  std::string footer;
  std::vector<OptionEntry> positionals;
  std::vector<OptionGroup> groups;  ///< that of help and version last
  std::vector<CommandEntry> commands;
  bool is_part = false;  ///< of a program

  /// "rattan remesh [OPTIONS] SCAN -o OUT".
  std::string usage() const;
  /// Its last word.
  std::string short_name() const;
  std::size_t more_options() const;
};

CommandEntry describe_command(const CLI::App& app);

/// The name of a group for those of its options that aren't on the short help.
std::string more(const std::string& group);

/// Lines of at most `width` characters, broken between words; of one word, if need be, more.
std::vector<std::string> wrapped(const std::string& text, std::size_t width);

}  // namespace rattan
