// SPDX-License-Identifier: MIT
#include "jobs/batch/verdict.h"

#include <csignal>
#include <cstring>

#include <fmt/format.h>

#include "engine/core/memory_budget.h"
#include "jobs/exit_codes.h"

namespace rattan {

int worse(int a, int b) {
  const auto rank = [](int exit) {
    switch (exit) {
      case kExitDone:
        return 0;
      case kExitUsage:
      case kExitInput:
        return 1;
      case kExitResource:
        return 2;
      default:
        return 3;
    }
  };
  return rank(b) > rank(a) ? b : a;
}

void judge_signal(Attempt& attempt, const std::string& scan, bool by_us) {
  Attempt& a = attempt;
  const std::string said = a.sentence.empty() ? "" : " It said last: " + a.sentence;
  const char* name = ::strsignal(a.signal);
  if (by_us) {
    a.exit = kExitInterrupted;
    a.sentence =
        "Stopped before its work was saved; the next run takes it up where it was "
        "saved last.";
  } else if (a.signal == SIGKILL) {
    a.exit = kExitResource;
    a.sentence = fmt::format(
        "{}: killed, most likely for want of memory ({} were granted, {} used). Allow less with "
        "--memory, or fewer scans at once with --jobs.{}",
        scan, format_bytes(a.memory), format_bytes(a.peak_rss_bytes), said);
  } else if (a.signal == SIGTERM || a.signal == SIGINT || a.signal == SIGUSR1 ||
             a.signal == SIGHUP) {
    a.exit = kExitInterrupted;
    a.sentence = fmt::format("Ended by signal {} ({}) from elsewhere.", a.signal, name);
  } else {
    a.exit = kExitDefect;
    a.sentence = fmt::format(
        "{}: a defect in Rattan: ended by signal {} ({}). Please report it with the scan and the "
        "command.{}",
        scan, a.signal, name, said);
  }
}

}  // namespace rattan
