// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cctype>
#include <functional>

#include <fmt/format.h>

#include "tools/manual/manual.h"

namespace rattan {

namespace {

std::string joined(const std::vector<std::string>& words) {
  return fmt::format("{}", fmt::join(words, " "));
}

void for_each_option(const CommandEntry& command,
                     const std::function<void(const OptionEntry&)>& f) {
  for (const OptionGroup& group : command.groups) {
    std::for_each(group.options.begin(), group.options.end(), f);
  }
}

/// A name of a shell function: of a program's name with what may stand in one.
std::string function_name(std::string name) {
  for (char& c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) {
      c = '_';
    }
  }
  return "_" + name;
}

// ---- bash ----

/// Cases of the word before the cursor: what may follow an option.
std::string bash_values(const CommandEntry& command, const char* indent) {
  std::string text;
  for_each_option(command, [&](const OptionEntry& option) {
    if (option.value.empty()) {
      return;
    }
    std::string action = "COMPREPLY=()";
    if (!option.choices.empty()) {
      action = fmt::format("COMPREPLY=($(compgen -W '{}' -- \"$word\"))", joined(option.choices));
    } else if (option.takes_folder()) {
      action = "compopt -o filenames; COMPREPLY=($(compgen -d -- \"$word\"))";
    } else if (option.takes_file()) {
      action = "compopt -o filenames; COMPREPLY=($(compgen -f -- \"$word\"))";
    }
    text += fmt::format("{}{}) {}; return ;;\n", indent, fmt::join(option.names, " | "), action);
  });
  return text;
}

std::string bash_names(const CommandEntry& command) {
  std::vector<std::string> names;
  for_each_option(command, [&](const OptionEntry& option) {
    names.insert(names.end(), option.names.begin(), option.names.end());
  });
  return joined(names);
}

std::string bash_body(const CommandEntry& command, const std::string& indent) {
  std::string text;
  if (const std::string values = bash_values(command, (indent + "  ").c_str()); !values.empty()) {
    text += fmt::format("{}case $previous in\n{}{}esac\n", indent, values, indent);
  }
  text += fmt::format("{}names='{}'\n", indent, bash_names(command));
  return text;
}

// ---- zsh ----

/// Inside a specification in single quotes.
std::string zsh_escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '\'') {
      out += "'\\''";
    } else if (c == '[' || c == ']' || c == ':' || c == '\\') {
      out += '\\';
      out += c;
    } else {
      out += c;
    }
  }
  return out;
}

std::string zsh_action(const OptionEntry& option) {
  if (!option.choices.empty()) {
    return fmt::format("({})", joined(option.choices));
  }
  return option.takes_folder() ? "_files -/" : option.takes_file() ? "_files" : " ";
}

std::string zsh_specification(const CommandEntry& command) {
  std::string text;
  for_each_option(command, [&](const OptionEntry& option) {
    std::string names = option.names.front();
    if (option.names.size() > 1) {
      names = fmt::format("'{{{}}}'", fmt::join(option.names, ","));
    }
    std::string value;
    if (!option.value.empty()) {
      value = fmt::format(":{}:{}", zsh_escaped(option.value), zsh_action(option));
    }
    text += fmt::format(" \\\n    '{}{}[{}]{}'", option.repeated ? "*" : "", names,
                        zsh_escaped(option.text), value);
  });
  for (const OptionEntry& positional : command.positionals) {
    text += fmt::format(" \\\n    '{}:{}:_files'", positional.repeated ? "*" : "",
                        zsh_escaped(positional.names.front()));
  }
  return text;
}

// ---- fish ----

std::string fish_quoted(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '\'' || c == '\\') {
      out += '\\';
    }
    out += c;
  }
  return "'" + out + "'";
}

std::string fish_options(const CommandEntry& command, const std::string& program,
                         const std::string& condition) {
  std::string text;
  for_each_option(command, [&](const OptionEntry& option) {
    text += fmt::format("complete -c {} -n {}", program, fish_quoted(condition));
    for (const std::string& name : option.names) {
      text += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
    }
    if (!option.choices.empty()) {
      text += fmt::format(" -x -a {}", fish_quoted(joined(option.choices)));
    } else if (option.takes_folder()) {
      text += " -x -a '(__fish_complete_directories)'";
    } else if (option.takes_file()) {
      text += " -r -F";
    } else if (!option.value.empty()) {
      text += " -x";
    }
    text += fmt::format(" -d {}\n", fish_quoted(option.text));
  });
  return text;
}

}  // namespace

