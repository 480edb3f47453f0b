// SPDX-License-Identifier: MIT
#include "jobs/layout_report.h"

#include <algorithm>

#include <nlohmann/json.hpp>

namespace rattan {

namespace {

using Json = nlohmann::ordered_json;

Json options_json(const LayoutOptions& o) {
  Json j;
  j["chart_size"] = o.chart_size > 0.0 ? Json(o.chart_size) : Json("auto");
  j["relax"] = o.relax;
  j["atlas"] = o.atlas || o.bake > 0;
  j["bake"] = o.bake;
  add_scan_options(j, o);
  return j;
}

Json distortion_json(const DistortionFigures& d) {
  return {{"stretch", d.stretch}, {"stretch_raw", d.stretch_raw}, {"shear", d.shear}};
}

Json path_or_null(const std::string& path) {
  return path.empty() ? Json() : Json(path);
}

}  // namespace

nlohmann::ordered_json to_json(const LayoutReport& r) {
  Json j = run_head(r);
  j["options"] = options_json(r.options);
  const auto& o = r.output;
  j["output"] = {{"path", o.path},
                 {"bytes", o.bytes},
                 {"origin", {o.origin.x(), o.origin.y(), o.origin.z()}},
                 {"vertices", o.vertices},
                 {"texture_vertices", o.texture_vertices},
                 {"triangles", o.triangles},
                 {"texture_step", o.texture_step},
                 {"charts", o.charts},
                 {"image", path_or_null(o.image)},
                 {"material", path_or_null(o.material)},
                 {"atlas_used", o.atlas_used}};
  j["base_complex"] = {{"path", r.base.path},
                       {"bytes", r.base.bytes},
                       {"vertices", r.base.vertices},
                       {"quads", r.base.quads},
                       {"components", r.base.components},
                       {"boundary_loops", r.base.boundary_loops},
                       {"euler", r.base.euler}};
  const SingularityCounts& s = r.singularities;
  j["singularities"] = {{"vertices", s.vertices},
                        {"edges", s.edges},
                        {"triangles", s.field_triangles + s.phase_triangles + s.negative_triangles},
                        {"field_triangles", s.field_triangles},
                        {"phase_triangles", s.phase_triangles},
                        {"folded_triangles", s.negative_triangles}};
  const FlatCounts& c = r.charts;
  const double charts = std::max(1.0, static_cast<double>(c.charts));
  j["charts"] = {{"count", c.charts},
                 {"quads", c.quads},
                 {"singular", c.singular},
                 {"split", c.split},
                 {"fixed", c.flattened + c.split},
                 {"unfolded", c.unfolded},
                 {"flattened", c.flattened},
                 {"at_boundary", c.bounded},
                 {"singular_share", c.singular / charts},
                 {"fixed_share", (c.flattened + c.split) / charts},
                 {"parts", r.parts},
                 {"units", r.units},
                 {"asked_side", r.asked_side},
                 {"side", r.side},
                 {"cut", r.not_disks},
                 {"crowded", r.crowded},
                 {"nudged_vertices", c.nudged},
                 {"thin_triangles", c.thin}};
  j["distortion"] = distortion_json(r.distortion);
  j["distortion"]["of_charts"] = distortion_json(r.repaired);
  j["distortion"]["worst_chart_stretch"] = r.worst_chart_stretch;
  j["distortion"]["worst_chart_shear"] = r.worst_chart_shear;
  add_run(j, r);
  return j;
}

void write_report(const LayoutReport& report, const std::string& path) {
  write_json_report(to_json(report), path);
}

}  // namespace rattan
