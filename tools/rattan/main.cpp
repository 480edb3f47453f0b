// SPDX-License-Identifier: MIT
#include <csignal>
#include <cstdio>
#include <string>
#include <unistd.h>

#include <CLI/CLI.hpp>

#include "jobs/version.h"
#include "tools/rattan/commands.h"
#include "tools/rattan/exit_code.h"

namespace rattan {
namespace {

/// Of a command line that may be wrong further on; empty where none was understood.
std::string scan_of(const CLI::App& app) {
  for (const CLI::App* command : app.get_subcommands()) {  // those that were given
    const CLI::Option* scan = command->get_option_no_throw("scan");
    if (scan != nullptr && scan->count() > 0) {
      return scan->results().front();
    }
  }
  return {};
}

int parse_and_run(int argc, char** argv, JsonLog* log) {
  CLI::App app{
      "Rattan converts triangle scans into curvature-aligned quad-dominant meshes.\n"
      "Exit codes: 0 done; 2 usage; 3 the input cannot be used; 4 memory or disk ran out;\n"
      "75 interrupted, run again to resume; 1 a defect in Rattan."};
  app.name("rattan");
  app.set_version_flag("--version", std::string("rattan ") + version());
  app.require_subcommand(1);
  app.get_formatter()->column_width(34);

  Action action;
  add_remesh_command(app, action, log);
  add_compare_command(app, action);
  add_render_command(app, action);
  add_info_command(app, action);
  add_synth_command(app, action);

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) {
      return app.exit(e);  // --help and --version
    }
    if (log != nullptr) {
      log->set_scan(scan_of(app));
      log->error(e.what(), kExitUsage);
      return kExitUsage;
    }
    std::fprintf(stderr, "rattan: %s\nSee rattan --help, or rattan COMMAND --help.\n", e.what());
    return kExitUsage;
  }
  return action();
}

}  // namespace
}  // namespace rattan

int main(int argc, char** argv) {
  std::signal(SIGXFSZ, SIG_IGN);  // a file that may not grow is an error like any other
  if (!rattan::json_log_wanted(argc, argv)) {
    return rattan::run_guarded([&] { return rattan::parse_and_run(argc, argv, nullptr); });
  }
  rattan::JsonLog log(STDERR_FILENO);
  return rattan::run_guarded(
      [&] { return rattan::parse_and_run(argc, argv, &log); },
      [&](const std::string& sentence, int code) { log.error(sentence, code); });
}
