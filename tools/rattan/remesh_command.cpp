// SPDX-License-Identifier: MIT
#include <cstdlib>
#include <map>
#include <memory>
#include <string>

#include <fmt/format.h>

#include "jobs/remesh_job.h"
#include "jobs/remesh_plan.h"
#include "jobs/size_list.h"
#include "tools/rattan/commands.h"
#include "tools/rattan/console.h"
#include "tools/rattan/exit_code.h"
#include "tools/rattan/interruption.h"

namespace rattan {

namespace {

struct Arguments {
  RemeshOptions options;
  std::string faces;
  std::string edge_length;
  std::string ratio;
  double smoothing = 0.0;
  std::string crease = "35";
  bool quiet = false;
  bool verbose = false;
  bool dry_run = false;
};

void add_size_options(CLI::App& command, Arguments& args) {
  auto* size = command.add_option_group(
      "Size", "one of these; default --ratio 0.05. A list like 50k,10k,2k makes several remeshes");
  size->add_option("--faces", args.faces, "faces of the remesh");
  size->add_option("--edge-length", args.edge_length, "quad side, in the file's units");
  size->add_option("--ratio", args.ratio, "faces per triangle of the repaired scan");
  size->require_option(0, 1);
  command
      .add_option("--density", args.options.density,
                  "iso-lines per period, 1 to 16; default 1, or 4 with --pure-quads")
      ->check(CLI::Range(1, 16));
}

void add_input_options(CLI::App& command, Arguments& args) {
  RemeshOptions& o = args.options;
  command.add_flag("--merge-vertices", o.merge_vertices,
                   "make vertices at exactly equal positions one; done without asking only where "
                   "triangles share no vertices");
  command.add_option("--drop-components", o.drop_components,
                     "drop components of fewer triangles than this");
  command.add_option("--fill-holes", o.fill_holes,
                     "fill holes whose outline has at most so many edges");
}

void add_method_options(CLI::App& command, Arguments& args) {
  RemeshOptions& o = args.options;
  command.add_option(
      "--field", o.field,
      "directions to follow instead of the curvature: a text file with a line \"x y z\" "
      "or \"x y z fidelity\" for each vertex of the scan file");
  command.add_option("--symmetry", o.symmetry, "field modulo 2 pi / N")
      ->check(CLI::IsMember({1, 2, 4}))
      ->capture_default_str();
  command
      .add_option("--smoothing", args.smoothing,
                  "rho in (0, 1), larger is smoother; default from the quad size")
      ->check(CLI::Range(1e-6, 1.0 - 1e-9));
  command.add_flag("--curl-correction", o.curl_correction,
                   "rescale the field in full: fewest singularities, uneven quads");
  command
      .add_option("--crease", args.crease,
                  "edges that turn by DEGREES or more are sharp features, 5 to 179, or off")
      ->check(CLI::Range(5.0, 179.0) | CLI::IsMember({"off"}))
      ->capture_default_str();
  command.add_option("--energy", o.energy, "edge or triangle (default)")
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, Energy>{{"edge", Energy::kEdge}, {"triangle", Energy::kTriangle}}));
  command
      .add_option("--solver", o.solver, "nested (default), or reference: the paper's, small scans")
      ->transform(CLI::CheckedTransformer(std::map<std::string, SolverKind>{
          {"nested", SolverKind::kNested}, {"reference", SolverKind::kReference}}));
  command
      .add_option("--newton-steps", o.newton_steps, "Newton-CG steps that finish the nested solve")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
}

