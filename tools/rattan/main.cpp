// SPDX-License-Identifier: MIT
#include <csignal>
#include <cstdio>

#include <CLI/CLI.hpp>

#include "jobs/version.h"
#include "tools/rattan/commands.h"
#include "tools/rattan/exit_code.h"
#include "tools/rattan/licences.h"

namespace rattan {
namespace {

int parse_and_run(int argc, char** argv) {
  CLI::App app{
      "Rattan converts triangle scans into curvature-aligned quad-dominant meshes.\n"
      "Exit codes: 0 done; 2 usage; 3 the input cannot be used; 4 memory or disk ran out;\n"
      "75 interrupted, run again to resume; 1 a defect in Rattan."};
  app.name("rattan");
  app.set_version_flag("--version", std::string("rattan ") + version());
  app.add_flag_callback(
      "--licenses", [] { throw CLI::CallForVersion(describe_licences(), 0); },
      "Print the licences of Rattan and of the libraries in it");
  app.require_subcommand(1);
  app.get_formatter()->column_width(34);

  Action action;
  add_remesh_command(app, action);
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
    std::fprintf(stderr, "rattan: %s\nSee rattan --help, or rattan COMMAND --help.\n", e.what());
    return kExitUsage;
  }
  return action();
}

}  // namespace
}  // namespace rattan

int main(int argc, char** argv) {
  std::signal(SIGXFSZ, SIG_IGN);  // a file that may not grow is an error like any other
  return rattan::run_guarded([&] { return rattan::parse_and_run(argc, argv); });
}
