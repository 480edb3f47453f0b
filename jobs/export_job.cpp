// SPDX-License-Identifier: MIT
#include "jobs/export_job.h"

#include <array>
#include <filesystem>
#include <optional>

#include <fmt/format.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>

#include "engine/core/errors.h"
#include "engine/core/memory_budget.h"
#include "engine/mesh/scan_record.h"
#include "io/store/hdf5_store.h"
#include "io/store/work_lock.h"
#include "jobs/export_tile.h"
#include "jobs/memory_plan.h"
#include "jobs/memory_share.h"
#include "jobs/version.h"
#include "jobs/work_record.h"

namespace rattan {

namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMiB = std::uint64_t{1} << 20;
constexpr std::uint64_t kProcess = 40 * kMiB;
/// A tile at work: what is read of it, its coordinates, and its rows of all arrays.
constexpr std::uint64_t kTile = 14 * kMiB;
constexpr std::uint64_t kBytesPerVertex = 8;

void check_paths(const ExportOptions& options) {
  const fs::path output(options.output);
  const std::string extension = output.extension().string();
  if (extension != ".vtkhdf" && extension != ".hdf") {
    throw UsageError(options.output +
                     ": fields are written as VTKHDF. Use a name that ends in .vtkhdf or .hdf.");
  }
  const fs::path folder = output.has_parent_path() ? output.parent_path() : fs::path(".");
  std::error_code ignored;
  if (!fs::is_directory(folder, ignored)) {
    throw UsageError(folder.string() + ": there is no such folder to write " + options.output +
                     " into. Create it first.");
  }
  if (!fs::is_directory(options.work, ignored)) {
    throw InputError(options.work, "", "there is no such directory",
                     "Give the work directory of a run with --keep-work, or of one that was "
                     "interrupted");
  }
  if (const auto holder = WorkLock::holder(options.work)) {
    throw ResourceError(options.work + ": " + *holder +
                        " is at work in this directory. Wait for it to end, or stop it.");
  }
}

void check_contents(const Hdf5Store& store, const std::string& work) {
  if (store.has_chunk(fields::kScanRecord.name, TileId(0))) {
    return;
  }
  if (store.has_checkpoint()) {
    throw InputError(work, "",
                     "the run was interrupted before the scan was in order, so there is "
                     "nothing to export yet",
                     "Let it go on for longer");
  }
  throw InputError(work, "", "the folder holds no work of Rattan's",
                   "Give the work directory of a run with --keep-work, or of one that was "
                   "interrupted");
}

int tiles_at_work(std::uint64_t memory, int threads) {
  const std::uint64_t room = memory > kProcess ? (memory - kProcess) / 2 / kTile : 0;
  return static_cast<int>(
      std::clamp<std::uint64_t>(room, 1, 2 * static_cast<std::uint64_t>(threads) + 2));
}

std::uint64_t memory_need(std::uint64_t vertices, int tiles) {
  return kProcess + kBytesPerVertex * vertices + static_cast<std::uint64_t>(tiles) * kTile;
}

void check_memory(const std::string& work, std::uint64_t memory, std::uint64_t vertices) {
  const std::uint64_t least = (memory_need(vertices, 1) + kMiB - 1) / kMiB;
  if (memory < least * kMiB) {
    throw ResourceError(fmt::format(
        "{}: a memory budget of {} is too small; its fields take {} MiB. Allow --memory {}MiB.",
        work, format_bytes(memory), least, least));
  }
}

std::vector<std::string> missing(const WorkContents& work) {
  std::vector<std::string> words;
  const auto unless = [&](bool there, const char* what) {
    if (!there) {
      words.emplace_back(what);
    }
  };
  unless(work.geometry, "curvature");
  unless(work.field.has_value(), "the smoothed field");
  unless(work.phase.has_value(), "the phases");
  return words;
}

void add_solves(VtkHdfWriter& file, const WorkContents& work) {
  std::vector<SolveReport> reports;
  if (work.field) {
    reports = work.field->reports;
  }
  if (work.phase) {
    reports.push_back(work.phase->report);
  }
  if (reports.empty()) {
    return;
  }
  std::vector<std::string> systems;
  std::vector<double> energies;
  std::vector<double> unit_energies;
  std::vector<std::int64_t> iterations;
  for (const SolveReport& r : reports) {
    systems.push_back(r.system);
    energies.push_back(r.energy);
    unit_energies.push_back(r.energy_unit);
    iterations.push_back(static_cast<std::int64_t>(r.iterations));
  }
  file.add_field("solver_system", systems);
  file.add_field("solver_energy", energies);
  file.add_field("solver_energy_unit", unit_energies);
  file.add_field("solver_iterations", iterations);
}

void add_facts(VtkHdfWriter& file, const WorkContents& work, const Hdf5Store& store) {
  const auto number = [&](const char* name, double value) {
    file.add_field(name, std::span<const double>(&value, 1));
  };
  const auto count = [&](const char* name, std::int64_t value) {
    file.add_field(name, std::span<const std::int64_t>(&value, 1));
  };
  const double unit = work.scan.unit;
  file.add_field("rattan", {fmt::format("{} {}", version(), commit())});
  file.add_field("options", {store.note(kOptionsNote).value_or("")});
  file.add_field("units", {"lengths and positions in the unit of the scan's file, angles in "
                           "radians, curvatures in 1/length; an energy has no unit"});
  number("unit", unit);
  file.add_field("origin", std::span<const double>(work.scan.origin.data(), 3), 3);
  number("mean_edge_length", work.scan.mean_edge_length * unit);
  if (work.field) {
    number("quad_side", work.field->quad_side * unit);
    number("fitting_length", work.field->fitting_length * unit);
    number("curl_power", work.field->curl_power);
    count("symmetry", work.field->symmetry);
  }
  if (work.phase) {
    number("omega", work.phase->omega * unit);
    count("density", work.phase->density);
  }
  add_solves(file, work);
}

void add_sums(VtkHdfWriter& file, const ExportSums& sums) {
  const SingularityCounts& s = sums.singularities;
  const auto as_signed = [](std::uint64_t n) { return static_cast<std::int64_t>(n); };
  const std::array<std::int64_t, 3> kinds{
      as_signed(s.field_triangles), as_signed(s.phase_triangles), as_signed(s.negative_triangles)};
  const std::array<std::int64_t, 1> vertices{as_signed(s.vertices)};
  const std::array<std::int64_t, 1> edges{as_signed(s.edges)};
  const std::array<double, 2> energy{sums.edge_energy, sums.pin_energy};
  file.add_field("singular_triangles", kinds);
  file.add_field("singular_vertices", vertices);
  file.add_field("singular_edges", edges);
  file.add_field("energy_of_edges_and_pins", energy);
}

}  // namespace

