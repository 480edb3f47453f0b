// SPDX-License-Identifier: MIT
#include <algorithm>
#include <memory>
#include <utility>

#include <fmt/format.h>

#include "tools/manual/manual.h"

namespace rattan {

namespace {

constexpr std::size_t kProgramWidth = 80;
constexpr std::size_t kCommandWidth = 100;
constexpr std::size_t kWidestNames = 30;

using Row = std::pair<std::string, std::string>;

/// Rows of two columns, the second wrapped.
std::string table(const std::vector<Row>& rows, std::size_t column, std::size_t width) {
  std::string text;
  for (const auto& [name, meaning] : rows) {
    std::string line = "  " + name;
    if (line.size() + 2 > column) {
      text += line + '\n';
      line.clear();
    }
    for (const std::string& part : wrapped(meaning, width - column)) {
      line.resize(std::max(line.size(), column), ' ');
      text += line + part + '\n';
      line.clear();
    }
  }
  return text;
}

std::string meaning(const OptionEntry& option) {
  std::string text = option.text;
  if (!option.usual.empty() && text.find("default") == std::string::npos) {
    text += fmt::format(" (default {})", option.usual);
  }
  return text;
}

class HelpFormatter final : public CLI::FormatterBase {
 public:
  std::string make_help(const CLI::App* app, std::string /*name*/,
                        CLI::AppFormatMode mode) const override {
    const CommandEntry command = describe_command(*app);
    return help_screen(command, mode == CLI::AppFormatMode::All,
                       command.commands.empty() ? kCommandWidth : kProgramWidth);
  }
};

}  // namespace

std::string help_screen(const CommandEntry& command, bool all, std::size_t width) {
  struct Section {
    std::string name;
    std::vector<Row> rows;
  };
  std::vector<Section> sections;
  std::vector<Row> rows;
  for (const CommandEntry& c : command.commands) {
    rows.emplace_back(c.short_name(), c.text);
  }
  sections.push_back({"Commands", rows});
  rows.clear();
  for (const OptionEntry& p : command.positionals) {
    rows.emplace_back(p.names.front(), meaning(p));
  }
  sections.push_back({"Arguments", rows});
  for (const OptionGroup& group : command.groups) {
    rows.clear();
    for (const OptionEntry& option : group.options) {
      const bool known = command.is_part && group.name == kHelpGroup;  // the program's help told
      if (all || (!option.more && !known)) {
        rows.emplace_back(option.spelled(), meaning(option));
      }
    }
    sections.push_back({group.name, rows});
  }

  std::size_t column = 0;
  for (const Section& section : sections) {
    for (const Row& row : section.rows) {
      if (row.first.size() <= kWidestNames) {
        column = std::max(column, row.first.size() + 4);
      }
    }
  }
  std::string text;
  for (const std::string& line : wrapped(command.text, width)) {
    text += line + '\n';
  }
  text += fmt::format("\nUsage: {}\n", command.usage());
  for (const Section& section : sections) {
    if (!section.rows.empty()) {
      text += fmt::format("\n{}:\n{}", section.name, table(section.rows, column, width));
    }
  }
  if (!command.footer.empty()) {
    text += '\n';
    for (const std::string& line : wrapped(command.footer, width)) {
      text += line + '\n';
    }
  }
  if (const std::size_t left = command.more_options(); left > 0 && !all) {
    text += fmt::format("\n{} more options: {} --help-all\n", left, command.name);
  }
  if (all) {
    for (const CommandEntry& c : command.commands) {
      text += "\n\n" + help_screen(c, all, kCommandWidth);
    }
  }
  return text;
}

void add_help(CLI::App& app, const std::string& version, const std::string& examples) {
  app.formatter(std::make_shared<HelpFormatter>());
  app.set_help_flag("-h,--help", "print the options that most people need");
  app.set_help_all_flag("--help-all", "print all options");
  app.add_option_function<std::string>(
         "--generate",
         [&app, version, examples](const std::string& what) {
           const CommandEntry program = describe_command(app);
           std::string text = what == "man"    ? manual_page(program, version, examples)
                              : what == "bash" ? bash_completion(program)
                              : what == "zsh"  ? zsh_completion(program)
                                               : fish_completion(program);
           text.pop_back();  // CLI11 ends the last line
           throw CLI::CallForVersion(text, 0);
         },
         "write the manual page, or the completion of a shell, to standard output")
      ->check(CLI::IsMember({"man", "bash", "zsh", "fish"}))
      ->group("");
}

}  // namespace rattan
