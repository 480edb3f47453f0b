// SPDX-License-Identifier: MIT
#include "jobs/batch/child_log.h"

#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace rattan {

namespace {

using nlohmann::json;

constexpr std::size_t kHeadBytes = 32768;
constexpr std::size_t kTailBytes = 65536;

std::string text_of(const json& event, const char* name) {
  const auto at = event.find(name);
  return at != event.end() && at->is_string() ? at->get<std::string>() : std::string();
}

double number_of(const json& event, const char* name) {
  const auto at = event.find(name);
  return at != event.end() && at->is_number() ? at->get<double>() : 0.0;
}

}  // namespace

bool ChildLog::take(std::string_view line, json& event) {
  if (line.starts_with('{')) {
    event = json::parse(line, nullptr, false);
    if (event.is_object() && event.contains("event")) {
      const std::string kind = text_of(event, "event");
      if (kind == "warning") {
        ++warnings_;
        keep("warning: " + text_of(event, "text"));
      } else if (kind == "error") {
        error_ = text_of(event, "text");
        keep("error: " + error_);
      } else if (kind == "stage") {
        keep(fmt::format("{:<14} {:.1f} s", text_of(event, "name"), number_of(event, "seconds")));
      } else if (kind == "end") {
        const double peak = number_of(event, "peak_rss_bytes");
        peak_rss_bytes_ = peak > 0.0 ? static_cast<std::uint64_t>(peak) : 0;
      } else if (kind == "output") {
        keep("output " + text_of(event, "path"));
      }
      return true;
    }
  }
  constexpr std::string_view kName = "rattan: ";
  constexpr std::string_view kWarning = "warning: ";
  if (line.starts_with(kName)) {
    error_ = line.substr(kName.size());
  } else if (line.starts_with(kWarning)) {
    ++warnings_;
  } else if (line.find_first_not_of(" \t\r") != std::string_view::npos) {
    said_ = line;
  }
  keep(std::string(line));
  return false;
}

void ChildLog::keep(std::string line) {
  line += '\n';
  if (tail_.empty() && head_.size() + line.size() <= kHeadBytes) {
    head_ += line;
    return;
  }
  tail_ += line;
  if (tail_.size() > kTailBytes) {
    const std::size_t cut = tail_.find('\n', tail_.size() - kTailBytes);
    const std::size_t from = cut == std::string::npos ? tail_.size() - kTailBytes : cut + 1;
    dropped_ += from;
    tail_.erase(0, from);
  }
}

std::string ChildLog::sentence() const {
  return error_.empty() ? said_ : error_;
}

std::string ChildLog::text() const {
  return head_ + (dropped_ > 0 ? fmt::format("... {} bytes left out ...\n", dropped_) : "") + tail_;
}

}  // namespace rattan
