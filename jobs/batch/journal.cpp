// SPDX-License-Identifier: MIT
#include "jobs/batch/journal.h"

#include <algorithm>

namespace rattan {

Journal::Journal(const std::string& directory) : reader_(directory) {}

std::string_view Journal::keep(std::string_view text) {
  return *texts_.emplace(text).first;
}

ScanHistory& Journal::history(std::string_view id) {
  const auto found = index_.find(id);
  if (found != index_.end()) {
    return scans_[found->second];
  }
  ScanHistory& scan = scans_.emplace_back();
  scan.id = keep(id);
  index_.emplace(scan.id, static_cast<std::uint32_t>(scans_.size() - 1));
  return scan;
}

const ScanHistory* Journal::find(std::string_view id) const {
  const auto found = index_.find(id);
  return found == index_.end() ? nullptr : &scans_[found->second];
}

void Journal::visit(const StartRecord& r) {
  ScanHistory& h = history(r.id);
  if (r.attempt < h.attempts || (r.attempt == h.attempts && r.time < h.started)) {
    return;
  }
  std::string options;
  for (const std::string& word : r.options) {
    options += options.empty() ? "" : " ";
    options += word;
  }
  h.scan = keep(r.scan);
  h.key = keep(r.key);
  h.options = keep(options);
  h.host = keep(r.host);
  h.slurm = keep(r.slurm);
  h.rattan = keep(r.rattan);
  h.scan_bytes = r.scan_bytes;
  h.scan_time = r.scan_time;
  h.started = r.time;
  h.cost = r.cost;
  h.triangles = r.triangles;
  h.memory = r.memory;
  h.pid = r.pid;
  h.threads = r.threads;
  h.attempts = r.attempt;
}

void Journal::visit(const EndRecord& r) {
  ScanHistory& h = history(r.id);
  finishes_.push_back({.time = r.time,
                       .seconds = static_cast<float>(r.seconds),
                       .cpu_seconds = static_cast<float>(r.cpu_seconds),
                       .cost = static_cast<float>(h.cost),
                       .triangles = static_cast<float>(h.triangles),
                       .exit = r.exit});
  if (r.attempt < h.ended_attempt || (r.attempt == h.ended_attempt && r.time < h.ended)) {
    return;
  }
  h.ended_attempt = r.attempt;
  h.ended = r.time;
  h.exit = r.exit;
  h.sentence = keep(r.sentence);
  h.seconds = r.seconds;
  h.cpu_seconds = r.cpu_seconds;
  h.peak_rss_bytes = r.peak_rss_bytes;
  h.warnings = static_cast<std::uint32_t>(std::min<std::uint64_t>(r.warnings, 1U << 30U));
  h.outputs_at = static_cast<std::uint32_t>(outputs_.size());
  h.outputs = static_cast<std::uint32_t>(r.outputs.size());
  for (const OutputFile& output : r.outputs) {
    outputs_.emplace_back(keep(output.path), output.bytes);
  }
}

void Journal::visit(const BatchRecord& r) {
  batches_.push_back(r);
}

std::vector<OutputFile> Journal::outputs(const ScanHistory& scan) const {
  std::vector<OutputFile> files;
  for (std::uint32_t i = 0; i < scan.outputs; ++i) {
    const auto& [path, bytes] = outputs_[scan.outputs_at + i];
    files.push_back({std::string(path), bytes});
  }
  return files;
}

std::vector<BatchRecord> Journal::batches() const {
  std::vector<BatchRecord> sorted = batches_;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const BatchRecord& a, const BatchRecord& b) { return a.time < b.time; });
  return sorted;
}

}  // namespace rattan
