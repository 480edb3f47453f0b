// SPDX-License-Identifier: MIT
#include "tools/rattan/console.h"

#include <cstdio>
#include <unistd.h>

#include <fmt/format.h>

namespace rattan {

Console::Console(Verbosity verbosity) : verbosity_(verbosity), terminal_(isatty(2) != 0) {}

Console::~Console() {
  finish_line();
}

void Console::progress(std::string_view stage, std::uint64_t done, std::uint64_t total) {
  if (verbosity_ == Verbosity::kQuiet) {
    return;
  }
  const std::scoped_lock lock(mutex_);
  const Clock::time_point now = Clock::now();
  if (stage != stage_) {
    finish_line();
    stage_ = stage;
    stage_start_ = now;
    last_draw_ = {};
  }
  done_ = done;
  total_ = total;
  if (!terminal_ || (done < total && now - last_draw_ < std::chrono::milliseconds(100))) {
    return;
  }
  last_draw_ = now;
  const double seconds = std::chrono::duration<double>(now - stage_start_).count();
  std::string line =
      fmt::format("\r\033[K{:<14} {:>3}%", stage_, total > 0 ? 100 * done / total : 100);
  if (done > 0 && seconds > 0.5) {
    line += fmt::format("  {:.0f}/s, {:.0f} s left", static_cast<double>(done) / seconds,
                        seconds * static_cast<double>(total - done) / static_cast<double>(done));
  }
  std::fputs(line.c_str(), stderr);
  line_open_ = true;
}

void Console::warning(const std::string& sentence) {
  const std::scoped_lock lock(mutex_);
  finish_line();
  std::fprintf(stderr, "warning: %s\n", sentence.c_str());
}

void Console::finish_line() {
  if (stage_.empty()) {
    return;
  }
  const double seconds = std::chrono::duration<double>(Clock::now() - stage_start_).count();
  if (line_open_) {
    std::fputs("\r\033[K", stderr);
    line_open_ = false;
  }
  if (terminal_ || verbosity_ == Verbosity::kVerbose) {
    std::fprintf(stderr, "%-14s %.1f s\n", stage_.c_str(), seconds);
  }
  stage_.clear();
}

}  // namespace rattan
