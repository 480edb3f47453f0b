// SPDX-License-Identifier: MIT
#include "jobs/remesh_plan.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include <fmt/format.h>
#include <oneapi/tbb/task_arena.h>

#include "engine/core/memory_budget.h"
#include "engine/mesh/ingest.h"
#include "io/layout/layout_writer.h"
#include "io/scan/scan_reader.h"
#include "jobs/memory_plan.h"
#include "jobs/memory_share.h"
#include "jobs/output_names.h"
#include "jobs/remesh_cost.h"
#include "jobs/scan_job.h"
#include "jobs/target_size.h"

namespace rattan {

namespace {

namespace fs = std::filesystem;

/// Of sides of ten mean edges, where triangles are about equilateral.
constexpr double kChartsPerTriangle = 0.00433;

class CountingSink final : public ScanSink {
 public:
  void add_vertices(std::span<const Vec3d> positions) override { vertices += positions.size(); }
  void add_colours(std::span<const Rgba>) override {}
  void add_triangles(std::span<const std::array<std::uint64_t, 3>> t) override {
    triangles += t.size();
  }
  std::uint64_t vertices = 0;
  std::uint64_t triangles = 0;
};

std::uint64_t free_space(fs::path directory) {
  directory = fs::absolute(directory);
  std::error_code error;
  while (!fs::exists(directory, error) && directory.has_relative_path()) {
    directory = directory.parent_path();
  }
  const fs::space_info space = fs::space(directory, error);
  return error ? 0 : space.available;
}

/// What the scan's file says, and what is granted.
RemeshPlan look_at(const ScanOptions& options, ProgressSink& progress) {
  RemeshPlan plan;
  plan.scan = options.scan;
  plan.budget = options.memory > 0 ? options.memory : default_memory_share();
  plan.threads =
      options.threads > 0 ? options.threads : oneapi::tbb::this_task_arena::max_concurrency();
  progress.progress("reading", 0, 1);
  CountingSink counted;
  ScanFileInfo info;
  read_scan(options.scan, counted, &info, {.memory_bytes = plan.budget / 2});
  plan.format = info.format;
  plan.file_bytes = info.bytes;
  plan.triangles = counted.triangles;
  const bool soup = is_soup(counted.vertices, counted.triangles);
  plan.vertices = soup ? (counted.triangles + 1) / 2 : counted.vertices;
  plan.tiles = (plan.vertices + options.tile_size - 1) / options.tile_size;
  plan.whole_scan = kLiveBytesPerVertex * plan.vertices;
  plan.disk = kDiskBytesPerVertex * plan.vertices;
  return plan;
}

void finish(RemeshPlan& plan, const MemoryWish& wish, const std::string& directory,
            double cpu_seconds) {
  plan.least_budget = least_budget(wish);
  plan.whole_scan += plan.least_budget;
  plan.work_directory = directory;
  plan.disk_free = free_space(directory);
  plan.seconds = remesh_wall_seconds(cpu_seconds, plan.threads) +
                 remesh_disk_seconds(plan.whole_scan, plan.budget);
}

}  // namespace

RemeshPlan plan_remesh(const RemeshOptions& given, ProgressSink& progress) {
  const RemeshOptions options = given.resolved();
  RemeshPlan plan = look_at(options, progress);
  plan.faces = asked_faces(options, plan.triangles);
  plan.passes = kPassesPerSize * static_cast<int>(options.sizes.size());
  finish(plan,
         {.vertices = plan.vertices,
          .faces = plan.faces,
          .threads = plan.threads,
          .picture = !options.preview.empty()},
         options.work_dir.empty() ? output_names(options)[0] + ".work" : options.work_dir,
         remesh_cpu_seconds(static_cast<double>(plan.triangles), plan.faces,
                            static_cast<double>(options.sizes.size())));
  return plan;
}

RemeshPlan plan_layout(const LayoutOptions& options, ProgressSink& progress) {
  check_layout_output(options.output);
  check_folder(options.output);
  check_layout_files(options, std::vector{options.scan});
  RemeshPlan plan = look_at(options, progress);
  const auto triangles = static_cast<double>(plan.triangles);
  plan.layout = true;
  plan.charts = options.chart_size > 0.0 ? 0.0 : kChartsPerTriangle * triangles;
  plan.passes = kPassesPerLayout;
  finish(plan,
         {.vertices = plan.vertices,
          .threads = plan.threads,
          .picture = !options.preview.empty(),
          .charts = plan.charts},
         options.work_dir.empty() ? options.output + ".work" : options.work_dir,
         layout_cpu_seconds(triangles));
  // Encoding comes when what the charts took is given back.
  const std::uint64_t writer =
      layout_write_bytes(options.output, kLayoutTriangles * plan.triangles) +
      memory_need({.vertices = plan.vertices, .threads = plan.threads}, plan.budget).total();
  plan.least_budget = std::max(plan.least_budget, writer);
  return plan;
}

std::string describe(const RemeshPlan& p) {
  std::string text = fmt::format("scan      {}: {}, {}, {} vertices, {} triangles\n", p.scan,
                                 p.format, format_bytes(p.file_bytes), p.vertices, p.triangles);
  text += p.layout ? (p.charts > 0.0 ? fmt::format("layout    about {:.0f} charts\n", p.charts)
                                     : "layout    as many charts as the area takes\n")
          : p.faces > 0.0 ? fmt::format("remesh    {:.0f} faces\n", p.faces)
                          : "remesh    as many faces as the area takes\n";
  text += fmt::format("tiles     {}\n", p.tiles);
  text +=
      fmt::format("memory    at least {}, granted {}; {} would keep everything in memory{}\n",
                  format_bytes(p.least_budget), format_bytes(p.budget), format_bytes(p.whole_scan),
                  p.least_budget <= p.budget ? "" : " -- TOO LITTLE");
  text += fmt::format("disk      up to {} in {}{}{}\n", format_bytes(p.disk), p.work_directory,
                      p.disk_free > 0 ? fmt::format(", {} free", format_bytes(p.disk_free)) : "",
                      p.disk_free > 0 && p.disk > p.disk_free ? " -- TOO LITTLE" : "");
  text += fmt::format("passes    about {} over the scan\n", p.passes);
  text += fmt::format("time      about {} with {} thread{}\n",
                      p.seconds < 90.0 ? fmt::format("{:.0f} s", std::ceil(p.seconds))
                                       : fmt::format("{:.0f} min", p.seconds / 60.0),
                      p.threads, p.threads == 1 ? "" : "s");
  return text;
}

}  // namespace rattan
