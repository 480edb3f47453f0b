// SPDX-License-Identifier: MIT
#include "engine/layout/square_map.h"

#include <limits>

#include "engine/core/errors.h"
#include "engine/layout/mean_value.h"

namespace rattan::layout {
namespace {

/// Reweighting stops where it gains less than this share of the stretch, or after so many times.
constexpr double kLeastGain = 0.01;
constexpr int kReweights = 8;
/// Where triangles are below the floor it goes on while that leaves fewer of them, but for so many
/// times in between.
constexpr int kMoreReweights = 40;
constexpr int kFruitless = 6;
/// Rim movements below, in units, are left to the triangles at the rim.
constexpr double kSmallMove = 1.0 / 256;

struct Candidate {
  std::vector<Vec2d> uv;
  MapReport report;
  std::uint32_t folded = 0;
};

std::uint32_t count_folded(const FlatDisk& disk) {
  std::uint32_t count = 0;
  for (std::uint32_t t = 0; t < disk.triangle.size(); ++t) {
    count += thickness(disk, t) > 0 ? 0 : 1;
  }
  return count;
}

/// Reweights from weights that are set and leaves the map of least stretch.
void lower_stretch(FlatDisk& disk, ConvexMap& map) {
  ensure(map.solve(disk.uv), "A convex combination map has a solution");
  double stretch = mean_stretch(disk);
  std::vector<Vec2d> best = disk.uv;
  for (int i = 0; i < kReweights; ++i) {
    map.reweight(disk, Reference::kSurface);
    if (!map.solve(disk.uv)) {
      break;
    }
    const double now = mean_stretch(disk);
    const bool goes_on = now < (1 - kLeastGain) * stretch;
    if (now < stretch) {
      stretch = now;
      best = disk.uv;
    }
    if (!goes_on) {
      break;
    }
  }
  disk.uv.swap(best);
}

/// Likewise, and leaves the first map without thin triangles, else that with the fewest.
void thicken(FlatDisk& disk, ConvexMap& map, Reference reference) {
  ensure(map.solve(disk.uv), "A convex combination map has a solution");
  std::uint32_t thin = count_thin(disk);
  std::vector<Vec2d> best = disk.uv;
  int fruitless = 0;
  for (int i = 0; i < kMoreReweights && thin > 0 && fruitless < kFruitless; ++i) {
    map.reweight(disk, reference);
    if (!map.solve(disk.uv)) {
      break;
    }
    const std::uint32_t now = count_thin(disk);
    ++fruitless;
    if (now < thin) {
      thin = now;
      best = disk.uv;
      fruitless = 0;
    }
  }
  disk.uv.swap(best);
}

Candidate nudged(FlatDisk& disk) {
  Candidate c;
  c.report.nudged = nudge_thin(disk);
  c.report.thin = count_thin(disk);
  c.folded = count_folded(disk);
  c.uv = disk.uv;
  return c;
}

bool better(const Candidate& a, const Candidate& b) {
  return a.folded != b.folded ? a.folded < b.folded : a.report.thin < b.report.thin;
}

}  // namespace

MapReport map_to_square(FlatDisk& disk) {
  split_chords(disk, Chords::kNeeded);
  {
    ConvexMap map(disk);
    lower_stretch(disk, map);
  }
  Candidate best = nudged(disk);
  if (best.report.thin == 0) {
    return best.report;
  }
  split_chords(disk, Chords::kAll);
  best.folded = std::numeric_limits<std::uint32_t>::max();
  ConvexMap map(disk);
  for (const Reference reference : {Reference::kSurface, Reference::kEquilateral}) {
    if (reference == Reference::kEquilateral) {
      map.use_equal_weights();
    }
    thicken(disk, map, reference);
    Candidate c = nudged(disk);
    if (better(c, best)) {
      best = std::move(c);
    }
    if (best.report.thin == 0) {
      break;
    }
  }
  disk.uv = std::move(best.uv);
  return best.report;
}

bool mend_unfolded(FlatDisk& disk, const std::vector<Vec2d>& moved, MapReport& report) {
  double most = 0;
  for (const Vec2d& m : moved) {
    most = std::max(most, m.lpNorm<Eigen::Infinity>());
  }
  if (most > kSmallMove) {
    std::vector<Vec2d> move = moved;
    ConvexMap(disk).solve(move);
    for (std::size_t v = 0; v < move.size(); ++v) {
      if (disk.fixed[v] == 0) {
        disk.uv[v] += move[v];
      }
    }
  }
  split_chords(disk, Chords::kNeeded);
  report.nudged = nudge_thin(disk);
  report.thin = count_thin(disk);
  return report.thin == 0;
}

}  // namespace rattan::layout
