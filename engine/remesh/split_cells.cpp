// SPDX-License-Identifier: MIT
#include "engine/remesh/split_cells.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "engine/core/errors.h"
#include "engine/core/parallel.h"

namespace rattan {
namespace {

constexpr std::size_t kGrain = 32;
/// Cells of more corners are cut first: planning grows with the fourth power, and so large ones are
/// found only where the surface is much thinner than a quad.
constexpr std::size_t kCutAbove = 24;
constexpr std::size_t kCutDownTo = 12;
constexpr std::size_t kManyCorners = 400;
constexpr std::size_t kOpposite = 20;
/// Less than kValenceCost, as the neighbouring cells will change the valences too.
constexpr double kSplitBias = 0.2;

bool repeats_vertex(const CellMap& map, std::uint32_t f, std::vector<std::uint32_t>& ids) {
  ids.clear();
  std::uint32_t h = map.face_half(f);
  do {
    ids.push_back(map.origin(h));
    h = map.next(h);
  } while (h != map.face_half(f));
  std::sort(ids.begin(), ids.end());
  return std::adjacent_find(ids.begin(), ids.end()) != ids.end();
}

/// Diagonals of one polygon may coincide where it repeats vertices; forbids the later of two
/// equals.
bool forbid_twins(const PolygonSplit& split, PolygonCorners& corners) {
  bool any = false;
  const std::size_t n = corners.size();
  for (std::size_t a = 0; a < split.diagonals.size(); ++a) {
    const auto [i, j] = split.diagonals[a];
    const auto ends = std::minmax(corners.vertex[i], corners.vertex[j]);
    for (std::size_t b = 0; b < a; ++b) {
      const auto [k, l] = split.diagonals[b];
      if (ends == std::minmax(corners.vertex[k], corners.vertex[l])) {
        corners.forbidden[i * n + j] = 1;
        any = true;
        break;
      }
    }
  }
  return any;
}

/// The best allowed split of the face; infeasible ones have feasible == false.
PolygonSplit plan(const CellMap& map, std::span<const std::uint32_t> halves,
                  PolygonSplitter& splitter, PolygonCorners& corners) {
  gather_corners(map, halves, {}, corners);
  corners.bias.resize(corners.size());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const std::uint32_t v = corners.vertex[i], valence = map.valence(v);
    corners.bias[i] =
        kSplitBias * (irregularity(map, v, valence + 1) - irregularity(map, v, valence));
  }
  for (int attempt = 0; attempt < 8; ++attempt) {
    PolygonSplit split = splitter.split(corners, false, true);
    if (!split.feasible || !forbid_twins(split, corners)) {
      return split;
    }
  }
  return {};
}

/// If the cell has more than kCutAbove corners: short and balanced diagonals until no part has more
/// than kCutDownTo. A part without an allowed diagonal is inset: its inner polygon has fresh
/// vertices. Returns insets.
std::uint64_t cut_large(CellMap& map, std::uint32_t face, std::vector<std::uint32_t>& ready) {
  std::vector<std::uint32_t> todo{face}, halves;
  const std::size_t most = map.degree(face) > kCutAbove ? kCutDownTo : kCutAbove;
  std::uint64_t insets = 0;
  while (!todo.empty()) {
    const std::uint32_t f = todo.back();
    todo.pop_back();
    if (map.degree(f) <= most) {
      ready.push_back(f);
      continue;
    }
    map.face_halves(f, halves);
    const std::size_t n = halves.size();
    double best = std::numeric_limits<double>::infinity();
    std::pair<std::size_t, std::size_t> cut{0, 0};
    for (std::size_t i = 0; i < n; ++i) {
      // Of very many corners only those about opposite, so that the work stays in proportion.
      const std::size_t near = n > kManyCorners ? n / 2 - kOpposite : n / 4;
      const std::size_t far = n > kManyCorners ? n / 2 + kOpposite : n - n / 4;
      for (std::size_t j = i + near; j < n && j <= i + far; ++j) {
        const std::uint32_t u = map.origin(halves[i]), v = map.origin(halves[j]);
        const double length = (map.position(u) - map.position(v)).squaredNorm();
        const double lean = static_cast<double>(j - i) / static_cast<double>(n) - 0.5;
        // An odd count of edges between the corners keeps both parts of an even polygon even.
        const double odd = n % 2 == 0 && (j - i) % 2 == 0 ? 2.0 : 1.0;
        const double cost = length * (1 + 8 * lean * lean) * odd;
        if (cost < best && u != v && !map.adjacent(u, v)) {
          best = cost;
          cut = {i, j};
        }
      }
    }
    if (cut.second == 0) {
      map.inset_face(f);
      ++insets;
      todo.push_back(f);
      continue;
    }
    const std::uint32_t x = map.split_face(halves[cut.first], halves[cut.second]);
    todo.push_back(map.face(x));
    todo.push_back(map.face(CellMap::twin(x)));
  }
  return insets;
}

}  // namespace

