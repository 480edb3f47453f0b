// SPDX-License-Identifier: MIT
#include "tools/rattan/batch_table.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <fmt/format.h>

#include "engine/core/memory_budget.h"
#include "jobs/batch/forecast.h"

namespace rattan {

namespace {

std::string count_text(double count) {
  if (count < 0.5) {
    return "?";
  }
  if (count < 1e4) {
    return fmt::format("{:.0f}", count);
  }
  return count < 1e6 ? fmt::format("{:.0f}k", count / 1e3) : fmt::format("{:.1f}M", count / 1e6);
}

std::string time_text(double seconds) {
  if (seconds < 90.0) {
    return seconds < 9.95 ? fmt::format("{:.1f} s", seconds) : fmt::format("{:.0f} s", seconds);
  }
  return seconds < 5400.0 ? fmt::format("{:.0f} min", seconds / 60.0)
                          : fmt::format("{:.1f} h", seconds / 3600.0);
}

// Names may hold line ends and other controls.
std::string printable(const std::string& name) {
  std::string text;
  for (const char c : name) {
    text += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? '?' : c;
  }
  return text;
}

}  // namespace

double item_cost(const BatchItem& item) {
  // A guess in milliseconds is precise enough, and readable in a manifest.
  return item.cost > 0.0 ? item.cost
                         : std::max(0.001, std::round(1e3 * forecast(item).cpu_seconds) / 1e3);
}

BatchTable batch_table(std::span<const BatchItem> items, std::span<const Standing> standings,
                       std::uint64_t budget, int threads) {
  BatchTable table;
  std::string& text = table.text;
  const auto row = [&](const auto&... cells) {
    text += fmt::format("{:>9}  {:>7}  {:>7}  {:>10}  {:<16} {}{}\n", cells...);
  };
  row("triangles", "faces", "cpu", "memory", "", "scan -> output", "");
  double triangles = 0.0;
  double faces = 0.0;
  double cost = 0.0;
  double longest = 0.0;
  std::uint64_t most_memory = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < items.size(); ++i) {
    const BatchItem& item = items[i];
    const Forecast expected = forecast(item);
    const double seconds = item.cost > 0.0 ? item.cost : expected.cpu_seconds;
    const bool doing = to_do(standings[i]);
    const bool fits = !doing || expected.least_memory <= budget;
    row(count_text(expected.triangles), count_text(expected.faces), time_text(seconds),
        format_bytes(expected.least_memory), describe(standings[i]),
        printable(item.scan + " -> " + item.id), fits ? "" : "  -- TOO LITTLE MEMORY");
    if (doing) {
      table.fits = table.fits && fits;
      ++count;
      triangles += expected.triangles;
      faces += expected.faces;
      cost += seconds;
      longest = std::max(longest, forecast_seconds(expected, threads));
      most_memory = std::max(most_memory, expected.least_memory);
    }
  }
  text += fmt::format(
      "{} scan{} to do of {}: {} triangles, {} faces, {} of processor time; at least {} for the "
      "largest\n",
      count, count == 1 ? "" : "s", items.size(), count_text(triangles), count_text(faces),
      time_text(cost), format_bytes(most_memory));
  text += fmt::format("about {} with {} thread{} and {}\n",
                      time_text(std::max(cost / threads, longest)), threads,
                      threads == 1 ? "" : "s", format_bytes(budget));
  return table;
}

}  // namespace rattan
