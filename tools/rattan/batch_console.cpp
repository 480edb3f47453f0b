// SPDX-License-Identifier: MIT
#include "tools/rattan/batch_console.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <sys/ioctl.h>
#include <unistd.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "tools/rattan/exit_code.h"

namespace rattan {

namespace {

std::string duration_text(double seconds) {
  const auto s = static_cast<std::uint64_t>(std::llround(std::max(seconds, 0.0)));
  return s < 3600 ? fmt::format("{}:{:02}", s / 60, s % 60)
                  : fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60);
}

std::size_t terminal_width() {
  winsize size{};
  return ::ioctl(2, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

std::uint64_t failed(const BatchState& s) {
  return s.unusable + s.resource + s.defect;
}

const char* kind_of(const Attempt& a) {
  switch (a.exit) {
    case kExitDone:
      return "done";
    case kExitUsage:
    case kExitInput:
      return "unusable";
    case kExitResource:
      return "resource";
    case kExitInterrupted:
      return "interrupted";
    default:
      return "defect";
  }
}

}  // namespace

BatchConsole::BatchConsole(Verbosity verbosity)
    : verbosity_(verbosity), terminal_(::isatty(2) != 0) {}

BatchConsole::~BatchConsole() {
  if (drawn_) {
    std::fputs("\r\033[K", stderr);
  }
}

void BatchConsole::say(const std::string& text) {
  std::fputs((drawn_ ? "\r\033[K" + text : text).c_str(), stderr);
  drawn_ = false;
}

void BatchConsole::begun(const BatchState& s) {
  if (verbosity_ == Verbosity::kQuiet) {
    return;
  }
  say(fmt::format("{} scans: {} done before{}, {} to do, on {} thread{}\n", s.items, s.before,
                  s.failed_before > 0 ? fmt::format(", {} failed before", s.failed_before) : "",
                  s.pending, s.threads, s.threads == 1 ? "" : "s"));
}

void BatchConsole::ended(const BatchItem& item, const Attempt& a) {
  if (a.exit != kExitDone) {
    // A sentence that begins with the scan's name needs no other.
    const bool named = a.sentence.starts_with(item.scan);
    say(fmt::format("{:<11} {}{}\n", kind_of(a), named ? "" : item.id + ": ", a.sentence));
  } else if ((!terminal_ && verbosity_ != Verbosity::kQuiet) || verbosity_ == Verbosity::kVerbose) {
    std::uint64_t bytes = 0;
    for (const OutputFile& output : a.outputs) {
      bytes += output.bytes;
    }
    say(fmt::format("{:<11} {}: {} bytes, {:.1f} s{}\n", kind_of(a), item.id, bytes, a.seconds,
                    a.adopted ? ", found finished" : ""));
  }
}

void BatchConsole::line(const BatchItem& item, const Attempt& /*attempt*/,
                        const nlohmann::json& event) {
  if (verbosity_ != Verbosity::kQuiet && event.value("event", "") == "warning") {
    say(fmt::format("{:<11} {}: {}\n", "warning", item.id, event.value("text", "")));
  }
}

void BatchConsole::warning(const std::string& sentence) {
  say("rattan: " + sentence + "\n");
}

void BatchConsole::tick(const BatchState& s) {
  if (terminal_ && verbosity_ != Verbosity::kQuiet) {
    draw(s);
  }
}

void BatchConsole::draw(const BatchState& s) {
  const std::uint64_t ready = s.before + s.failed_before + s.done + failed(s);
  std::string text = fmt::format("{} of {}", ready, s.items);
  if (failed(s) + s.failed_before > 0) {
    text += fmt::format(", {} failed", failed(s) + s.failed_before);
  }
  text += fmt::format(", {} running", s.running);
  if (s.elsewhere > 0) {
    text += fmt::format(", {} elsewhere", s.elsewhere);
  }
  if (s.seconds > 1.0 && s.done > 0) {
    text += fmt::format("  {:.1f} scans/min, {:.2f} Mtri/s",
                        60.0 * static_cast<double>(s.done) / s.seconds,
                        1e-6 * s.triangles_done / s.seconds);
  }
  if (s.stopping) {
    text += ", stopping";
  } else if (s.seconds_left >= 0.0) {
    text += ", " + duration_text(s.seconds_left) + " left";
  }
  text.resize(std::min(text.size(), terminal_width() - 1));
  std::fputs(("\r\033[K" + text).c_str(), stderr);
  drawn_ = true;
}

void BatchConsole::finished(const BatchState& s, int exit_code) {
  if (verbosity_ == Verbosity::kQuiet) {
    return;
  }
  std::string text = fmt::format("{} done", s.before + s.done);
  const auto add = [&](std::uint64_t count, const char* what) {
    if (count > 0) {
      text += fmt::format(", {} {}", count, what);
    }
  };
  add(s.unusable, "unusable");
  add(s.resource, "short of memory or disk");
  add(s.defect, "with a defect in Rattan");
  add(s.failed_before, "failed before (--retry-failed tries them again)");
  add(s.interrupted + s.pending + s.elsewhere, "left");
  text += fmt::format(", {:.1f} s", s.seconds);
  if (s.done > 0 && s.seconds > 0.0) {
    text += fmt::format(", {:.2f} million triangles a second", 1e-6 * s.triangles_done / s.seconds);
  }
  if (exit_code == kExitInterrupted) {
    text += "; run the same command again to go on";
  }
  say(text + "\n");
}

}  // namespace rattan