ExportSummary export_work(const ExportOptions& options, ProgressSink& progress,
                          const std::stop_token& stop) {
  check_paths(options);
  const std::uint64_t memory = options.memory > 0 ? options.memory : default_memory_share();
  const int threads =
      options.threads > 0 ? options.threads : oneapi::tbb::this_task_arena::max_concurrency();
  const oneapi::tbb::global_control parallelism(
      oneapi::tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
  check_memory(options.work, memory, 0);
  MemoryBudget budget(memory);
  Hdf5Store store({.directory = options.work,
                   .cache_bytes = memory,
                   .budget = &budget,
                   .keep = true,
                   .read_only = true});
  check_contents(store, options.work);
  const WorkContents work = WorkContents::of(store);
  const std::uint64_t vertices = work.scan.topology.vertices;
  check_memory(options.work, memory, vertices);
  const int tiles = tiles_at_work(memory, threads);
  const Reservation held = budget.reserve(memory_need(vertices, tiles), "tiles at work");

  ExportSummary summary;
  summary.points = vertices;
  summary.triangles = work.scan.topology.triangles;
  summary.missing = missing(work);
  VtkHdfWriter file(options.output, vertices, summary.triangles);
  TileExporter exporter(store, work, file);
  add_facts(file, work, store);
  TaskGraph tasks({.threads = threads, .tiles_in_flight = tiles}, &progress, stop);
  tasks.run("export", work.scan.layout.tile_count(), [&](TileId id) { return exporter.task(id); });
  if (work.phase) {
    add_sums(file, exporter.sums());
  }
  file.commit();
  std::error_code ignored;
  summary.bytes = fs::file_size(options.output, ignored);
  return summary;
}

}  // namespace rattan
