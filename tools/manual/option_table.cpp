// SPDX-License-Identifier: MIT
#include "tools/manual/option_table.h"

#include <algorithm>
#include <cctype>
#include <sstream>
#include <string_view>

namespace rattan {

namespace {

constexpr std::string_view kMore = " (more)";

bool is_more(const std::string& group) {
  return group.ends_with(kMore);
}

std::string upper(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return text;
}

// CLI11 describes a set of values as "{1,2,4}", and one with a meaning for each as
// "value in {edge->0,triangle->1} OR {0,1}": the words before the arrows.
std::vector<std::string> choices_in(const std::string& checks) {
  const std::size_t begin = checks.find('{');
  const std::size_t end = checks.find('}', begin);
  std::vector<std::string> choices;
  if (begin == std::string::npos || end == std::string::npos) {
    return choices;
  }
  std::istringstream words(checks.substr(begin + 1, end - begin - 1));
  for (std::string word; std::getline(words, word, ',');) {
    choices.push_back(word.substr(0, word.find("->")));
  }
  return choices;
}

std::string joined(const std::vector<std::string>& words, const char* separator) {
  std::string text;
  for (const std::string& word : words) {
    text += (text.empty() ? "" : separator) + word;
  }
  return text;
}

// The type's name comes first, then what checks the value, behind colons.
void set_value(const std::string& type, OptionEntry& entry) {
  const std::size_t colon = type.find(':');
  const std::string name = type.substr(0, colon);
  const std::string checks = colon == std::string::npos ? "" : type.substr(colon + 1);
  entry.choices = choices_in(checks);
  const bool given = name != "TEXT" && name != "INT" && name != "UINT" && name != "FLOAT" &&
                     name != "ENUM" && name != "BOOLEAN" && !name.empty();
  if (given) {
    entry.value = name;
    if (entry.choices.empty() && name.find('|') != std::string::npos) {
      std::istringstream words(name);
      for (std::string word; std::getline(words, word, '|');) {
        entry.choices.push_back(word);
      }
    }
  } else if (!entry.choices.empty()) {
    entry.value = joined(entry.choices, "|");
  } else if (checks.starts_with("SIZE")) {
    entry.value = "SIZE";
  } else {
    entry.value = name == "TEXT" ? "TEXT" : "N";
  }
}

OptionEntry describe_option(const CLI::Option& option) {
  OptionEntry entry;
  if (option.get_positional()) {
    entry.names = {upper(option.get_name(true, false))};
  } else {
    for (const std::string& name : option.get_snames()) {
      entry.names.push_back("-" + name);
    }
    for (const std::string& name : option.get_lnames()) {
      entry.names.push_back("--" + name);
    }
  }
  const bool flag = option.get_items_expected_max() == 0 || option.get_type_size_max() == 0;
  if (!flag) {
    set_value(option.get_type_name(), entry);
    entry.usual = option.get_default_str();
  }
  entry.text = option.get_description();
  entry.required = option.get_required();
  entry.repeated = !flag && option.get_expected_max() > 1;
  entry.more = is_more(option.get_group());
  return entry;
}

void add_options(const CLI::App& app, CommandEntry& command) {
  OptionGroup help{kHelpGroup, {}};
  for (const CLI::Option* option : app.get_options()) {
    std::string group = option->get_group();
    if (group.empty()) {
      continue;
    }
    if (option->get_positional()) {
      command.positionals.push_back(describe_option(*option));
      continue;
    }
    if (option == app.get_help_ptr() || option == app.get_help_all_ptr() ||
        option == app.get_version_ptr() || group == kHelpGroup) {
      help.options.push_back(describe_option(*option));
      continue;
    }
    if (is_more(group)) {
      group.resize(group.size() - kMore.size());
    }
    auto place = std::find_if(command.groups.begin(), command.groups.end(),
                              [&](const OptionGroup& g) { return g.name == group; });
    if (place == command.groups.end()) {
      place = command.groups.insert(place, {group, {}});
    }
    place->options.push_back(describe_option(*option));
  }
  command.groups.push_back(std::move(help));
}

}  // namespace

bool OptionEntry::takes_file() const {
  if (value.find('.') != std::string::npos && !value.ends_with("...")) {
    return true;  // OLD.json
  }
  for (const std::string_view word : {"FILE", "PATH", "SCAN", "OUT", "PNG", "MESH", "REMESH"}) {
    if (value.starts_with(word)) {
      return true;
    }
  }
  return false;
}

bool OptionEntry::takes_folder() const {
  return value.starts_with("DIR");
}

std::string OptionEntry::spelled() const {
  std::string line = joined(names, ", ");
  if (!value.empty()) {
    line += " " + value;
  }
  return line + (repeated && !value.ends_with("...") ? "..." : "");
}

std::string CommandEntry::usage() const {
  std::string line = name;
  if (!commands.empty()) {
    return line + " COMMAND ...";
  }
  line += " [OPTIONS]";
  for (const OptionEntry& p : positionals) {
    const std::string word = p.names.front() + (p.repeated ? "..." : "");
    line += p.required ? " " + word : " [" + word + "]";
  }
  for (const OptionGroup& group : groups) {
    for (const OptionEntry& option : group.options) {
      if (option.required) {
        line += " " + option.names.front() + " " + option.value;
      }
    }
  }
  return line;
}

std::string CommandEntry::short_name() const {
  return name.substr(name.rfind(' ') + 1);
}

std::size_t CommandEntry::more_options() const {
  std::size_t count = 0;
  for (const OptionGroup& group : groups) {
    count += static_cast<std::size_t>(
        std::count_if(group.options.begin(), group.options.end(),
                      [](const OptionEntry& option) { return option.more; }));
  }
  return count;
}

CommandEntry describe_command(const CLI::App& app) {
  CommandEntry command;
  for (const CLI::App* a = &app; a != nullptr; a = a->get_parent()) {
    command.name = a->get_name() + (command.name.empty() ? "" : " ") + command.name;
  }
  command.text = app.get_description();
  command.is_part = app.get_parent() != nullptr;
  if (app.get_parent() == nullptr || app.get_footer() != app.get_parent()->get_footer()) {
    command.footer = app.get_footer();  // commands inherit it
  }
  add_options(app, command);
  for (const CLI::App* sub : app.get_subcommands({})) {
    if (sub->get_name().empty()) {  // an option group
      add_options(*sub, command);
    } else if (!sub->get_group().empty()) {
      command.commands.push_back(describe_command(*sub));
    }
  }
  return command;
}

std::string more(const std::string& group) {
  return group + std::string(kMore);
}

std::vector<std::string> wrapped(const std::string& text, std::size_t width) {
  std::vector<std::string> lines;
  std::istringstream paragraphs(text);
  for (std::string paragraph; std::getline(paragraphs, paragraph);) {
    std::istringstream words(paragraph);
    std::string line;
    for (std::string word; words >> word;) {
      if (!line.empty() && line.size() + 1 + word.size() > width) {
        lines.push_back(std::move(line));
        line.clear();
      }
      line += (line.empty() ? "" : " ") + word;
    }
    lines.push_back(std::move(line));
  }
  return lines;
}

}  // namespace rattan
