// SPDX-License-Identifier: MIT
#include "engine/layout/boundary_corners.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace rattan::layout {

bool keep_true_corners(Skeleton& skeleton, const TraceOptions& options) {
  Skeleton& k = skeleton;
  std::vector<std::uint32_t> after(k.nodes.size(), kNone);   // boundary strand that leaves
  std::vector<std::uint32_t> before(k.nodes.size(), kNone);  // and arrives
  for (std::uint32_t i = 0; i < k.strands.size(); ++i) {
    const Strand& s = k.strands[i];
    if (s.boundary && !s.closed) {
      after[k.start(s.first)] = i;
      before[k.end(s.last)] = i;
    }
  }
  const auto other_end = [&](std::uint32_t strand, bool forward) {
    const Strand& s = k.strands[strand];
    return forward ? k.end(s.last) : k.start(s.first);
  };
  // Half a side, but short on short loops.
  std::vector<std::int64_t> window(k.nodes.size(), -1);
  for (const std::uint32_t n : k.essential) {
    if (after[n] == kNone || window[n] >= 0) {
      continue;
    }
    std::int64_t loop = 0;
    std::uint32_t at = n;
    do {
      loop += k.strands[after[at]].length;
      at = other_end(after[at], true);
    } while (at != n);
    do {
      window[at] = std::min(static_cast<std::int64_t>(options.side) / 2, loop / 8);
      at = other_end(after[at], true);
    } while (at != n);
  }
  // The place on the boundary one window away, straight between nodes.
  const auto place = [&](std::uint32_t from, bool forward) -> Vec3d {
    std::int64_t left = window[from];
    std::uint32_t at = from;
    for (;;) {
      const std::uint32_t strand = forward ? after[at] : before[at];
      const std::uint32_t to = other_end(strand, forward);
      const std::int64_t length = k.strands[strand].length;
      const Vec3d& p = k.nodes[at].position;
      const Vec3d& q = k.nodes[to].position;
      if (length > left) {
        return p + (static_cast<double>(left) / static_cast<double>(length)) * (q - p);
      }
      left -= length;
      at = to;
      if (at == from) {
        return q;
      }
    }
  };
  struct Turn {
    std::uint32_t node;
    double cosine;
  };
  std::vector<Turn> turns;
  for (const std::uint32_t n : k.essential) {
    if ((k.nodes[n].flags & kCornerNode) == 0) {
      continue;
    }
    if (after[n] == kNone || before[n] == kNone) {
      continue;
    }
    const Vec3d in = k.nodes[n].position - place(n, false);
    const Vec3d out = place(n, true) - k.nodes[n].position;
    const double lengths = std::sqrt(in.squaredNorm() * out.squaredNorm());
    const double cosine = lengths > 0.0 ? in.dot(out) / lengths : 1.0;
    if (cosine < options.corner_cosine) {
      turns.push_back({n, cosine});
    }
    k.nodes[n].flags &= static_cast<std::uint8_t>(~kCornerNode);
  }
  // The sharpest first; it silences the others within its window.
  std::stable_sort(turns.begin(), turns.end(),
                   [](const Turn& x, const Turn& y) { return x.cosine < y.cosine; });
  std::vector<std::uint8_t> silent(k.nodes.size(), 0);
  for (const Turn& t : turns) {
    if (silent[t.node] != 0) {
      continue;
    }
    k.nodes[t.node].flags |= kCornerNode;
    for (const bool forward : {false, true}) {
      std::int64_t left = window[t.node];
      for (std::uint32_t at = t.node;;) {
        const std::uint32_t strand = forward ? after[at] : before[at];
        left -= k.strands[strand].length;
        at = other_end(strand, forward);
        if (left < 0 || at == t.node) {
          break;
        }
        silent[at] = 1;
      }
    }
  }
  bool changed = false;
  for (const std::uint32_t n : k.essential) {
    changed = changed || (k.degree(n) == 2 && k.nodes[n].flags == 0);
  }
  return changed;
}

}  // namespace rattan::layout
