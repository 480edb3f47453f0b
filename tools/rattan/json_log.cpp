// SPDX-License-Identifier: MIT
#include "tools/rattan/json_log.h"

#include <cerrno>
#include <string_view>
#include <thread>
#include <unistd.h>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "jobs/layout_report.h"
#include "jobs/memory_share.h"
#include "jobs/stage_clock.h"
#include "jobs/version.h"
#include "tools/manual/option_table.h"
#include "tools/rattan/exit_code.h"

namespace rattan {

namespace {

using Json = nlohmann::ordered_json;

constexpr std::chrono::seconds kBetweenProgress{1};
// Longer than any write takes that will end.
constexpr std::chrono::seconds kLockPatience{1};

}  // namespace

std::string utc_now() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(now).count();
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z",
                     fmt::gmtime(static_cast<std::time_t>(ms / 1000)), ms % 1000);
}

JsonLog::JsonLog(int fd) : fd_(fd), start_(wall_seconds()), last_progress_(Clock::now()) {}

Json JsonLog::event(const char* name) const {
  Json line;
  line["time"] = utc_now();
  line["event"] = name;
  line["scan"] = scan_.empty() ? Json() : Json(scan_);
  return line;
}

void JsonLog::write(const Json& line) {
  const std::string text = line.dump(-1, ' ', false, Json::error_handler_t::replace) + '\n';
  // A thread that is stuck in a write to a full pipe doesn't keep the end from being told.
  std::unique_lock lock(mutex_, kLockPatience);
  std::string_view rest = text;
  while (!rest.empty()) {
    const ssize_t written = ::write(fd_, rest.data(), rest.size());
    if (written < 0 && errno != EINTR) {
      return;  // nobody is left to tell
    }
    rest.remove_prefix(written < 0 ? 0 : static_cast<std::size_t>(written));
  }
}

void JsonLog::start(const ScanOptions& options) {
  Json line = event("start");
  line["output"] = options.output;
  line["threads"] = options.threads;
  line["memory"] = options.memory;
  line["rattan"] = std::string(version()) + " " + commit();
  write(line);
}

void JsonLog::progress(std::string_view stage, std::uint64_t done, std::uint64_t total) {
  if (quiet_) {
    return;
  }
  const Clock::time_point now = Clock::now();
  {
    const std::scoped_lock lock(progress_mutex_);
    if (now - last_progress_ < kBetweenProgress) {
      return;
    }
    last_progress_ = now;
  }
  Json line = event("progress");
  line["stage"] = stage;
  line["done"] = done;
  line["total"] = total;
  write(line);
}

void JsonLog::warning(const std::string& sentence) {
  Json line = event("warning");
  line["text"] = sentence;
  write(line);
}

void JsonLog::scan_read(const ScanTopology& scan) {
  read_ = scan;
}

void JsonLog::stage_ended(const StageRecord& stage) {
  Json line = event("stage");
  line["name"] = stage.name;
  line["seconds"] = stage.seconds;
  line["cpu_seconds"] = stage.cpu_seconds;
  line["passes"] = stage.passes;
  line["bytes_read"] = stage.bytes_read;
  line["bytes_written"] = stage.bytes_written;
  line["bytes_moved"] = stage.bytes_moved;
  line["resumed"] = stage.resumed;
  line["vertices"] = read_.vertices;
  line["triangles"] = read_.triangles;
  write(line);
}

void JsonLog::output_written(const RemeshReport::Finished& finished) {
  const auto& output = finished.output;
  Json line = event("output");
  line["path"] = output.path;
  line["vertices"] = output.vertices;
  line["faces"] = output.faces;
  line["quads"] = output.quads;
  line["irregular_vertices"] = output.irregular_vertices;
  line["bytes"] = output.bytes;
  write(line);
}

void JsonLog::layout_written(const LayoutReport& report) {
  Json line = event("output");
  line["path"] = report.output.path;
  line["vertices"] = report.output.vertices;
  line["triangles"] = report.output.triangles;
  line["charts"] = report.charts.charts;
  line["bytes"] = report.output.bytes;
  const std::vector<std::string> files = layout_files(report.options);
  line["files"] = files;
  write(line);
}

void JsonLog::plan(const RemeshPlan& plan) {
  Json line = event("plan");
  line["format"] = plan.format;
  line["file_bytes"] = plan.file_bytes;
  line["vertices"] = plan.vertices;
  line["triangles"] = plan.triangles;
  line[plan.layout ? "charts" : "faces"] = plan.layout ? plan.charts : plan.faces;
  line["tiles"] = plan.tiles;
  line["least_memory"] = plan.least_budget;
  line["memory"] = plan.budget;
  line["whole_scan_memory"] = plan.whole_scan;
  line["work_directory"] = plan.work_directory;
  line["disk"] = plan.disk;
  line["disk_free"] = plan.disk_free;
  line["passes"] = plan.passes;
  line["threads"] = plan.threads;
  line["seconds"] = plan.seconds;
  line["fits"] = plan.fits();
  write(line);
}

void JsonLog::stopping(const std::string& sentence) {
  Json line = event("stopping");
  line["text"] = sentence;
  write(line);
}

void JsonLog::error(const std::string& sentence, int exit) {
  Json line = event("error");
  line["text"] = sentence;
  line["exit"] = exit;
  write(line);
  end(exit);
}

void JsonLog::end(int exit) {
  Json line = event("end");
  line["exit"] = exit;
  line["seconds"] = wall_seconds() - start_;
  line["cpu_seconds"] = cpu_seconds();
  line["peak_rss_bytes"] = peak_rss_bytes();
  write(line);
}

void add_log_format_option(CLI::App& command) {
  command
      .add_option("--log-format",
                  "json: an event a line on stderr, nothing else there or on stdout")
      ->check(CLI::IsMember({"text", "json"}).description(""))
      ->type_name("text|json")
      ->group(more("Run"));
}

bool json_log_wanted(int argc, const char* const* argv) {
  constexpr std::string_view kName = "--log-format";
  bool wanted = false;
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    if (word == "--") {
      break;
    }
    if (word == kName && i + 1 < argc) {
      wanted = std::string_view(argv[i + 1]) == "json";
    } else if (word.substr(0, kName.size()) == kName && word.size() > kName.size() &&
               word[kName.size()] == '=') {
      wanted = word.substr(kName.size() + 1) == "json";
    }
  }
  return wanted;
}

}  // namespace rattan
