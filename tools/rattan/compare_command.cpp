// SPDX-License-Identifier: MIT
#include <fstream>
#include <memory>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "engine/core/errors.h"
#include "jobs/compare_job.h"
#include "tools/rattan/commands.h"
#include "tools/rattan/console.h"

namespace rattan {

namespace {

struct Arguments {
  CompareOptions options;
  std::string json;
  bool quiet = false;
};

void print_distances(const char* name, const OneWayDistances& d, double diagonal) {
  const double percent = diagonal > 0.0 ? 100.0 / diagonal : 0.0;
  fmt::print("{:<22} mean {:.4f}  rms {:.4f}  99 % {:.4f}  max {:.4f}  % of the diagonal\n", name,
             percent * d.mean, percent * d.rms, percent * d.p99, percent * d.max);
}

void print_topology(const char* name, std::uint64_t components, std::uint64_t loops,
                    std::int64_t euler) {
  fmt::print("{:<22} {} components, {} boundary loops, Euler characteristic {}\n", name, components,
             loops, euler);
}

void print_defects(const MeshTopology& t, const MeshQuality& q) {
  fmt::print(
      "defects                non-manifold edges {}, non-manifold vertices {}, inconsistent edges "
      "{}, repeated vertices {}, duplicate faces {}, interior valence two {}, inverted quads {}, "
      "faces of other degrees {}, short loops {}, unused vertices {}\n",
      t.non_manifold_edges, t.non_manifold_vertices, t.inconsistent_edges, t.repeated_vertex,
      t.duplicate_faces, t.valence_two, q.bad_quads, t.bad_degree, t.short_loops, t.unreferenced);
}

void print(const CompareReport& r) {
  const MeshQuality& q = r.quality;
  const double irregular = q.interior_vertices > 0 ? static_cast<double>(q.irregular_vertices) /
                                                         static_cast<double>(q.interior_vertices)
                                                   : 0.0;
  fmt::print("faces                  {}\n", r.remesh.faces);
  fmt::print("quads                  {:.2f} %\n", 100.0 * q.quad_share);
  fmt::print("irregular vertices     {:.2f} % of {} interior ones\n", 100.0 * irregular,
             q.interior_vertices);
  fmt::print("scaled Jacobian        mean {:.4f}  min {:.4f}\n", q.mean_scaled_jacobian,
             q.min_scaled_jacobian);
  fmt::print("corner deviation       {:.3f} degrees\n", q.mean_corner_deviation);
  fmt::print("edge-length variation  {:.4f} (mean {:.6g})\n", q.edge_length_variation,
             q.mean_edge_length);
  print_distances("remesh to scan", r.distance.to_input, r.distance.diagonal);
  print_distances("scan to remesh", r.distance.from_input, r.distance.diagonal);
  print_topology("topology of the remesh", r.remesh.components, r.remesh.boundary_loops,
                 r.remesh.euler());
  print_topology("topology of the scan", r.scan.components, r.scan.boundary_loops, r.scan.euler());
  fmt::print("same topology          {}\n", r.same_topology() ? "yes" : "no");
  print_defects(r.remesh, q);
}

void write_json(const CompareReport& report, const std::string& path) {
  const std::string text = to_json(report).dump(2) + '\n';
  if (path == "-") {
    fmt::print("{}", text);
    return;
  }
  std::ofstream file(path, std::ios::trunc);
  file << text;
  file.close();
  if (!file) {
    throw ResourceError(path +
                        ": the figures cannot be written. Check the folder and the free "
                        "space.");
  }
}

int run(const Arguments& args) {
  CompareReport report;
  {
    Console console(args.quiet ? Verbosity::kQuiet : Verbosity::kNormal);
    report = compare_surfaces(args.options, console);
  }
  if (args.json != "-" && !args.quiet) {
    print(report);
  }
  if (!args.json.empty()) {
    write_json(report, args.json);
  }
  return 0;
}

}  // namespace

void add_compare_command(CLI::App& app, Action& action) {
  auto args = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand(
      "compare", "Measure a mesh: quality, topology, distances to and from a scan.");
  command
      ->add_option("remesh", args->options.remesh,
                   "mesh to judge: .drc, .obj, .ply, .off or a scan")
      ->required();
  command->add_option("scan", args->options.scan, "surface to compare with: any scan or .drc")
      ->required();
  command->add_option("--json", args->json, "write the figures as JSON; - for standard output")
      ->type_name("FILE");
  command
      ->add_option("--samples", args->options.samples,
                   "points spread over each surface, beside all vertices")
      ->check(CLI::Range(std::uint64_t{0}, std::uint64_t{1000000000}))
      ->capture_default_str();
  command
      ->add_option("--memory", args->options.memory,
                   "budget of the caches, e.g. 2GiB; default from the machine")
      ->transform(CLI::AsSizeValue(false));
  command->add_option("--threads", args->options.threads, "threads at work, 0 for one a processor")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
  command
      ->add_option("--work-dir", args->options.work_dir,
                   "folder of intermediate data; default in the temporary folder")
      ->type_name("DIR");
  command->add_flag("--quiet", args->quiet, "print nothing but errors");
  command->callback([args, &action] { action = [args] { return run(*args); }; });
}

}  // namespace rattan
