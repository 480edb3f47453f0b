// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include "jobs/report_page/batch_report.h"

namespace rattan {
namespace {

constexpr double kMostSteps = 160.0;
constexpr double kLeastGap = 30.0;  // seconds without work that are left out

struct Span {
  double begin = 0.0;
  double end = 0.0;
};

/// When anything was at work, gaps of up to `most_gap` seconds closed.
std::vector<Span> merged(std::vector<Span> spans, double most_gap) {
  std::sort(spans.begin(), spans.end(),
            [](const Span& a, const Span& b) { return a.begin < b.begin; });
  std::vector<Span> out;
  for (const Span& s : spans) {
    if (!out.empty() && s.begin <= out.back().end + most_gap) {
      out.back().end = std::max(out.back().end, s.end);
    } else {
      out.push_back(s);
    }
  }
  return out;
}

double length_of(const std::vector<Span>& spans) {
  double sum = 0.0;
  for (const Span& s : spans) {
    sum += s.end - s.begin;
  }
  return sum;
}

/// A round number of seconds, so that at most kMostSteps steps cover `seconds`.
double step_for(double seconds) {
  constexpr double kRound[] = {1,   2,   5,    10,   15,   30,    60,    120,   300,
                               600, 900, 1800, 3600, 7200, 14400, 28800, 43200, 86400};
  for (const double step : kRound) {
    if (seconds <= step * kMostSteps) {
      return step;
    }
  }
  return 86400.0 * std::ceil(seconds / (kMostSteps * 86400.0));
}

/// Each scan's triangles, spread evenly over the time it took.
std::vector<ThroughputStep> throughput_of(const std::vector<ReportedScan>& scans,
                                          const std::vector<Span>& sessions, double step) {
  std::vector<ThroughputStep> steps;
  std::vector<std::size_t> first;  // of each session
  for (const Span& session : sessions) {
    first.push_back(steps.size());
    const auto n = static_cast<std::size_t>(std::ceil((session.end - session.begin) / step));
    for (std::size_t i = 0; i < std::max<std::size_t>(n, 1); ++i) {
      steps.push_back({session.begin + step * static_cast<double>(i), step, 0.0, 0});
    }
    ThroughputStep& last = steps.back();
    last.seconds = std::clamp(session.end - last.time, std::min(0.2, step), step);
  }
  for (const ReportedScan& scan : scans) {
    if (!scan.started || !scan.ended) {
      continue;
    }
    const auto after = std::upper_bound(sessions.begin(), sessions.end(), *scan.started,
                                        [](double time, const Span& s) { return time < s.begin; });
    if (after == sessions.begin()) {
      continue;
    }
    const auto session = static_cast<std::size_t>(after - sessions.begin() - 1);
    const std::size_t end = session + 1 < first.size() ? first[session + 1] : steps.size();
    const double begin = sessions[session].begin;
    const auto step_at = [&](double time) {
      const double i = std::floor(std::max(time - begin, 0.0) / step);
      return std::min(first[session] + static_cast<std::size_t>(i), end - 1);
    };
    const std::size_t last = step_at(*scan.ended);
    ++steps[last].scans;
    if (scan.status != ScanStatus::kDone || !scan.figures.triangles) {
      continue;
    }
    const auto triangles = static_cast<double>(*scan.figures.triangles);
    const double seconds = *scan.ended - *scan.started;
    for (std::size_t i = step_at(*scan.started); i <= last; ++i) {
      const double from = std::max(*scan.started, steps[i].time);
      const double to = i == last ? *scan.ended : std::min(*scan.ended, steps[i].time + step);
      const double share = seconds > 0.0 ? std::clamp((to - from) / seconds, 0.0, 1.0) : 1.0;
      steps[i].triangles_per_second += triangles * share / steps[i].seconds;
    }
  }
  return steps;
}

}  // namespace

void sum_up(BatchReport& report, double attempts_cpu, double attempts_wall) {
  ReportTotals& totals = report.totals;
  totals = {};
  totals.scans = report.scans.size();
  totals.cpu_seconds = attempts_cpu;
  totals.scan_seconds = attempts_wall;
  std::vector<Span> spans;
  for (const ReportedScan& scan : report.scans) {
    ++totals.of_status[static_cast<std::size_t>(scan.status)];
    totals.triangles += scan.figures.triangles.value_or(0);
    totals.faces += scan.figures.faces.value_or(0);
    totals.quads += scan.figures.quads.value_or(0);
    totals.output_bytes += scan.output_bytes.value_or(0);
    totals.peak_rss_bytes = std::max(totals.peak_rss_bytes, scan.peak_rss_bytes.value_or(0));
    totals.warnings += scan.figures.warnings.size();
    for (const auto& [name, count] : scan.figures.repairs) {
      totals.repairs += count;
    }
    if (scan.started && scan.ended) {
      spans.push_back({*scan.started, std::max(*scan.started, *scan.ended)});
    }
  }
  totals.wall_seconds = length_of(merged(spans, 0.0));
  if (totals.wall_seconds > 0.0) {
    totals.triangles_per_second = static_cast<double>(totals.triangles) / totals.wall_seconds;
  }
  const std::vector<Span> sessions =
      merged(std::move(spans), std::max(kLeastGap, 0.02 * totals.wall_seconds));
  report.throughput = throughput_of(report.scans, sessions, step_for(length_of(sessions)));
}

}  // namespace rattan