void gather_corners(const CellMap& map, std::span<const std::uint32_t> halves,
                    std::span<const std::uint32_t> ignored, PolygonCorners& corners) {
  const std::size_t n = halves.size();
  corners.vertex.resize(n);
  corners.position.resize(n);
  corners.normal.resize(n);
  corners.forbidden.assign(n * n, 0);
  corners.bias.clear();
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint32_t v = map.origin(halves[i]);
    corners.vertex[i] = v;
    corners.position[i] = map.position(v);
    corners.normal[i] = map.normal(v);
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + 2; j < n; ++j) {
      if (i == 0 && j + 1 == n) {
        continue;
      }
      const std::uint32_t u = corners.vertex[i], v = corners.vertex[j];
      bool taken = u == v;
      if (!taken) {
        const std::uint32_t h = map.find_half(u, v);
        taken = h != CellMap::kNone;
        for (const std::uint32_t e : ignored) {
          taken = taken && (e | 1U) != (h | 1U);
        }
      }
      corners.forbidden[i * n + j] = taken;
    }
  }
}

bool apply_split(CellMap& map, std::span<const std::uint32_t> halves, const PolygonSplit& split) {
  const std::size_t n = halves.size();
  if (split.star >= 0) {
    std::vector<std::uint32_t> spokes;
    for (std::size_t i = static_cast<std::size_t>(split.star); i < n; i += 2) {
      spokes.push_back(halves[i]);
    }
    const std::uint32_t f = map.face(halves[0]);
    map.star_face(f, spokes, map.face_centre(f));
    return true;
  }
  for (const auto& [i, j] : split.diagonals) {
    if (map.adjacent(map.origin(halves[i]), map.origin(halves[j]))) {
      return false;
    }
  }
  // outs[i]: half-edges that leave corner i inside the polygon; exactly one pair of two corners
  // lies in one face as long as the corners aren't joined.
  std::vector<std::vector<std::uint32_t>> outs(n);
  for (std::size_t i = 0; i < n; ++i) {
    outs[i].push_back(halves[i]);
  }
  for (const auto& [i, j] : split.diagonals) {
    bool done = false;
    for (std::size_t a = 0; a < outs[i].size() && !done; ++a) {
      for (std::size_t b = 0; b < outs[j].size() && !done; ++b) {
        if (map.face(outs[i][a]) == map.face(outs[j][b])) {
          const std::uint32_t x = map.split_face(outs[i][a], outs[j][b]);
          outs[j].push_back(x);
          outs[i].push_back(CellMap::twin(x));
          done = true;
        }
      }
    }
    ensure(done, "the ends of a diagonal share a face");
  }
  return true;
}

SplitReport split_cells(CellMap& map) {
  SplitReport report;
  std::vector<std::uint32_t> todo, ids, halves;
  const auto inset = [&](std::uint32_t f) {
    map.inset_face(f);
    ++report.insets;
    todo.push_back(f);
  };
  const std::uint32_t faces = map.face_count();
  for (std::uint32_t f = 0; f < faces; ++f) {
    if (map.is_cell(f) && map.degree(f) >= 4) {
      report.insets += cut_large(map, f, todo);
    }
  }

  std::vector<PolygonSplit> plans;
  while (!todo.empty()) {
    ++report.rounds;
    plans.assign(todo.size(), {});
    parallel_chunks(
        todo.size(),
        [&](std::size_t begin, std::size_t end) {
          PolygonSplitter splitter;
          PolygonCorners corners;
          std::vector<std::uint32_t> ring;
          for (std::size_t i = begin; i < end; ++i) {
            if (map.degree(todo[i]) > 4) {
              map.face_halves(todo[i], ring);
              plans[i] = plan(map, ring, splitter, corners);
            }
          }
        },
        kGrain);
    std::vector<std::uint32_t> current;
    current.swap(todo);
    for (std::size_t i = 0; i < current.size(); ++i) {
      const std::uint32_t f = current[i];
      if (map.degree(f) < 4) {
        continue;
      }
      if (map.degree(f) == 4) {
        if (repeats_vertex(map, f, ids)) {
          inset(f);
        }
        continue;
      }
      if (!plans[i].feasible) {
        inset(f);
        continue;
      }
      map.face_halves(f, halves);
      if (apply_split(map, halves, plans[i])) {
        report.stars += plans[i].star >= 0;
      } else {
        todo.push_back(f);  // another face took a diagonal: once more
      }
    }
  }
  return report;
}

}  // namespace rattan
