// SPDX-License-Identifier: MIT
#include "engine/remesh/collapse_quads.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace rattan {
namespace {

constexpr std::uint32_t kNone = CellMap::kNone;
// A collapse bends the lines around it, so it must mend more than it may leave.
constexpr double kLeastGain = 0.9;

/// What a vertex costs by its valence; on the boundary it should have one inner edge.
double valence_cost(const CellMap& map, std::uint32_t v, int change) {
  if (map.is_corner(v)) {
    return 0.0;
  }
  const int off = static_cast<int>(map.valence(v)) + change - (map.on_boundary(v) ? 3 : 4);
  return off == 0 ? 0.0 : 1.0 + 1.5 * (std::abs(off) - 1);
}

/// How much better the valences are after collapsing the quad of h.
double gain(const CellMap& map, std::uint32_t h) {
  const auto [a, b, c, d] = map.quad_corners(h);
  const std::uint32_t kept = map.on_curve(c) || map.is_corner(c) ? c : a;
  const std::uint32_t other = kept == a ? c : a;
  return valence_cost(map, a, 0) + valence_cost(map, c, 0) + valence_cost(map, b, 0) +
         valence_cost(map, d, 0) - valence_cost(map, b, -1) - valence_cost(map, d, -1) -
         valence_cost(map, kept, static_cast<int>(map.valence(other)) - 2);
}

/// Whether v, on a crease but not at its corner, has no other edge on its side of the crease than
/// one of the two that the quad of `out` (from v) has there: without that its corner would be flat.
bool last_beside_crease(const CellMap& map, std::uint32_t out) {
  const std::uint32_t v = map.origin(out), in = map.prev(out);
  if (!map.on_feature(v) || map.is_corner(v) || map.is_feature(out) == map.is_feature(in)) {
    return false;
  }
  // From the crease's edge over the quad's inner one to the next.
  const bool left = map.is_feature(out);
  const std::uint32_t inner = left ? CellMap::twin(in) : out;
  const std::uint32_t next = left ? map.around(inner) : map.next(CellMap::twin(inner));
  return map.is_feature(next);
}

}  // namespace

bool collapsible(const CellMap& map, std::uint32_t h) {
  const std::uint32_t f = map.face(h);
  if (map.degree(f) != 4 || map.is_hole(f)) {
    return false;
  }
  const auto [a, b, c, d] = map.quad_corners(h);
  if ((map.on_curve(a) && map.on_curve(c)) || (map.is_corner(a) && map.is_corner(c)) ||
      (map.is_corner(a) && map.on_curve(c)) || (map.is_corner(c) && map.on_curve(a))) {
    return false;
  }
  for (const std::uint32_t v : {b, d}) {
    if (map.valence(v) < 4) {
      return false;
    }
  }
  if (last_beside_crease(map, map.next(h)) || last_beside_crease(map, map.prev(h))) {
    return false;
  }
  if (map.valence(a) + map.valence(c) < 5) {
    return false;
  }
  // a and c share b and d and no other neighbour, and no other face.
  const std::uint32_t start = map.vertex_half(a);
  std::uint32_t out = start;
  do {
    const std::uint32_t w = map.target(out);
    if (w == c || (w != b && w != d && map.adjacent(w, c))) {
      return false;
    }
    const std::uint32_t g = map.face(out);
    if (g != f && map.is_cell(g) && map.degree(g) == 4 && map.target(map.next(out)) == c) {
      return false;
    }
    out = map.around(out);
  } while (out != start);
  return true;
}

Vec3d collapsed_position(const CellMap& map, std::uint32_t h) {
  const std::uint32_t a = map.origin(h), c = map.target(map.next(h));
  if (map.on_curve(a) || map.is_corner(a)) {
    return map.position(a);
  }
  if (map.on_curve(c) || map.is_corner(c)) {
    return map.position(c);
  }
  return 0.5 * (map.position(a) + map.position(c));
}

std::uint32_t collapse_quad(CellMap& map, std::uint32_t h) {
  const std::uint32_t second = map.next(map.next(h));
  const Vec3d at = collapsed_position(map, h);
  // Two triangles, their common edge contracted, then two faces of two edges each.
  const std::uint32_t diagonal = map.split_face(h, second);
  const std::uint32_t kept = map.origin(diagonal);
  map.contract_edge(diagonal, at);
  for (const std::uint32_t side : {h, second}) {
    // Of the two edges that fell together the one on a curve stays.
    const bool stays = map.is_hole(map.face(CellMap::twin(side))) || map.is_feature(side);
    map.erase_edge(stays ? map.next(side) : side);
  }
  return kept;
}

std::uint64_t collapse_irregular(CellMap& map) {
  struct Candidate {
    double gain;
    std::uint32_t face, half;
  };
  const auto best_of = [&](std::uint32_t f) {
    Candidate best{0.0, f, kNone};
    const std::uint32_t h = map.face_half(f);
    for (const std::uint32_t k : {h, map.next(h)}) {
      const double g = gain(map, k);
      if (g > kLeastGain && g > best.gain && collapsible(map, k)) {
        best = {g, f, k};
      }
    }
    return best;
  };
  const auto worse = [](const Candidate& x, const Candidate& y) {
    return x.gain != y.gain ? x.gain < y.gain : x.face > y.face;
  };
  std::vector<Candidate> heap;
  const auto push = [&](std::uint32_t f) {
    if (map.is_cell(f) && map.degree(f) == 4) {
      const Candidate c = best_of(f);
      if (c.half != kNone) {
        heap.push_back(c);
        std::push_heap(heap.begin(), heap.end(), worse);
      }
    }
  };
  for (std::uint32_t f = 0; f < map.face_count(); ++f) {
    push(f);
  }
  std::uint64_t done = 0;
  std::vector<std::uint32_t> faces;
  while (!heap.empty()) {
    std::pop_heap(heap.begin(), heap.end(), worse);
    const Candidate c = heap.back();
    heap.pop_back();
    if (!map.is_cell(c.face) || map.degree(c.face) != 4) {
      continue;
    }
    const Candidate now = best_of(c.face);
    if (now.half == kNone) {
      continue;
    }
    if (now.gain != c.gain) {
      heap.push_back(now);
      std::push_heap(heap.begin(), heap.end(), worse);
      continue;
    }
    const std::uint32_t b = map.target(now.half), d = map.origin(map.prev(now.half));
    const std::uint32_t kept = collapse_quad(map, now.half);
    ++done;
    faces.clear();
    for (const std::uint32_t v : {kept, b, d}) {
      const std::uint32_t start = map.vertex_half(v);
      std::uint32_t out = start;
      do {
        faces.push_back(map.face(out));
        out = map.around(out);
      } while (out != start);
    }
    std::sort(faces.begin(), faces.end());
    faces.erase(std::unique(faces.begin(), faces.end()), faces.end());
    for (const std::uint32_t f : faces) {
      push(f);
    }
  }
  return done;
}

}  // namespace rattan
