// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include <CLI/CLI.hpp>

#include "tools/manual/option_table.h"

namespace rattan {

/// Gives a program its help screens (--help: what most people need; --help-all: everything) and the
/// hidden option `--generate man|bash|zsh|fish`. Before any command is added. `examples` go into
/// the manual page: a line of text and a command by turns, separated by line ends.
void add_help(CLI::App& app, const std::string& version, const std::string& examples);

/// A screen of at most `width` columns; without the options marked as more unless `all`.
std::string help_screen(const CommandEntry& command, bool all, std::size_t width);

/// In the language of man(7).
std::string manual_page(const CommandEntry& program, const std::string& version,
                        const std::string& examples);

std::string bash_completion(const CommandEntry& program);
std::string zsh_completion(const CommandEntry& program);
std::string fish_completion(const CommandEntry& program);

}  // namespace rattan
