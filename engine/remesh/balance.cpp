// SPDX-License-Identifier: MIT
#include "engine/remesh/balance.h"

#include <algorithm>
#include <array>
#include <tuple>
#include <vector>

#include "engine/remesh/collapse_quads.h"

namespace rattan {
namespace {

constexpr int kRounds = 4;
/// Least cosine between the normals of a quad's opposite corners: merging them on the tip of a horn
/// would shorten it.
constexpr double kFlat = 0.9;

int off_square(std::uint32_t valence) {
  const int off = static_cast<int>(valence) - 4;
  return off * off;
}

class Balancer {
 public:
  explicit Balancer(CellMap& map) : map_(map) {}

  bool round(BalanceReport& report) {
    candidates_.clear();
    for (std::uint32_t f = 0; f < map_.face_count(); ++f) {
      if (map_.is_cell(f) && map_.degree(f) == 4) {
        const std::uint32_t h = map_.face_half(f);
        note(collapse_gain(h), h, kCollapse);
        note(collapse_gain(map_.next(h)), map_.next(h), kCollapse);
      }
    }
    for (std::uint32_t h = 0; h < map_.half_count(); h += 2) {
      if (map_.half_alive(h)) {
        note(turn_gain(h, kTurnLeft), h, kTurnLeft);
        note(turn_gain(h, kTurnRight), h, kTurnRight);
      }
    }
    std::sort(candidates_.begin(), candidates_.end());
    bool any = false;
    for (const auto& [loss, h, kind] : candidates_) {
      if (!map_.half_alive(h)) {
        continue;
      }
      if (kind == kCollapse) {
        if (collapse_gain(h) > 0 && may_collapse(h)) {
          collapse_quad(map_, h);
          ++report.collapsed;
          any = true;
        }
      } else if (turn_gain(h, kind) > 0 && may_turn(h, kind)) {
        turn(h, kind);
        ++report.turned;
        any = true;
      }
    }
    return any;
  }

 private:
  enum Kind : std::uint8_t { kCollapse, kTurnLeft, kTurnRight };

  void note(int gain, std::uint32_t h, Kind kind) {
    if (gain > 0) {
      candidates_.emplace_back(-gain, h, kind);
    }
  }

  bool is_quad(std::uint32_t h) const {
    const std::uint32_t f = map_.face(h);
    return !map_.is_hole(f) && map_.degree(f) == 4;
  }
  bool inner(std::uint32_t v) const { return !map_.on_curve(v) && !map_.is_corner(v); }

  /// Of merging origin(h) and the opposite corner.
  int collapse_gain(std::uint32_t h) const {
    if (!is_quad(h)) {
      return 0;
    }
    const auto [a, b, c, d] = map_.quad_corners(h);
    const std::uint32_t va = map_.valence(a), vb = map_.valence(b);
    const std::uint32_t vc = map_.valence(c), vd = map_.valence(d);
    if (vb < 4 || vd < 4 || !inner(a) || !inner(b) || !inner(c) || !inner(d)) {
      return 0;
    }
    return off_square(va) + off_square(vb) + off_square(vc) + off_square(vd) -
           off_square(va + vc - 2) - off_square(vb - 1) - off_square(vd - 1);
  }

  bool may_collapse(std::uint32_t h) const {
    const auto [a, b, c, d] = map_.quad_corners(h);
    return map_.normal(a).dot(map_.normal(c)) >= kFlat &&
           map_.normal(b).dot(map_.normal(d)) >= kFlat && collapsible(map_, h);
  }

  /// Half-edges out of the corners that h is turned to, one in each of its quads.
  std::array<std::uint32_t, 2> turned_ends(std::uint32_t h, Kind kind) const {
    const std::uint32_t t = CellMap::twin(h);
    return kind == kTurnLeft ? std::array{map_.next(map_.next(h)), map_.next(map_.next(t))}
                             : std::array{map_.prev(h), map_.prev(t)};
  }

  int turn_gain(std::uint32_t h, Kind kind) const {
    const std::uint32_t t = CellMap::twin(h);
    if (!is_quad(h) || !is_quad(t) || map_.face(h) == map_.face(t)) {
      return 0;
    }
    const auto ends = turned_ends(h, kind);
    const std::uint32_t u = map_.origin(h), v = map_.target(h);
    const std::uint32_t p = map_.origin(ends[0]), r = map_.origin(ends[1]);
    const std::uint32_t vu = map_.valence(u), vv = map_.valence(v);
    const std::uint32_t vp = map_.valence(p), vr = map_.valence(r);
    if (vu < 4 || vv < 4 || !inner(u) || !inner(v) || !inner(p) || !inner(r)) {
      return 0;
    }
    return off_square(vu) + off_square(vv) + off_square(vp) + off_square(vr) - off_square(vu - 1) -
           off_square(vv - 1) - off_square(vp + 1) - off_square(vr + 1);
  }

  bool may_turn(std::uint32_t h, Kind kind) const {
    const auto [u, v, p, q] = map_.quad_corners(h);
    const auto [v2, u2, r, s] = map_.quad_corners(CellMap::twin(h));
    const auto ends = turned_ends(h, kind);
    return u == u2 && v == v2 && p != r && p != s && q != r && q != s &&
           !map_.adjacent(map_.origin(ends[0]), map_.origin(ends[1]));
  }

  void turn(std::uint32_t h, Kind kind) {
    const auto ends = turned_ends(h, kind);
    map_.erase_edge(h);
    map_.split_face(ends[0], ends[1]);
  }

  CellMap& map_;
  std::vector<std::tuple<int, std::uint32_t, Kind>> candidates_;
};

}  // namespace

BalanceReport balance_valences(CellMap& map) {
  BalanceReport report;
  Balancer balancer(map);
  for (int round = 0; round < kRounds && balancer.round(report); ++round) {
  }
  return report;
}

}  // namespace rattan
