// SPDX-License-Identifier: MIT
#include "jobs/report.h"

#include <algorithm>
#include <utility>

#include <nlohmann/json.hpp>

#include "io/file/atomic_file.h"
#include "jobs/version.h"

namespace rattan {

namespace {

using Json = nlohmann::ordered_json;

Json repaired_json(const RepairCounts& r) {
  Json j;
  for_each_count(r, [&](const char* name, std::uint64_t count) { j[name] = count; });
  return j;
}

Json options_json(const RemeshOptions& o) {
  Json j;
  const char* size_names[] = {"faces", "edge_length", "ratio"};
  j[size_names[static_cast<int>(o.size_kind)]] =
      o.sizes.size() == 1 ? Json(o.sizes[0]) : Json(o.sizes);
  j["density"] = o.density;
  j["pure_quads"] = o.pure_quads;
  add_scan_options(j, o);
  return j;
}

template <class Output, class Singularities, class Distance>
Json output_json(const Output& o, const Singularities& s, const Distance& d) {
  Json j;
  j["output"] = {{"path", o.path},
                 {"bytes", o.bytes},
                 {"origin", {o.origin.x(), o.origin.y(), o.origin.z()}},
                 {"target_faces", o.target_faces},
                 {"target_met", o.target_met},
                 {"vertices", o.vertices},
                 {"faces", o.faces},
                 {"quads", o.quads},
                 {"triangles", o.triangles},
                 {"interior_vertices", o.interior_vertices},
                 {"irregular_vertices", o.irregular_vertices},
                 {"bad_quads", o.bad_quads},
                 {"components", o.components},
                 {"boundary_loops", o.boundary_loops},
                 {"euler", o.euler},
                 {"mean_scaled_jacobian", o.mean_scaled_jacobian},
                 {"min_scaled_jacobian", o.min_scaled_jacobian},
                 {"mean_corner_deviation", o.mean_corner_deviation},
                 {"edge_length_variation", o.edge_length_variation}};
  j["singularities"] = {{"vertices", s.vertices}, {"edges", s.edges}, {"triangles", s.triangles}};
  j["distortion"] = {{"stretch", o.stretch}, {"shear", o.shear}};
  j["distance"] = {{"to_input_max", d.to_input.max},     {"to_input_rms", d.to_input.rms},
                   {"to_input_mean", d.to_input.mean},   {"from_input_max", d.from_input.max},
                   {"from_input_rms", d.from_input.rms}, {"from_input_mean", d.from_input.mean},
                   {"from_input_p99", d.from_input.p99}, {"diagonal", d.diagonal}};
  return j;
}

}  // namespace

void add_scan_options(nlohmann::ordered_json& j, const ScanOptions& o) {
  j["field"] = o.field.empty() ? Json() : Json(o.field);
  j["symmetry"] = o.symmetry;
  j["smoothing"] = o.smoothing ? Json(*o.smoothing) : Json("auto");
  j["curl_correction"] = o.curl_correction;
  j["energy"] = o.energy == Energy::kEdge ? "edge" : "triangle";
  j["solver"] = o.solver == SolverKind::kNested ? "nested" : "reference";
  j["newton_steps"] = o.newton_steps;
  j["position_bits"] = o.position_bits;
  j["tile_size"] = o.tile_size;
  j["merge_vertices"] = o.merge_vertices;
  j["drop_components"] = o.drop_components;
  j["fill_holes"] = o.fill_holes;
}

nlohmann::ordered_json run_head(const RunRecord& r) {
  Json j;
  j["rattan"] = {{"version", version()}, {"commit", commit()}};
  j["input"] = {{"path", r.input.path},
                {"sha256", r.input.sha256},
                {"vertices", r.input.topology.vertices},
                {"triangles", r.input.topology.triangles},
                {"components", r.input.topology.components},
                {"boundary_loops", r.input.topology.boundary_loops},
                {"euler", r.input.topology.euler()},
                {"repaired", repaired_json(r.input.repaired)}};
  return j;
}

void add_run(nlohmann::ordered_json& j, const RunRecord& r) {
  j["stages"] = Json::array();
  for (const StageRecord& s : r.stages) {
    j["stages"].push_back({{"name", s.name},
                           {"seconds", s.seconds},
                           {"cpu_seconds", s.cpu_seconds},
                           {"passes", s.passes},
                           {"bytes_read", s.bytes_read},
                           {"bytes_written", s.bytes_written},
                           {"bytes_moved", s.bytes_moved},
                           {"resumed", s.resumed}});
  }
  j["solver"] = Json::array();
  for (const SolveReport& s : r.solver) {
    j["solver"].push_back({{"system", s.system},
                           {"unknowns", s.unknowns},
                           {"iterations", s.iterations},
                           {"passes", s.passes},
                           {"energy", s.energy},
                           {"energy_unit", s.energy_unit},
                           {"gradient_norm", s.gradient_norm}});
  }
  j["warnings"] = r.warnings;
  const auto triangles =
      static_cast<double>(std::max<std::uint64_t>(r.input.topology.triangles, 1));
  j["work"] = {{"peak_bytes", r.work_bytes},
               {"bytes_per_triangle", static_cast<double>(r.work_bytes) / triangles}};
  j["peak_rss_bytes"] = r.peak_rss_bytes;
  j["memory_budget_bytes"] = r.memory_budget_bytes;
  j["threads"] = r.threads;
  j["seconds"] = r.seconds;
}

void write_json_report(const nlohmann::ordered_json& report, const std::string& path) {
  AtomicFile file(path);
  // A file name may be any bytes; JSON is UTF-8.
  file.write(report.dump(2, ' ', false, Json::error_handler_t::replace) + '\n');
  file.commit();
}

nlohmann::ordered_json to_json(const RemeshReport& r) {
  Json j = run_head(r);
  j["options"] = options_json(r.options);
  const Json first = output_json(r.output, r.singularities, r.distance);
  j["output"] = first["output"];
  j["singularities"] = first["singularities"];
  j["distortion"] = first["distortion"];
  j["distance"] = first["distance"];
  j["outputs"] = Json::array();
  for (const RemeshReport::Finished& f : r.outputs) {
    const Json figures = output_json(f.output, f.singularities, f.distance);
    Json entry = figures["output"];
    entry["singularities"] = figures["singularities"];
    entry["distortion"] = figures["distortion"];
    entry["distance"] = figures["distance"];
    entry["shared_with"] = f.shared_with.empty() ? Json() : Json(f.shared_with);
    j["outputs"].push_back(std::move(entry));
  }
  add_run(j, r);
  return j;
}

void write_report(const RemeshReport& report, const std::string& path) {
  write_json_report(to_json(report), path);
}

}  // namespace rattan
