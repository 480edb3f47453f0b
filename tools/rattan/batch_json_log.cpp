// SPDX-License-Identifier: MIT
#include "tools/rattan/batch_json_log.h"

#include <utility>

#include <nlohmann/json.hpp>

#include "jobs/batch/name_text.h"

namespace rattan {

namespace {

using Json = nlohmann::ordered_json;

constexpr std::chrono::seconds kBetweenProgress{5};

void add_id(Json& line, const BatchItem& item) {
  line["id"] = item.id;
  if (!is_utf8(item.id)) {
    line["id_hex"] = to_hex(item.id);
  }
}

void add_counts(Json& line, const BatchState& s) {
  line["items"] = s.items;
  line["done_before"] = s.before;
  line["failed_before"] = s.failed_before;
  line["done"] = s.done;
  line["unusable"] = s.unusable;
  line["resource"] = s.resource;
  line["defect"] = s.defect;
  line["interrupted"] = s.interrupted;
  line["running"] = s.running;
  line["elsewhere"] = s.elsewhere;
  line["pending"] = s.pending;
}

}  // namespace

BatchJsonLog::BatchJsonLog(JsonLog& log, std::string directory, bool quiet)
    : log_(log), directory_(std::move(directory)), quiet_(quiet), last_progress_(Clock::now()) {}

Json BatchJsonLog::item_event(const char* name, const BatchItem& item,
                              const Attempt& attempt) const {
  Json line = log_.event(name);
  line["scan"] = item.scan;
  add_id(line, item);
  line["attempt"] = attempt.number;
  return line;
}

void BatchJsonLog::begun(const BatchState& state) {
  Json line = log_.event("batch_start");
  line["output"] = directory_;
  add_counts(line, state);
  line["threads"] = state.threads;
  line["memory"] = state.memory;
  log_.write(line);
}

void BatchJsonLog::started(const BatchItem& item, const Attempt& attempt) {
  Json line = item_event("scan_start", item, attempt);
  line["pid"] = attempt.pid;
  line["threads"] = attempt.threads;
  line["memory"] = attempt.memory;
  line["scan_bytes"] = item.scan_bytes;
  line["forecast"] = {{"triangles", attempt.triangles}, {"cpu_seconds", attempt.cost}};
  line["command"] = attempt.command;
  log_.write(line);
}

void BatchJsonLog::line(const BatchItem& item, const Attempt& /*attempt*/,
                        const nlohmann::json& event) {
  if (!event.is_object() || (quiet_ && event.value("event", "") == "progress")) {
    return;
  }
  // The order of the child's own line, as far as all lines share it.
  Json line;
  for (const char* name : {"time", "event", "scan"}) {
    line[name] = event.contains(name) ? Json(event[name]) : Json();
  }
  add_id(line, item);
  for (const auto& [name, value] : event.items()) {
    if (!line.contains(name)) {
      line[name] = Json(value);
    }
  }
  log_.write(line);
}

void BatchJsonLog::ended(const BatchItem& item, const Attempt& attempt) {
  Json line = item_event("scan_end", item, attempt);
  line["exit"] = attempt.exit;
  line["signal"] = attempt.signal;
  line["text"] = attempt.sentence;
  line["seconds"] = attempt.seconds;
  line["cpu_seconds"] = attempt.cpu_seconds;
  line["peak_rss_bytes"] = attempt.peak_rss_bytes;
  line["adopted"] = attempt.adopted;
  line["warnings"] = attempt.warnings;
  line["log"] = attempt.log.empty() ? Json() : Json(attempt.log);
  line["outputs"] = Json::array();
  for (const OutputFile& output : attempt.outputs) {
    line["outputs"].push_back({{"path", output.path}, {"bytes", output.bytes}});
  }
  log_.write(line);
}

void BatchJsonLog::warning(const std::string& sentence) {
  log_.warning(sentence);
}

void BatchJsonLog::tick(const BatchState& state) {
  if (quiet_ || Clock::now() - last_progress_ < kBetweenProgress) {
    return;
  }
  last_progress_ = Clock::now();
  Json line = log_.event("batch_progress");
  add_counts(line, state);
  line["seconds"] = state.seconds;
  line["seconds_left"] = state.seconds_left < 0.0 ? Json() : Json(state.seconds_left);
  line["threads_used"] = state.threads_used;
  line["memory_used"] = state.memory_used;
  line["stopping"] = state.stopping;
  log_.write(line);
}

void BatchJsonLog::finished(const BatchState& state, int exit_code) {
  Json line = log_.event("batch_end");
  line["exit"] = exit_code;
  add_counts(line, state);
  line["seconds"] = state.seconds;
  line["cpu_seconds"] = state.cpu_seconds;
  log_.write(line);
}

}  // namespace rattan
