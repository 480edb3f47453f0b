// SPDX-License-Identifier: MIT
#pragma once

// The report of one layout. Names are a contract: see the README's table.

#include <cstdint>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "engine/layout/flat_layout.h"
#include "engine/param/triangle_coordinates.h"
#include "jobs/layout_options.h"
#include "jobs/report.h"

namespace rattan {

/// As in PGP Table I; see engine/param/distortion.h.
struct DistortionFigures {
  double stretch = 1.0;      ///< over the best 99 % of the area
  double stretch_raw = 1.0;  ///< over all of it
  double shear = 0.0;
};

struct LayoutReport : RunRecord {
  LayoutOptions options;
  struct {
    std::string path;
    std::uint64_t bytes = 0;
    Vec3d origin = Vec3d::Zero();
    std::uint64_t vertices = 0;
    std::uint64_t texture_vertices = 0;
    std::uint64_t triangles = 0;
    double texture_step = 0.0;
    std::string charts;       ///< path
    std::string image;        ///< path, or empty
    std::string material;     ///< path, or empty
    double atlas_used = 0.0;  ///< share of the unit square that charts fill; 0 without an atlas
  } output;
  struct {
    std::string path;
    std::uint64_t bytes = 0;
    std::uint64_t vertices = 0;
    std::uint64_t quads = 0;
    std::uint64_t components = 0;
    std::uint64_t boundary_loops = 0;
    std::int64_t euler = 0;
  } base;
  SingularityCounts singularities;
  double asked_side = 0.0;      ///< of a chart, in file units
  double side = 0.0;            ///< what it became
  std::uint64_t not_disks = 0;  ///< charts that had to be cut at that side
  std::uint64_t crowded = 0;    ///< charts with more than kManyChartSides sides
  std::uint32_t parts = 0;
  std::uint32_t units = 1;
  FlatCounts charts;
  DistortionFigures distortion;  ///< of the parameterization as solved
  DistortionFigures repaired;    ///< of what is written
  double worst_chart_stretch = 1.0;
  double worst_chart_shear = 0.0;
};

nlohmann::ordered_json to_json(const LayoutReport& report);
/// Throws ResourceError when the file cannot be written.
void write_report(const LayoutReport& report, const std::string& path);

}  // namespace rattan
