// SPDX-License-Identifier: MIT
#include "jobs/scan_job.h"

#include <filesystem>
#include <optional>
#include <system_error>

#include <fmt/format.h>
#include <oneapi/tbb/task_arena.h>

#include "engine/core/errors.h"
#include "engine/mesh/scan_record.h"
#include "io/scan/field_reader.h"
#include "io/scan/scan_reader.h"
#include "jobs/memory_plan.h"
#include "jobs/memory_share.h"
#include "jobs/repair_warnings.h"
#include "jobs/scan_token.h"
#include "jobs/version.h"

namespace rattan {

namespace {

/// The input files, read.
struct ReadInput {
  std::vector<std::string> hashes;  ///< of the scan's bytes, and of the directions if there are any
  IngestRecord ingest;
};

template <class A>
void members_of(A& a, ReadInput& r) {
  a(r.hashes);
  a(r.ingest);
}

}  // namespace

ScanJob::ScanJob(const ScanOptions& options, const JobPlace& place, const JobAttempt& attempt)
    : events_(place.events),
      start_(attempt.start),
      progress_(place.progress, record_.warnings),
      threads_(options.threads > 0 ? options.threads
                                   : oneapi::tbb::this_task_arena::max_concurrency()),
      parallelism_(oneapi::tbb::global_control::max_allowed_parallelism,
                   static_cast<std::size_t>(threads_)),
      memory_(options.memory > 0 ? options.memory : default_memory_share()),
      budget_(memory_),
      store_({.directory = place.work_directory,
              .cache_bytes = memory_,
              .budget = &budget_,
              .keep = true,
              .fresh = attempt.fresh}),
      steps_(store_, place.stop.soon, attempt.most_steps),
      tasks_({.threads = threads_, .tiles_in_flight = tiles_in_flight(memory_, threads_)},
             &progress_, place.stop.now, &steps_),
      clock_(
          tasks_,
          [this] {
            return StageClock::StoreTraffic{store_.bytes_read(), store_.bytes_written(),
                                            store_.bytes_moved()};
          },
          record_.stages,
          [this](const StageRecord& stage) {
            if (events_ != nullptr) {
              events_->stage_ended(stage);
            }
          }),
      scan_options_(options) {
  steps_.attach(clock_);
  steps_.save_only_if([&lock = place.lock] { return lock.held(); }, place.work_directory);
  if (options.checkpoint_seconds) {
    steps_.policy().force(*options.checkpoint_seconds);
  }
  for (const std::string& warning : attempt.warnings) {
    record_.warnings.push_back(warning);
  }
  for (const std::string& damage : store_.damage()) {
    progress_.warning(damage + " What it held is made again.");
  }
}

ScanMesh ScanJob::ingest() {
  InputToken scan(store_, "scan", scan_options_.scan);
  std::string inputs = fmt::format(
      "rattan={} {} scan={} tile-size={} merge-vertices={} drop-components={} fill-holes={}",
      version(), commit(), scan.text(), scan_options_.tile_size, scan_options_.merge_vertices,
      scan_options_.drop_components, scan_options_.fill_holes);
  std::optional<InputToken> directions;
  if (!scan_options_.field.empty()) {
    directions.emplace(store_, "field", scan_options_.field);
    inputs += " field=" + directions->text();
  }
  steps_.depend_on(inputs);
  const ReadInput input = steps_.run("read", [&] {
    Ingest ingest(store_, ingest_options());
    ScanFileInfo info;
    info.want_sha256 = true;
    read_scan(scan_options_.scan, ingest, &info, {.memory_bytes = memory_ / 2});
    ReadInput read;
    read.hashes.push_back(info.sha256);
    if (!scan_options_.field.empty()) {
      read.hashes.push_back(
          read_field(scan_options_.field, ingest.vertex_count(),
                     [&](std::span<const VertexDirection> d) { ingest.add_directions(d); }));
    }
    read.ingest = ingest.hand_over();
    return read;
  });
  record_.input.sha256 = input.hashes.at(0);
  scan.set_hash(input.hashes.at(0));
  if (directions) {
    field_hash_ = input.hashes.at(1);
  }
  steps_.before_long_step();
  const IngestRecord ordered = steps_.run("order", [&] {
    Ingest ingest(store_, ingest_options(), input.ingest);
    ingest.order();
    return ingest.hand_over();
  });
  steps_.before_long_step();
  steps_.run("tiles", [&] {
    Ingest ingest(store_, ingest_options(), ordered);
    save_scan_mesh(store_, ingest.finish(tasks_));
  });
  ScanMesh mesh = load_scan_mesh(store_);
  if (events_ != nullptr) {
    events_->scan_read(mesh.topology);
  }
  warn_of_repairs(scan_options_.scan, mesh.repaired, progress_);
  record_.input.path = scan_options_.scan;
  record_.input.topology = mesh.topology;
  record_.input.repaired = mesh.repaired;
  return mesh;
}

IngestOptions ScanJob::ingest_options() {
  IngestOptions options;
  options.tile_size = scan_options_.tile_size;
  options.memory_bytes = memory_ / 4;
  options.budget = &budget_;
  options.input_name = scan_options_.scan;
  options.merge = scan_options_.merge_vertices ? Merge::kAlways : Merge::kSoup;
  options.drop_components = scan_options_.drop_components;
  options.fill_holes = scan_options_.fill_holes;
  return options;
}

void ScanJob::finish_record() {
  record_.work_bytes = store_.peak_disk_bytes();
  record_.peak_rss_bytes = peak_rss_bytes();
  record_.memory_budget_bytes = memory_;
  record_.threads = threads_;
  record_.seconds = wall_seconds() - start_;
}

std::string after_damage(const DamagedFile& damage, int damages, ProgressSink& progress) {
  constexpr int kMostDamages = 100;
  if (damages > kMostDamages) {
    throw ResourceError(std::string(damage.what()) +
                        " It happens again and again: check the disk, or choose another directory "
                        "with --work-dir.");
  }
  std::string warning = std::string(damage.what()) + " What it held is made again.";
  progress.warning(warning);
  std::error_code ignored;
  std::filesystem::remove(damage.path(), ignored);
  return warning;
}

std::string how_to_resume(const Cancelled& e) {
  std::string what = e.what();
  what.erase(what.find_last_not_of('.') + 1);
  return what + "; run the same command again to resume.";
}

void check_folder(const std::string& output) {
  const std::filesystem::path folder = std::filesystem::path(output).parent_path();
  std::error_code error;
  if (!folder.empty() && !std::filesystem::is_directory(folder, error)) {
    throw InputError(output, "", "there is no such directory",
                     "Give a directory that exists and can be written to");
  }
}

}  // namespace rattan
