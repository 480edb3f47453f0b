// SPDX-License-Identifier: MIT
#include "engine/layout/strand_parameters.h"

#include <algorithm>
#include <cmath>

#include "engine/core/errors.h"

namespace rattan::layout {
namespace {

/// Steps must sum to a whole number of periods within this.
constexpr double kWholePeriods = 1e-3;
/// A point so near a division, in units, serves as it.
constexpr double kNearDivision = 1.0 / 128;

/// How far along each point is, from 0 to 1; never falls.
std::vector<double> shares(std::span<const Vec3d> position, std::span<const double> step,
                           std::uint32_t parts) {
  const std::size_t n = step.size();
  std::vector<double> along(n + 1, 0.0);
  bool usable = true;
  for (std::size_t i = 0; i < n; ++i) {
    usable = usable && step[i] >= 0;
    along[i + 1] = along[i] + step[i];
  }
  const double periods = along[n];
  if (!usable ||
      !(std::abs(periods - 1) < kWholePeriods || std::abs(periods - parts) < kWholePeriods)) {
    for (std::size_t i = 0; i < n; ++i) {
      along[i + 1] = along[i] + (position[i + 1] - position[i]).norm();
    }
  }
  const double whole = along[n];
  for (std::size_t i = 1; i <= n; ++i) {
    // All points in one place: any order that is strict will do.
    along[i] = i == n      ? 1.0
               : whole > 0 ? std::min(along[i] / whole, 1.0)
                           : static_cast<double>(i) / static_cast<double>(n);
  }
  return along;
}

}  // namespace

void keep_gaps(std::span<StrandPoint> points, double least_gap) {
  std::size_t begin = 0;
  for (std::size_t end = 1; end < points.size(); ++end) {
    if (!points[end].division) {
      continue;
    }
    const auto pieces = static_cast<double>(end - begin);
    const double length = points[end].at - points[begin].at;
    const double gap = std::floor(std::min(least_gap, 0.5 * length / pieces) / kRimGrid) * kRimGrid;
    ensure(gap > 0, "The points of a chart's side can be told apart");
    for (std::size_t i = begin + 1; i < end; ++i) {
      const double rounded = std::floor(points[i].at / kRimGrid + 0.5) * kRimGrid;
      points[i].at = std::max(rounded, points[i - 1].at + gap);
    }
    for (std::size_t i = end - 1; i > begin; --i) {
      points[i].at = std::min(points[i].at, points[i + 1].at - gap);
    }
    begin = end;
  }
}

std::vector<StrandPoint> strand_parameters(std::span<const Vec3d> position,
                                           std::span<const double> step, std::uint32_t parts,
                                           std::uint32_t units, std::span<const double> given,
                                           double least_gap) {
  ensure(position.size() >= 2 && step.size() + 1 == position.size(),
         "A strand has two ends and a step between points");
  const std::uint32_t divisions = parts * units;
  const auto last = static_cast<std::uint32_t>(step.size());
  std::vector<double> at = shares(position, step, parts);
  for (double& a : at) {
    a *= divisions;
  }
  std::vector<StrandPoint> points;
  points.reserve(at.size() + divisions);
  points.push_back({0, 0, 0, false, true});
  std::uint32_t next = 1;  // the first point not yet in the list
  for (std::uint32_t d = 1; d < divisions; ++d) {
    std::uint32_t nearest = last;
    for (std::uint32_t i = next; i < last && at[i] <= d + kNearDivision; ++i) {
      const double away = std::abs(at[i] - d);
      if (away <= kNearDivision && (nearest == last || away < std::abs(at[nearest] - d))) {
        nearest = i;
      }
    }
    for (; next < last && (nearest == last ? at[next] < d : next < nearest); ++next) {
      points.push_back({std::min<double>(at[next], d), next, 0, false, false});
    }
    if (nearest != last) {
      points.push_back({static_cast<double>(d), next++, 0, false, true});
    } else {
      const double before = at[next - 1];
      points.push_back(
          {static_cast<double>(d), next - 1, (d - before) / (at[next] - before), true, true});
    }
  }
  for (; next < last; ++next) {
    points.push_back({at[next], next, 0, false, false});
  }
  points.push_back({static_cast<double>(divisions), last, 0, false, true});
  if (!given.empty()) {
    ensure(given.size() == points.size(), "A strand's parameters are given for all its points");
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!points[i].division) {
        points[i].at = given[i];
      }
    }
  }
  keep_gaps(points, least_gap);
  return points;
}

}  // namespace rattan::layout
