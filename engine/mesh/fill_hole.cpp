// SPDX-License-Identifier: MIT
// Based on: G. T. Klincsek, "Minimal triangulations of polygonal domains" (1980), with forbidden
// chords.
#include "engine/mesh/fill_hole.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <queue>
#include <tuple>

namespace rattan {

namespace {

using Chord = std::pair<std::uint32_t, std::uint32_t>;
using Corners = std::array<std::uint32_t, 3>;

class HoleFiller {
 public:
  HoleFiller(std::span<const Vec3d> loop, std::span<const Chord> taken)
      : loop_(loop), taken_(taken), n_(static_cast<std::uint32_t>(loop.size())) {}

  std::vector<Corners> run() {
    if (n_ <= kExactHole) {
      least();
    } else {
      cut_ears();
    }
    std::sort(out_.begin(), out_.end());
    return std::move(out_);
  }

 private:
  double squared(std::uint32_t i, std::uint32_t j) const {
    return (loop_[i] - loop_[j]).squaredNorm();
  }
  bool is_side(std::uint32_t i, std::uint32_t j) const {
    return j == i + 1 || (i == 0 && j + 1 == n_);
  }
  bool allowed(std::uint32_t i, std::uint32_t j) const {
    return is_side(i, j) || !std::binary_search(taken_.begin(), taken_.end(), Chord(i, j));
  }

  /// best[i][j]: the least cost of the part of the loop from i to j, closed by the chord (i, j).
  void least() {
    constexpr double kNever = std::numeric_limits<double>::infinity();
    std::vector<double> best(std::size_t{n_} * n_, kNever);
    std::vector<std::uint32_t> apex(best.size(), 0);
    const auto at = [&](std::uint32_t i, std::uint32_t j) { return std::size_t{i} * n_ + j; };
    for (std::uint32_t i = 0; i + 1 < n_; ++i) {
      best[at(i, i + 1)] = 0.0;
    }
    for (std::uint32_t span = 2; span < n_; ++span) {
      for (std::uint32_t i = 0; i + span < n_; ++i) {
        const std::uint32_t j = i + span;
        if (!allowed(i, j)) {
          continue;
        }
        for (std::uint32_t k = i + 1; k < j; ++k) {
          const double cost = best[at(i, k)] + best[at(k, j)] + squared(i, k) + squared(k, j);
          if (cost < best[at(i, j)]) {
            best[at(i, j)] = cost;
            apex[at(i, j)] = k;
          }
        }
        best[at(i, j)] += squared(i, j);
      }
    }
    if (best[at(0, n_ - 1)] == kNever) {
      return;
    }
    std::vector<Chord> open = {{0, n_ - 1}};
    while (!open.empty()) {
      const auto [i, j] = open.back();
      open.pop_back();
      if (j - i >= 2) {
        const std::uint32_t k = apex[at(i, j)];
        out_.push_back({i, k, j});
        open.emplace_back(i, k);
        open.emplace_back(k, j);
      }
    }
  }

  void cut_ears() {
    struct Ear {
      double length;
      std::uint32_t before, tip, after;
      bool operator>(const Ear& o) const {
        return std::tie(length, tip, before, after) > std::tie(o.length, o.tip, o.before, o.after);
      }
    };
    std::vector<std::uint32_t> next(n_);
    std::vector<std::uint32_t> previous(n_);
    std::vector<std::uint8_t> gone(n_, 0);
    std::priority_queue<Ear, std::vector<Ear>, std::greater<>> ears;
    const auto offer = [&](std::uint32_t tip) {
      const std::uint32_t a = previous[tip];
      const std::uint32_t b = next[tip];
      if (allowed(std::min(a, b), std::max(a, b))) {
        ears.push({squared(a, b), a, tip, b});
      }
    };
    for (std::uint32_t i = 0; i < n_; ++i) {
      next[i] = i + 1 < n_ ? i + 1 : 0;
      previous[i] = i > 0 ? i - 1 : n_ - 1;
    }
    for (std::uint32_t i = 0; i < n_; ++i) {
      offer(i);
    }
    std::uint32_t left = n_;
    while (left > 3 && !ears.empty()) {
      const Ear e = ears.top();
      ears.pop();
      if (gone[e.tip] != 0 || previous[e.tip] != e.before || next[e.tip] != e.after) {
        continue;
      }
      add(e.before, e.tip, e.after);
      gone[e.tip] = 1;
      next[e.before] = e.after;
      previous[e.after] = e.before;
      --left;
      offer(e.before);
      offer(e.after);
    }
    if (left > 3) {
      out_.clear();
      return;
    }
    const auto first =
        static_cast<std::uint32_t>(std::find(gone.begin(), gone.end(), 0) - gone.begin());
    add(first, next[first], next[next[first]]);
  }

  void add(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    Corners t{a, b, c};
    std::sort(t.begin(), t.end());
    out_.push_back(t);
  }

  std::span<const Vec3d> loop_;
  std::span<const Chord> taken_;
  std::uint32_t n_;
  std::vector<Corners> out_;
};

}  // namespace

std::vector<Corners> triangulate_hole(std::span<const Vec3d> loop, std::span<const Chord> taken) {
  return HoleFiller(loop, taken).run();
}

}  // namespace rattan
