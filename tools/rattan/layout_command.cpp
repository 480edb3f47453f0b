// SPDX-License-Identifier: MIT
#include <algorithm>
#include <memory>
#include <string>

#include <fmt/format.h>

#include "jobs/layout_job.h"
#include "jobs/remesh_plan.h"
#include "tools/manual/option_table.h"
#include "tools/rattan/commands.h"
#include "tools/rattan/scan_arguments.h"
#include "tools/rattan/scan_run.h"

namespace rattan {

namespace {

struct Arguments {
  LayoutOptions options;
  double smoothing = 0.0;
  RunFlags flags;
};

void add_layout_options(CLI::App& command, LayoutOptions& o) {
  command
      .add_option("--chart-size", o.chart_size,
                  "side of a chart, in the file's units; default ten mean edges")
      ->check(CLI::Range(1e-30, 1e30))
      ->type_name("LENGTH")
      ->group("Charts");
  command
      .add_option("--relax", o.relax,
                  "rounds that smooth coordinates across borders of repaired charts; 6 do")
      ->check(CLI::Range(0, 1000))
      ->default_str("0")
      ->type_name("N")
      ->group("Charts");
  command.add_flag("--atlas", o.atlas, "one unit square of texture coordinates for all charts")
      ->group("Charts");
  command
      .add_option("--bake", o.bake,
                  "write a PNG of SIZE x SIZE texels for the atlas, with the scan's colours")
      ->check(CLI::Range(16, 32768))
      ->type_name("SIZE")
      ->group("Charts");
}

void say(const LayoutReport& report) {
  const FlatCounts& c = report.charts;
  fmt::print("{}: {} charts, {:.1f} % of them parameterized anew, {} bytes, {:.1f} s\n",
             report.output.path, c.charts,
             100.0 * (c.flattened + c.split) / std::max(1.0, static_cast<double>(c.charts)),
             report.output.bytes, report.seconds);
  fmt::print("{}: base complex of {} quads\n", report.base.path, report.base.quads);
}

int run(const Arguments& args, JsonLog* log) {
  LayoutOptions o = args.options;
  if (log != nullptr) {
    log->set_scan(o.scan);
  }
  if (args.smoothing > 0.0) {
    o.smoothing = args.smoothing;
  }
  return run_scan(o, args.flags, log, plan_layout, layout_scan, say);
}

}  // namespace

void add_layout_command(CLI::App& app, Action& action, JsonLog* log) {
  auto args = std::make_shared<Arguments>();
  LayoutOptions& o = args->options;
  CLI::App* command = app.add_subcommand(
      "layout", "Parameterize one scan: charts with texture coordinates, and the base complex.");
  command
      ->add_option("scan", o.scan, "PLY, OBJ, STL, OFF or Draco file, as it is or with .gz or .zst")
      ->required();
  command
      ->add_option("-o,--output", o.output,
                   "layout to write: .obj, .ply or .drc; OUT.base and OUT.charts.json go beside it")
      ->type_name("OUT")
      ->required();
  add_layout_options(*command, o);
  add_repair_options(*command, o);
  add_field_options(*command, o, args->smoothing);
  add_solver_options(*command, o);
  add_position_bits_option(*command, o);
  add_resource_options(*command, o);
  command->add_option("--preview", o.preview, "write a PNG: scan, field, iso-lines, charts, base")
      ->type_name("FILE")
      ->group("Run");
  add_process_options(*command, o, args->flags);
  command->callback([args, &action, log] { action = [args, log] { return run(*args, log); }; });
}

}  // namespace rattan
