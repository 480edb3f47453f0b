// SPDX-License-Identifier: MIT
#include <map>
#include <memory>
#include <string>

#include <fmt/format.h>

#include "jobs/remesh_job.h"
#include "tools/rattan/commands.h"
#include "tools/rattan/console.h"

namespace rattan {

namespace {

struct Arguments {
  RemeshOptions options;
  double faces = 0.0;
  double edge_length = 0.0;
  double ratio = 0.0;
  double smoothing = 0.0;
  std::string crease = "35";
  bool quiet = false;
  bool verbose = false;
};

void add_size_options(CLI::App& command, Arguments& args) {
  auto* size = command.add_option_group("Size", "one of these; default --ratio 0.05");
  size->add_option("--faces", args.faces, "faces of the remesh")->check(CLI::Range(1.0, 1e10));
  size->add_option("--edge-length", args.edge_length, "quad side, in the file's units")
      ->check(CLI::PositiveNumber);
  size->add_option("--ratio", args.ratio, "faces per triangle of the repaired scan")
      ->check(CLI::Range(1e-9, 10.0));
  size->require_option(0, 1);
  command.add_option("--density", args.options.density, "iso-lines per period, 1 to 16")
      ->check(CLI::Range(1, 16))
      ->capture_default_str();
}

void add_method_options(CLI::App& command, Arguments& args) {
  RemeshOptions& o = args.options;
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
  command
      .add_option("--position-bits", o.position_bits, "bits per coordinate in a .drc, 0 for auto")
      ->check(CLI::Range(0, 30))
      ->capture_default_str();
  command
      .add_option("--memory", o.memory, "budget of the caches, e.g. 2GiB; default from the machine")
      ->transform(CLI::AsSizeValue(false));
  command.add_option("--threads", o.threads, "0 for all processors")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
  command.add_option("--work-dir", o.work_dir, "folder of intermediate data; default OUT.work");
  command.add_flag("--keep-work", o.keep_work, "leave the intermediate data for inspection");
  command.add_option("--report", o.report, "write a JSON report");
  command.add_option("--preview", o.preview, "write a PNG: scan, field, iso-lines, remesh");
  auto* quiet = command.add_flag("--quiet", args.quiet, "only warnings and errors");
  command.add_flag("--verbose", args.verbose, "a line for every stage")->excludes(quiet);
}

int run(Arguments& args) {
  RemeshOptions& o = args.options;
  if (args.faces > 0.0) {
    o.size_kind = SizeKind::kFaces;
    o.size = args.faces;
  } else if (args.edge_length > 0.0) {
    o.size_kind = SizeKind::kEdgeLength;
    o.size = args.edge_length;
  } else if (args.ratio > 0.0) {
    o.size_kind = SizeKind::kRatio;
    o.size = args.ratio;
  }
  o.crease = args.crease == "off" ? 0.0 : std::stod(args.crease);
  if (args.smoothing > 0.0) {
    o.smoothing = args.smoothing;
  }
  const Verbosity verbosity = args.quiet     ? Verbosity::kQuiet
                              : args.verbose ? Verbosity::kVerbose
                                             : Verbosity::kNormal;
  RemeshReport report;
  {
    Console console(verbosity);
    report = remesh_scan(o, console);
  }
  if (verbosity != Verbosity::kQuiet) {
    fmt::print("{}: {} faces, {:.1f} % quads, {} bytes, {:.1f} s\n", o.output, report.output.faces,
               report.output.faces == 0 ? 0.0
                                        : 100.0 * static_cast<double>(report.output.quads) /
                                              static_cast<double>(report.output.faces),
               report.output.bytes, report.seconds);
  }
  return 0;
}

}  // namespace

void add_remesh_command(CLI::App& app, Action& action) {
  auto args = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("remesh", "Convert one scan into a curvature-aligned quad-dominant mesh.");
  command->add_option("scan", args->options.scan, "PLY, OBJ or OFF file")->required();
  command
      ->add_option("-o,--output", args->options.output, "remesh to write: .drc, .obj, .ply or .off")
      ->required();
  add_size_options(*command, *args);
  add_method_options(*command, *args);
  add_run_options(*command, *args);
  command->callback([args, &action] { action = [args] { return run(*args); }; });
}

}  // namespace rattan
