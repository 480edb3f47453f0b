// SPDX-License-Identifier: MIT
#include "io/synth/holes.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "engine/core/errors.h"
#include "io/synth/noise.h"

namespace rattan::synth {
namespace {

// Share of the surface that may be missing, and of its place that a hole may take.
constexpr double kMissingShare = 0.06;
constexpr std::uint32_t kLeastPlace = 3;  // quads: one missing, one kept all around

// A place for a hole: a rectangle of quads.
struct Place {
  std::uint32_t patch;
  std::uint32_t i0, j0, i1, j1;  // one past the end
};

// A smooth random value in [-1, 1] along a line.
double wobble(double x, std::uint64_t seed) {
  return 1.6 * gradient_noise({x, 0.5, 0.5}, static_cast<std::uint32_t>(seed));
}

Hole ragged_disk(const Place& place, double largest, std::uint64_t seed) {
  const double width = static_cast<double>(place.i1 - place.i0 - 2);
  const double height = static_cast<double>(place.j1 - place.j0 - 2);
  const double radius =
      std::min({width * 0.5, height * 0.5, largest}) * (0.6 + 0.4 * unit(hash(seed, 1)));
  const std::uint32_t ci = (place.i0 + place.i1) / 2;
  const std::uint32_t cj = (place.j0 + place.j1) / 2;
  const std::uint32_t reach = static_cast<std::uint32_t>(radius);
  Hole hole;
  hole.first_row = std::max(place.j0 + 1, cj - std::min(cj, reach));
  const std::uint32_t end_row = std::min(place.j1 - 1, cj + reach + 1);
  for (std::uint32_t j = hole.first_row; j < end_row; ++j) {
    const double dj = static_cast<double>(j) - static_cast<double>(cj);
    const double half = std::sqrt(std::max(0.0, radius * radius - dj * dj));
    std::uint32_t ends[2];
    for (std::uint64_t side = 0; side < 2; ++side) {
      const double fray = 2.5 * unit(hash(seed, 2 + side, j));
      const double bend = 1.0 + 0.25 * wobble(dj / (radius + 1.0) * 4.0, seed + side);
      ends[side] = static_cast<std::uint32_t>(std::max(0.0, half * bend - fray));
    }
    hole.runs.push_back(
        {std::max(place.i0 + 1, ci - std::min(ci, ends[0])), std::min(place.i1 - 2, ci + ends[1])});
  }
  return hole;
}

// A regular division of every patch, k by k, with enough room around each hole.
std::vector<Place> divided(const PatchComplex& complex, std::uint64_t count) {
  std::vector<Place> places;
  const std::uint64_t patches = complex.patches.size();
  std::uint64_t k = 1;
  while (k * k * patches < count) {
    ++k;
  }
  for (; places.size() < count && k <= 4096; ++k) {
    places.clear();
    for (std::uint32_t p = 0; p < patches; ++p) {
      const Patch& patch = complex.patches[p];
      if (patch.nu / k < kLeastPlace || patch.nv / k < kLeastPlace) {
        continue;
      }
      for (std::uint64_t b = 0; b < k; ++b) {
        for (std::uint64_t a = 0; a < k; ++a) {
          places.push_back({p, static_cast<std::uint32_t>(patch.nu * a / k),
                            static_cast<std::uint32_t>(patch.nv * b / k),
                            static_cast<std::uint32_t>(patch.nu * (a + 1) / k),
                            static_cast<std::uint32_t>(patch.nv * (b + 1) / k)});
        }
      }
    }
    if (places.empty()) {
      break;
    }
  }
  return places;
}

}  // namespace

Holes::Holes(const PatchComplex& complex, std::uint64_t count, std::uint64_t seed)
    : of_patch_(complex.patches.size()) {
  if (count == 0) {
    return;
  }
  const auto shuffle = [&](auto& items) {
    for (std::size_t n = items.size(); n > 1; --n) {
      std::swap(items[n - 1], items[hash(seed, 77, n) % n]);
    }
  };
  std::vector<Place> places = divided(complex, count);
  if (places.size() >= count) {
    shuffle(places);
    const double largest = std::sqrt(kMissingShare * static_cast<double>(complex.quads()) /
                                     (3.14159 * static_cast<double>(count)));
    for (std::uint64_t h = 0; h < count; ++h) {
      add(places[h].patch, ragged_disk(places[h], largest, hash(seed, 5, h)));
    }
  } else {
    // Coarse grids: single quads, one a patch, in patches that share no corner.
    std::vector<std::uint32_t> order(complex.patches.size());
    for (std::uint32_t p = 0; p < order.size(); ++p) {
      order[p] = p;
    }
    shuffle(order);
    std::vector<std::uint8_t> taken(complex.corners.size(), 0);
    std::uint64_t made = 0;
    for (std::size_t at = 0; at < order.size() && made < count; ++at) {
      const Patch& patch = complex.patches[order[at]];
      if (std::any_of(patch.corner.begin(), patch.corner.end(),
                      [&](std::uint32_t c) { return taken[c] != 0; })) {
        continue;
      }
      for (const std::uint32_t c : patch.corner) {
        taken[c] = 1;
      }
      add(order[at], {patch.nv / 2, {{patch.nu / 2, patch.nu / 2}}});
      ++made;
    }
    if (made < count) {
      throw UsageError(std::to_string(count) + " holes do not fit into so few triangles; ask for " +
                       "more triangles or fewer holes.");
    }
  }
}

void Holes::add(std::uint32_t patch, Hole hole) {
  for (std::size_t r = 0; r < hole.runs.size(); ++r) {
    missing_quads_ += hole.runs[r][1] - hole.runs[r][0] + 1;
    if (r > 0) {
      const std::uint32_t first = std::max(hole.runs[r - 1][0], hole.runs[r][0]);
      const std::uint32_t last = std::min(hole.runs[r - 1][1], hole.runs[r][1]);
      missing_vertices_ += last - first;
    }
  }
  of_patch_[patch].push_back(std::move(hole));
}

bool Holes::mark(std::uint32_t patch, std::uint32_t row, std::vector<std::uint8_t>& missing) const {
  bool found = false;
  for (const Hole& hole : of_patch_[patch]) {
    const std::uint32_t r = row - hole.first_row;  // wraps above the hole
    if (r < hole.runs.size()) {
      if (!found) {
        std::fill(missing.begin(), missing.end(), std::uint8_t{0});
        found = true;
      }
      for (std::uint32_t i = hole.runs[r][0]; i <= hole.runs[r][1]; ++i) {
        missing[i] = 1;
      }
    }
  }
  return found;
}

}  // namespace rattan::synth