void add_run_options(CLI::App& command, Arguments& args) {
  RemeshOptions& o = args.options;
  command.add_flag("--pure-quads", o.pure_quads, "only quads, no triangle");
  command
      .add_option("--position-bits", o.position_bits, "bits per coordinate in a .drc, 0 for auto")
      ->check(CLI::Range(0, 30))
      ->capture_default_str();
  command
      .add_option("--memory", o.memory,
                  "most memory that the process may fill, e.g. 2GiB; default from the machine")
      ->transform(CLI::AsSizeValue(false));
  command.add_option("--threads", o.threads, "0 for all processors")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
  command.add_option("--work-dir", o.work_dir, "folder of intermediate data; default OUT.work");
  command.add_flag("--fresh", o.fresh, "start anew, whatever an earlier run left in that folder");
  command.add_flag("--keep-work", o.keep_work, "leave the intermediate data for inspection");
  command.add_flag("--dry-run", args.dry_run,
                   "read the scan, print what the run would take, and stop");
  command.add_option("--report", o.report, "write a JSON report");
  command.add_option("--preview", o.preview, "write a PNG: scan, field, iso-lines, remesh");
  // For the report of a batch.
  command.add_option("--thumbnail", o.thumbnail, "write a small PNG of the remesh")->group("");
  command.add_option("--viewer", o.viewer, "write the remesh as a script, for a 3D view")
      ->group("");
  auto* quiet = command.add_flag("--quiet", args.quiet, "only warnings and errors");
  command.add_flag("--verbose", args.verbose, "a line for every stage")->excludes(quiet);
}

int run(Arguments& args) {
  RemeshOptions& o = args.options;
  if (!args.faces.empty()) {
    o.size_kind = SizeKind::kFaces;
    o.sizes = parse_sizes(args.faces, "--faces", {1.0, 1e10});
  } else if (!args.edge_length.empty()) {
    o.size_kind = SizeKind::kEdgeLength;
    o.sizes = parse_sizes(args.edge_length, "--edge-length", {1e-30, 1e30});
  } else if (!args.ratio.empty()) {
    o.size_kind = SizeKind::kRatio;
    o.sizes = parse_sizes(args.ratio, "--ratio", {1e-9, 10.0});
  }
  o.crease = args.crease == "off" ? 0.0 : std::stod(args.crease);
  if (args.smoothing > 0.0) {
    o.smoothing = args.smoothing;
  }
  const Verbosity verbosity = args.quiet     ? Verbosity::kQuiet
                              : args.verbose ? Verbosity::kVerbose
                                             : Verbosity::kNormal;
  if (args.dry_run) {
    Console console(verbosity);
    const RemeshPlan plan = plan_remesh(o, console);
    fmt::print("{}", describe(plan));
    return plan.fits() ? kExitDone : kExitResource;
  }
  if (const char* seconds = std::getenv("RATTAN_CHECKPOINT_SECONDS")) {
    o.checkpoint_seconds = std::strtod(seconds, nullptr);
  }
  RemeshReport report;
  {
    Interruption interruption;
    Console console(verbosity);
    report = remesh_scan(o, console, {interruption.soon(), interruption.now()});
  }
  if (verbosity != Verbosity::kQuiet) {
    for (const auto& [output, singularities, distance, shared_with] : report.outputs) {
      fmt::print("{}: {} faces, {:.1f} % quads, {} bytes, {:.1f} s\n", output.path, output.faces,
                 output.faces == 0 ? 0.0
                                   : 100.0 * static_cast<double>(output.quads) /
                                         static_cast<double>(output.faces),
                 output.bytes, report.seconds);
    }
  }
  return 0;
}

}  // namespace

void add_remesh_command(CLI::App& app, Action& action) {
  auto args = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("remesh", "Convert one scan into a curvature-aligned quad-dominant mesh.");
  command
      ->add_option("scan", args->options.scan,
                   "PLY, OBJ, STL, OFF or Draco file, as it is or with .gz or .zst")
      ->required();
  command
      ->add_option("-o,--output", args->options.output,
                   "remesh to write: .drc, .obj, .ply or .off; for several sizes {faces}, {size} "
                   "or {n} in it "
                   "stand for the size and its place in the list")
      ->required();
  add_size_options(*command, *args);
  add_input_options(*command, *args);
  add_method_options(*command, *args);
  add_run_options(*command, *args);
  command->callback([args, &action] { action = [args] { return run(*args); }; });
}

}  // namespace rattan
