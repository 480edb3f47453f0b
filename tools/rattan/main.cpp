// SPDX-License-Identifier: MIT
#include <csignal>
#include <cstdio>
#include <string>
#include <unistd.h>

#include <CLI/CLI.hpp>

#include "jobs/version.h"
#include "tools/manual/manual.h"
#include "tools/rattan/commands.h"
#include "tools/rattan/exit_code.h"
#include "tools/rattan/licences.h"

namespace rattan {
namespace {

/// For the manual page: what is done, and how.
constexpr const char* kExamples =
    "One scan, 20,000 faces, with a report and a picture:\n"
    "rattan remesh bust.ply -o bust.drc --faces 20k --report bust.json --preview bust.png\n"
    "Several sizes from one reading of the scan:\n"
    "rattan remesh bust.ply -o bust.drc --faces 50k,10k,2500\n"
    "A scan larger than memory: what it would take, and the run:\n"
    "rattan remesh city.ply -o city.drc --faces 2M --memory 4GiB --dry-run\n"
    "The same without --dry-run, resumed by the same command if it is stopped:\n"
    "rattan remesh city.ply -o city.drc --faces 2M --memory 4GiB\n"
    "Charts with texture coordinates, and an image of the scan's colours:\n"
    "rattan layout bust.ply -o charted.obj --bake 4096\n"
    "How far a remesh lies from its scan:\n"
    "rattan compare bust.drc bust.ply";

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
  CLI::App app{"Rattan converts triangle scans into curvature-aligned quad-dominant meshes."};
  app.name("rattan");
  app.footer(
      "Exit codes: 0 done; 2 usage; 3 the input cannot be used; 4 memory or disk ran out; "
      "75 interrupted, run again to resume; 1 a defect in Rattan.");
  add_help(app, version(), kExamples);
  app.set_version_flag("--version", std::string("rattan ") + version(), "print the version");
  app.add_flag_callback(
         "--licenses", [] { throw CLI::CallForVersion(describe_licences(), 0); },
         "print the licences of Rattan and of the libraries in it")
      ->group("Help");
  app.require_subcommand(1);

  Action action;
  add_remesh_command(app, action, log);
  add_batch_command(app, action, log);
  add_slurm_command(app, action);
  add_layout_command(app, action, log);
  add_compare_command(app, action);
  add_render_command(app, action);
  add_export_command(app, action);
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
