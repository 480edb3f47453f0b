// SPDX-License-Identifier: MIT
#include "tools/rattan/scan_arguments.h"

#include <map>
#include <string>

#include "tools/manual/option_table.h"

namespace rattan {

void add_repair_options(CLI::App& app, ScanOptions& o) {
  app.add_flag("--merge-vertices", o.merge_vertices,
               "make vertices at exactly equal positions one; done without asking only where "
               "triangles share no vertices")
      ->group(more("Scan"));
  app.add_option("--drop-components", o.drop_components,
                 "drop components of fewer triangles than this")
      ->type_name("N")
      ->group(more("Scan"));
  app.add_option("--fill-holes", o.fill_holes, "fill holes whose outline has at most so many edges")
      ->type_name("N")
      ->group(more("Scan"));
}

void add_field_options(CLI::App& app, ScanOptions& o, double& smoothing) {
  app.add_option("--field", o.field,
                 "directions to follow instead of the curvature: a text file with a line \"x y z\" "
                 "or \"x y z fidelity\" for each vertex of the scan file")
      ->type_name("FILE")
      ->group(more("Method"));
  app.add_option("--symmetry", o.symmetry, "field modulo 2 pi / N")
      ->check(CLI::IsMember({1, 2, 4}))
      ->default_str("4")
      ->type_name("1|2|4")
      ->group(more("Method"));
  app.add_option("--smoothing", smoothing,
                 "rho in (0, 1), larger is smoother; default from the size")
      ->check(CLI::Range(1e-6, 1.0 - 1e-9))
      ->type_name("RHO")
      ->group(more("Method"));
  app.add_flag("--curl-correction", o.curl_correction,
               "rescale the field in full: fewest singularities, uneven sizes")
      ->group(more("Method"));
}

void add_solver_options(CLI::App& app, ScanOptions& o) {
  app.add_option("--energy", o.energy, "weights of edges; default triangle, edge is the paper's")
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, Energy>{{"edge", Energy::kEdge}, {"triangle", Energy::kTriangle}}))
      ->type_name("edge|triangle")
      ->group(more("Method"));
  app.add_option("--solver", o.solver, "default nested; reference is the paper's, small scans")
      ->transform(CLI::CheckedTransformer(std::map<std::string, SolverKind>{
          {"nested", SolverKind::kNested}, {"reference", SolverKind::kReference}}))
      ->type_name("nested|reference")
      ->group(more("Method"));
  app.add_option("--newton-steps", o.newton_steps, "Newton-CG steps that finish the nested solve")
      ->check(CLI::Range(0, 1000))
      ->default_str(std::to_string(o.newton_steps))
      ->type_name("N")
      ->group(more("Method"));
}

void add_position_bits_option(CLI::App& app, ScanOptions& o) {
  app.add_option("--position-bits", o.position_bits, "bits per coordinate in a .drc, 0 for auto")
      ->check(CLI::Range(0, 30))
      ->default_str("0")
      ->type_name("BITS")
      ->group(more("Output"));
}

void add_resource_options(CLI::App& app, ScanOptions& o) {
  app.add_option("--memory", o.memory,
                 "most memory that the process may fill, e.g. 2GiB; default from the machine")
      ->transform(CLI::AsSizeValue(false))
      ->type_name("SIZE")
      ->group("Run");
  app.add_option("--threads", o.threads, "threads at work, 0 for one a processor")
      ->check(CLI::Range(0, 4096))
      ->default_str("0")
      ->type_name("N")
      ->group("Run");
  app.add_option("--work-dir", o.work_dir, "folder of intermediate data; default OUT.work")
      ->type_name("DIR")
      ->group("Run");
  app.add_flag("--keep-work", o.keep_work, "leave the intermediate data for inspection")
      ->group(more("Run"));
}

}  // namespace rattan