std::string bash_completion(const CommandEntry& program) {
  const std::string function = function_name(program.name);
  std::string text = fmt::format(
      "# Completion of {0} for bash; made by `{0} --generate bash`.\n"
      "{1}() {{\n"
      "  local word=${{COMP_WORDS[COMP_CWORD]}} previous=${{COMP_WORDS[COMP_CWORD-1]}} names=\n"
      "  COMPREPLY=()\n",
      program.name, function);
  if (program.commands.empty()) {
    text += bash_body(program, "  ");
  } else {
    std::vector<std::string> commands;
    for (const CommandEntry& command : program.commands) {
      commands.push_back(command.short_name());
    }
    text += fmt::format(
        "  if ((COMP_CWORD == 1)); then\n"
        "    COMPREPLY=($(compgen -W '{} {}' -- \"$word\"))\n"
        "    return\n"
        "  fi\n"
        "  case ${{COMP_WORDS[1]}} in\n",
        joined(commands), bash_names(program));
    for (const CommandEntry& command : program.commands) {
      text += fmt::format("  {})\n{}    ;;\n", command.short_name(), bash_body(command, "    "));
    }
    text += "  esac\n";
  }
  text +=
      "  if [[ $word == -* ]]; then\n"
      "    COMPREPLY=($(compgen -W \"$names\" -- \"$word\"))\n"
      "  else\n"
      "    compopt -o filenames\n"
      "    COMPREPLY=($(compgen -f -- \"$word\"))\n"
      "  fi\n"
      "}\n";
  return text + fmt::format("complete -F {} {}\n", function, program.name);
}

std::string zsh_completion(const CommandEntry& program) {
  const std::string function = function_name(program.name);
  std::string text = fmt::format(
      "#compdef {0}\n"
      "# Completion of {0} for zsh; made by `{0} --generate zsh`.\n\n",
      program.name);
  for (const CommandEntry& command : program.commands) {
    text += fmt::format("{}_{}() {{\n  _arguments -s{}\n}}\n\n", function, command.short_name(),
                        zsh_specification(command));
  }
  if (program.commands.empty()) {
    text += fmt::format("{}() {{\n  _arguments -s{}\n}}\n\n", function, zsh_specification(program));
  } else {
    text += fmt::format(
        "{0}() {{\n"
        "  local state line\n"
        "  _arguments -C{1} \\\n    '1:command:->command' \\\n    '*::argument:->argument'\n"
        "  case $state in\n"
        "  command)\n"
        "    local -a commands=(",
        function, zsh_specification(program));
    for (const CommandEntry& command : program.commands) {
      text += fmt::format("\n      '{}:{}'", command.short_name(), zsh_escaped(command.text));
    }
    text += fmt::format(
        "\n    )\n"
        "    _describe command commands\n"
        "    ;;\n"
        "  argument)\n"
        "    (($+functions[{0}_$line[1]])) && {0}_$line[1]\n"
        "    ;;\n"
        "  esac\n"
        "}}\n\n",
        function);
  }
  return text + fmt::format("{} \"$@\"\n", function);
}

std::string fish_completion(const CommandEntry& program) {
  std::string text =
      fmt::format("# Completion of {0} for fish; made by `{0} --generate fish`.\n", program.name);
  if (program.commands.empty()) {
    return text + fish_options(program, program.name, "true");
  }
  text += fish_options(program, program.name, "__fish_use_subcommand");
  for (const CommandEntry& command : program.commands) {
    text += fmt::format("complete -c {} -f -n __fish_use_subcommand -a {} -d {}\n", program.name,
                        command.short_name(), fish_quoted(command.text));
    text +=
        fish_options(command, program.name, "__fish_seen_subcommand_from " + command.short_name());
  }
  return text;
}

}  // namespace rattan
