// SPDX-License-Identifier: MIT
#include "jobs/batch/metrics.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <fcntl.h>
#include <initializer_list>
#include <string_view>
#include <unistd.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "engine/core/errors.h"
#include "jobs/version.h"

namespace rattan {

namespace {

// Ticks come once a second.
constexpr std::chrono::milliseconds kBetweenWrites{900};

double unix_now() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

/// Bytes that are no UTF-8 replaced.
std::string readable(const std::string& text) {
  using nlohmann::json;
  return json::parse(json(text).dump(-1, ' ', false, json::error_handler_t::replace));
}

std::string escaped(const std::string& value) {
  std::string text;
  for (const char c : readable(value)) {
    if (c == '\\' || c == '"') {
      text += '\\';
    }
    text += c == '\n' ? std::string("\\n") : std::string(1, c);
  }
  return text;
}

std::string number(std::uint64_t value) {
  return std::to_string(value);
}
std::string number(int value) {
  return std::to_string(value);
}
std::string number(double value) {
  return std::isnan(value)   ? "NaN"
         : std::isinf(value) ? (value > 0.0 ? "+Inf" : "-Inf")
                             : fmt::format("{}", value);
}

/// Families one after the other, each with its HELP and TYPE.
class Exposition {
 public:
  using Labels = BatchMetrics::Labels;
  explicit Exposition(const Labels& common) : common_(common) {}

  void family(std::string_view name, const char* type, const char* help) {
    name_ = fmt::format("rattan_{}", name);
    text_ += fmt::format("# HELP {0} {1}\n# TYPE {0} {2}\n", name_, help, type);
  }
  template <class Value>
  void sample(Value value, const Labels& labels = {}, const char* suffix = "") {
    std::string inner;
    for (const Labels* part : {&common_, &labels}) {
      for (const auto& [name, text] : *part) {
        inner += fmt::format("{}{}=\"{}\"", inner.empty() ? "" : ",", name, escaped(text));
      }
    }
    text_ += name_ + suffix + (inner.empty() ? "" : "{" + inner + "}") + " " + number(value) + "\n";
  }
  template <class Value>
  void single(std::string_view name, const char* type, const char* help, Value value) {
    family(name, type, help);
    sample(value);
  }
  std::string take() { return std::move(text_); }

