// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cctype>
#include <sstream>

#include <fmt/format.h>

#include "tools/manual/manual.h"

namespace rattan {

namespace {

/// A word as roff wants it: a minus that can be copied, nothing that reads as a request.
std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '\\') {
      out += "\\e";
    } else if (c == '-') {
      out += "\\-";
    } else if ((c == '.' || c == '\'') && (out.empty() || out.back() == '\n')) {
      out += "\\&";
      out += c;
    } else {
      out += c;
    }
  }
  return out;
}

/// Running text, in lines that an editor of the page would like.
std::string prose(const std::string& text) {
  return escaped(fmt::format("{}", fmt::join(wrapped(text, 72), "\n")));
}

std::string upper(std::string text) {
  for (char& c : text) {
    c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  }
  return text;
}

std::string sentence(const OptionEntry& option) {
  std::string text = option.text;
  if (text.empty()) {
    return text;
  }
  if (text.back() != '.') {
    text += '.';
  }
  const std::string word = text.substr(0, text.find_first_of(" :,;."));
  const auto& choices = option.choices;
  if (std::find(choices.begin(), choices.end(), word) == choices.end()) {
    text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  }
  return text;
}

std::string entry(const OptionEntry& option) {
  std::string names;
  for (const std::string& name : option.names) {
    names += (names.empty() ? "" : ", ") + fmt::format("\\fB{}\\fR", escaped(name));
  }
  if (!option.value.empty() && option.value != option.names.front()) {
    names += fmt::format(" \\fI{}\\fR", escaped(option.value));
  }
  std::string text = sentence(option);
  if (!option.usual.empty() && text.find("default") == std::string::npos) {
    text += fmt::format(" Default: {}.", option.usual);
  }
  return fmt::format(".TP\n{}{}\n{}\n", names,
                     option.repeated && !option.value.ends_with("...") ? " ..." : "", prose(text));
}

std::string entries(const CommandEntry& command) {
  std::string text;
  for (const OptionEntry& positional : command.positionals) {
    OptionEntry plain = positional;
    plain.value.clear();
    text += entry(plain);
  }
  const bool headings = command.groups.size() > 2;
  for (const OptionGroup& group : command.groups) {
    if (group.options.empty() || (command.is_part && group.name == kHelpGroup)) {
      continue;
    }
    if (headings) {
      text += fmt::format(".PP\n\\fI{}\\fR\n", escaped(group.name));
    }
    for (const OptionEntry& option : group.options) {
      text += entry(option);
    }
  }
  return text;
}

}  // namespace

std::string manual_page(const CommandEntry& program, const std::string& version,
                        const std::string& examples) {
  std::string purpose = program.text.substr(0, program.text.find_first_of(".\n"));
  if (const std::size_t space = purpose.find(' '); purpose.starts_with("Rattan ")) {
    purpose = purpose.substr(space + 1);
  }
  purpose[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(purpose[0])));
  std::string text = fmt::format(
      ".TH {} 1 \"\" \"Rattan {}\" \"User Commands\"\n.SH NAME\n{} \\- {}\n",
      escaped(upper(program.name)), escaped(version), escaped(program.name), escaped(purpose));
  text += ".SH SYNOPSIS\n";
  if (program.commands.empty()) {
    text += escaped(program.usage()) + '\n';
  }
  for (const CommandEntry& command : program.commands) {
    text += (&command == program.commands.data() ? "" : ".br\n") + escaped(command.usage()) + '\n';
  }
  text += ".SH DESCRIPTION\n" + prose(program.text) + '\n';
  if (!program.commands.empty()) {
    text += ".SH COMMANDS\n";
    for (const CommandEntry& command : program.commands) {
      text += fmt::format(".SS {}\n{}\n{}", escaped(command.name), prose(command.text),
                          entries(command));
    }
  }
  text += ".SH OPTIONS\n" + entries(program);
  if (!program.footer.empty()) {
    text += ".SH \"EXIT STATUS\"\n" + prose(program.footer) + '\n';
  }
  if (!examples.empty()) {
    text += ".SH EXAMPLES\n";
    std::istringstream lines(examples);
    std::string what;
    std::string command;
    while (std::getline(lines, what) && std::getline(lines, command)) {
      text +=
          fmt::format("{}\n.PP\n.RS 4\n.nf\n{}\n.fi\n.RE\n.PP\n", prose(what), escaped(command));
    }
  }
  return text;
}

}  // namespace rattan
