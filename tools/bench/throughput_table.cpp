// SPDX-License-Identifier: MIT
#include <algorithm>

#include <fmt/format.h>

#include "tools/bench/throughput.h"

namespace rattan {

namespace {

std::string threads_text(int threads) {
  return fmt::format("{} thread{}", threads, threads == 1 ? "" : "s");
}

std::string spread_text(const Spread& s, std::size_t repeats) {
  return repeats > 1 ? fmt::format("{:.2f} s (median of {}, {:.2f} to {:.2f})", s.median, repeats,
                                   s.min, s.max)
                     : fmt::format("{:.2f} s", s.median);
}

std::string beside_draco(double seconds, const std::vector<Measure>& draco, const char* what) {
  if (draco.empty()) {
    return std::string("; ") + what + " not found\n";
  }
  const Spread s = seconds_of(draco);
  return fmt::format("; {:.2f} times {} ({})\n", seconds / s.median, what,
                     spread_text(s, draco.size()));
}

/// The repeat whose time is the median, the faster one of two.
const RemeshRun& median_run(const ThroughputRow& row) {
  std::vector<const RemeshRun*> runs;
  runs.reserve(row.runs.size());
  for (const RemeshRun& run : row.runs) {
    runs.push_back(&run);
  }
  std::sort(runs.begin(), runs.end(),
            [](const RemeshRun* a, const RemeshRun* b) { return a->seconds < b->seconds; });
  return *runs[(runs.size() - 1) / 2];
}

std::string row_text(const ThroughputRow& row) {
  const RemeshRun& run = median_run(row);
  const auto n = static_cast<double>(row.triangles);
  std::vector<double> seconds;
  seconds.reserve(row.runs.size());
  for (const RemeshRun& r : row.runs) {
    seconds.push_back(r.seconds);
  }
  const Spread s = spread(std::move(seconds));
  std::string text = fmt::format(
      "{} triangles -> {} faces ({:.1f} % quads), {}, budget {}\n  {}, {:.0f} "
      "triangles/s, {:.2f} processors in use, peak {} MiB",
      row.triangles, row.faces,
      100.0 * static_cast<double>(row.quads) / std::max(1.0, static_cast<double>(row.faces)),
      threads_text(row.threads), row.budget, spread_text(s, row.runs.size()), n / s.median,
      run.cpu_seconds / run.seconds, run.peak_bytes >> 20U);
  text += beside_draco(s.median, row.draco, "draco_encoder");
  text += fmt::format("  {:<14}{:>9}{:>8}{:>9}{:>14}{:>8}{:>10}{:>10}{:>12}{:>9}\n", "stage",
                      "seconds", "share", "cpu s", "triangles/s", "passes", "MiB", "MiB/s",
                      "disk: read", "written");
  const auto line = [&](const StageTime& t) {
    const double moved = static_cast<double>(t.bytes_moved) / (1 << 20);
    const double stage_seconds = std::max(1e-9, t.seconds);
    return fmt::format(
        "  {:<14}{:>9.3f}{:>6.1f} %{:>9.3f}{:>14.0f}{:>8}{:>10.1f}{:>10.0f}{:>12}{:>9}\n", t.name,
        t.seconds, 100.0 * t.seconds / run.seconds, t.cpu_seconds, n / stage_seconds, t.passes,
        moved, moved / stage_seconds, t.bytes_read >> 20U, t.bytes_written >> 20U);
  };
  StageTime sum{.name = "(all)"};
  for (const StageTime& t : run.stages) {
    text += line(t);
    sum.seconds += t.seconds;
    sum.cpu_seconds += t.cpu_seconds;
    sum.passes += t.passes;
    sum.bytes_read += t.bytes_read;
    sum.bytes_written += t.bytes_written;
    sum.bytes_moved += t.bytes_moved;
  }
  return text + line(sum);
}

std::string row_text(const BatchRow& row) {
  const Spread s = seconds_of(row.runs);
  const auto n = static_cast<double>(row.triangles);
  double cpu = 0.0;
  double wall = 0.0;
  for (const Measure& m : row.runs) {
    cpu += m.cpu_seconds;
    wall += m.seconds;
  }
  return fmt::format(
             "batch of {} scans of {} triangles, {}, budget {}\n  {}, {:.0f} triangles/s, "
             "{:.2f} scans/s, {:.1f} % of {} processors in use, largest process {} MiB",
             row.scans, row.size, threads_text(row.threads), row.budget,
             spread_text(s, row.runs.size()), n / s.median, row.scans / s.median,
             100.0 * cpu / (wall * row.threads), row.threads,
             *std::max_element(row.peak_bytes.begin(), row.peak_bytes.end()) >> 20U) +
         beside_draco(s.median, row.draco, "a shell loop of draco_encoder");
}

/// How much dearer a triangle of the largest scan is than one of the smallest.
std::string growth(const std::vector<ThroughputRow>& rows) {
  std::string text;
  for (const ThroughputRow& first : rows) {
    const ThroughputRow* largest = nullptr;
    bool smallest = true;
    for (const ThroughputRow& row : rows) {
      if (row.threads != first.threads || row.budget != first.budget) {
        continue;
      }
      smallest = smallest && row.size >= first.size;
      largest = largest == nullptr || row.size > largest->size ? &row : largest;
    }
    if (smallest && largest->size > first.size) {
      text += fmt::format(
          "{}, budget {}: from {} to {} triangles the cost of one grows {:.2f} times "
          "({:.2f} to {:.2f} microseconds)\n",
          threads_text(first.threads), first.budget, first.triangles, largest->triangles,
          largest->seconds_per_triangle() / first.seconds_per_triangle(),
          1e6 * first.seconds_per_triangle(), 1e6 * largest->seconds_per_triangle());
    }
  }
  return text;
}

/// Against the fewest threads of the same case; `seconds` of a row.
template <class Row, class Seconds, class Name>
std::string scaling(const std::vector<Row>& rows, const Seconds& seconds, const Name& name) {
  std::string text;
  for (const Row& row : rows) {
    const Row* fewest = &row;
    for (const Row& other : rows) {
      if (other.size == row.size && other.budget == row.budget && other.threads < fewest->threads) {
        fewest = &other;
      }
    }
    if (fewest->threads < row.threads) {
      const double speed_up = seconds(*fewest) / seconds(row);
      text += fmt::format(
          "{}, budget {}: {} threads are {:.2f} times as fast as {} ({:.0f} % of what is "
          "possible)\n",
          name(row), row.budget, row.threads, speed_up, fewest->threads,
          100.0 * speed_up * fewest->threads / row.threads);
    }
  }
  return text;
}

}  // namespace

std::string throughput_table(const Throughput& measured) {
  std::string text;
  for (const ThroughputRow& row : measured.rows) {
    text += row_text(row);
  }
  for (const BatchRow& row : measured.batches) {
    text += row_text(row);
  }
  text += scaling(
      measured.rows, [](const ThroughputRow& row) { return row.seconds(); },
      [](const ThroughputRow& row) { return fmt::format("{} triangles", row.triangles); });
  text += scaling(
      measured.batches, [](const BatchRow& row) { return seconds_of(row.runs).median; },
      [](const BatchRow& row) {
        return fmt::format("batch of {} scans of {} triangles", row.scans, row.size);
      });
  return text + growth(measured.rows);
}

}  // namespace rattan