 private:
  const Labels& common_;
  std::string name_;
  std::string text_;
};

constexpr const char* kCounter = "counter";
constexpr const char* kGauge = "gauge";

}  // namespace

BatchMetrics::BatchMetrics(std::string path, Labels labels)
    : path_(std::move(path)), labels_(std::move(labels)), start_time_(unix_now()) {
  if (!write()) {
    throw ResourceError("--metrics " + path_ +
                        ": the file cannot be written. Name one in a folder that exists and can be "
                        "written to.");
  }
}

void BatchMetrics::begun(const BatchState& state) {
  state_ = state;
  write();
}

void BatchMetrics::started(const BatchItem& item, const Attempt& /*attempt*/) {
  running_[item.id] = {};
}

void BatchMetrics::line(const BatchItem& item, const Attempt& /*attempt*/,
                        const nlohmann::json& event) {
  const std::string name = event.value("event", "");
  if (name == "stage") {
    running_[item.id].triangles = event.value("triangles", std::uint64_t{0});
    if (!event.value("resumed", false)) {  // what an earlier run did was counted there
      Stage& stage = stages_[event.value("name", "")];
      stage.seconds += event.value("seconds", 0.0);
      stage.cpu_seconds += event.value("cpu_seconds", 0.0);
      stage.bytes_moved += event.value("bytes_moved", std::uint64_t{0});
      stage.bytes_read += event.value("bytes_read", std::uint64_t{0});
      stage.bytes_written += event.value("bytes_written", std::uint64_t{0});
    }
  } else if (name == "output") {
    running_[item.id].faces += event.value("faces", std::uint64_t{0});
    running_[item.id].quads += event.value("quads", std::uint64_t{0});
  }
}

void BatchMetrics::ended(const BatchItem& item, const Attempt& attempt) {
  ++attempts_[attempt.exit];
  warnings_ += attempt.warnings;
  peak_rss_bytes_ = std::max(peak_rss_bytes_, attempt.peak_rss_bytes);
  if (!attempt.adopted) {
    scan_seconds_ += attempt.seconds;
    scan_cpu_seconds_ += attempt.cpu_seconds;
    const auto bound = std::lower_bound(kBounds.begin(), kBounds.end(), attempt.seconds);
    ++durations_[static_cast<std::size_t>(bound - kBounds.begin())];
  }
  if (attempt.exit == 0) {
    const Running& made = running_[item.id];
    triangles_ += made.triangles;
    faces_ += made.faces;
    quads_ += made.quads;
    input_bytes_ += item.scan_bytes;
    for (const OutputFile& output : attempt.outputs) {
      output_bytes_ += output.bytes;
    }
  }
  running_.erase(item.id);
}

void BatchMetrics::warning(const std::string& /*sentence*/) {
  ++warnings_;
}

void BatchMetrics::tick(const BatchState& state) {
  state_ = state;
  if (Clock::now() - last_write_ >= kBetweenWrites) {
    write();
  }
}

void BatchMetrics::finished(const BatchState& state, int exit_code) {
  state_ = state;
  exit_code_ = exit_code;
  write();
}

std::string BatchMetrics::text() const {
  const BatchState& s = state_;
  Exposition e(labels_);
  e.family("build_info", kGauge, "The program that runs the batch; always 1.");
  e.sample(1, {{"version", version()}, {"commit", commit()}});

  e.family("batch_scans", kGauge,
           "Scans of the batch by status; before means finished before this process began.");
  for (const auto& [status, count] : std::initializer_list<std::pair<const char*, std::uint64_t>>{
           {"done", s.done},
           {"done_before", s.before},
           {"unusable", s.unusable},
           {"resource", s.resource},
           {"defect", s.defect},
           {"interrupted", s.interrupted},
           {"failed_before", s.failed_before},
           {"running", s.running},
           {"elsewhere", s.elsewhere},
           {"pending", s.pending}}) {
    e.sample(count, {{"status", status}});
  }
  e.family("batch_attempts_total", kCounter, "Attempts that ended, by exit code of rattan remesh.");
  for (const int exit : {0, 1, 2, 3, 4, 75}) {
    const auto found = attempts_.find(exit);
    e.sample(found == attempts_.end() ? std::uint64_t{0} : found->second,
             {{"exit", std::to_string(exit)}});
  }
  e.single("batch_triangles_total", kCounter, "Triangles of the scans done.", triangles_);
  e.single("batch_faces_total", kCounter, "Faces of the remeshes written.", faces_);
  e.single("batch_quads_total", kCounter, "Quads among these faces.", quads_);
  e.single("batch_input_bytes_total", kCounter, "Bytes of the scan files done.", input_bytes_);
  e.single("batch_output_bytes_total", kCounter, "Bytes of the remeshes written.", output_bytes_);
  e.single("batch_warnings_total", kCounter, "Warnings of scans and of the batch.", warnings_);

  e.single("batch_seconds", kGauge, "Seconds since the batch began.", s.seconds);
  e.single("batch_cpu_seconds_total", kCounter,
           "Processor seconds of the batch and of its children that ended.", s.cpu_seconds);
  e.single("batch_scan_cpu_seconds_total", kCounter, "Processor seconds of attempts that ended.",
           scan_cpu_seconds_);
  e.family("batch_scan_seconds", "histogram", "Seconds of attempts that ended.");
  std::uint64_t below = 0;
  for (std::size_t b = 0; b < kBounds.size(); ++b) {
    below += durations_[b];
    e.sample(below, {{"le", number(kBounds[b])}}, "_bucket");
  }
  below += durations_.back();
  e.sample(below, {{"le", "+Inf"}}, "_bucket");
  e.sample(scan_seconds_, {}, "_sum");
  e.sample(below, {}, "_count");

  const auto stages = [&](const char* name, const char* help, const auto& value) {
    e.family(name, kCounter, help);
    for (const auto& [stage, figures] : stages_) {
      e.sample(value(figures), {{"stage", stage}});
    }
  };
  stages("batch_stage_seconds_total", "Seconds in each stage of the runs.",
         [](const Stage& f) { return f.seconds; });
  stages("batch_stage_cpu_seconds_total", "Processor seconds in each stage of the runs.",
         [](const Stage& f) { return f.cpu_seconds; });
  stages("batch_stage_moved_bytes_total", "Bytes of fields to and from the tiles at work.",
         [](const Stage& f) { return f.bytes_moved; });
  stages("batch_stage_disk_read_bytes_total", "Bytes of intermediate data read from disk.",
         [](const Stage& f) { return f.bytes_read; });
  stages("batch_stage_disk_written_bytes_total", "Bytes of intermediate data written to disk.",
         [](const Stage& f) { return f.bytes_written; });

  e.single("batch_peak_rss_bytes", kGauge, "Most resident memory of any run that ended.",
           peak_rss_bytes_);
  e.single("batch_memory_bytes", kGauge, "Memory that the batch may fill.", s.memory);
  e.single("batch_memory_granted_bytes", kGauge, "Memory granted to the runs at work.",
           s.memory_used);
  e.single("batch_threads", kGauge, "Threads that the batch may use.", s.threads);
  e.single("batch_threads_granted", kGauge, "Threads of the runs at work.", s.threads_used);
  e.family("batch_forecast_cpu_seconds", kGauge, "Processor seconds forecast for the scans.");
  e.sample(s.cost_done, {{"part", "done"}});
  e.sample(s.cost_left, {{"part", "left"}});
  if (s.seconds_left >= 0.0 && exit_code_ < 0) {
    e.single("batch_left_seconds", kGauge, "Seconds left by the forecast.", s.seconds_left);
  }
  e.single("batch_stopping", kGauge, "1 once the batch was asked to stop.", s.stopping ? 1 : 0);
  e.single("batch_finished", kGauge, "1 once the batch is over.", exit_code_ >= 0 ? 1 : 0);
  if (exit_code_ >= 0) {
    e.single("batch_exit_code", kGauge, "The batch's exit code.", exit_code_);
  }
  e.single("batch_start_time_seconds", kGauge, "When the batch began, since 1970.", start_time_);
  e.single("batch_update_time_seconds", kGauge, "When this was written, since 1970.", unix_now());
  e.single("batch_failed_writes_total", kCounter, "Times that this file could not be written.",
           failed_writes_);
  return e.take();
}

// Not synced: after a power cut nobody wants the figures of before. The collector reads what ends
// in .prom, so the temporary name doesn't.
bool BatchMetrics::write() {
  last_write_ = Clock::now();
  const std::string temporary = path_ + "." + std::to_string(::getpid()) + ".tmp";
  const std::string content = text();
  const int file = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  bool good = file >= 0;
  for (std::string_view rest = content; good && !rest.empty();) {
    const ssize_t written = ::write(file, rest.data(), rest.size());
    good = written >= 0 || errno == EINTR;
    rest.remove_prefix(written > 0 ? static_cast<std::size_t>(written) : 0);
  }
  if (file >= 0) {
    good = ::close(file) == 0 && good;
    good = good && std::rename(temporary.c_str(), path_.c_str()) == 0;
    if (!good) {
      ::unlink(temporary.c_str());
    }
  }
  failed_writes_ += good ? 0 : 1;
  return good;
}

}  // namespace rattan
