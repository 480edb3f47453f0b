// SPDX-License-Identifier: MIT
#include "io/layout/textured_mesh.h"

#include <algorithm>
#include <bit>
#include <limits>

namespace rattan {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

std::uint64_t mixed(std::uint64_t a, std::uint64_t b) {
  std::uint64_t x = a ^ (b + 0x9e3779b97f4a7c15U + (a << 6) + (a >> 2));
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9U;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebU;
  return x ^ (x >> 31);
}

// -0 and 0 are the same number.
std::uint64_t bits_of(float x) {
  return std::bit_cast<std::uint32_t>(x + 0.0F);
}

struct Keyed {
  std::uint64_t key = 0;
  std::uint32_t triangle = 0;
};

/// Triangles by a hash of what their corners carry, the same from whichever corner.
class KeyedTriangles {
 public:
  explicit KeyedTriangles(const TexturedMesh& mesh) {
    std::vector<std::uint64_t> corner(mesh.uv.size());
    for (std::size_t i = 0; i < corner.size(); ++i) {
      const auto& p = mesh.position[mesh.vertex[i]];
      const Rgba colour = mesh.colour.empty() ? Rgba{} : mesh.colour[mesh.vertex[i]];
      std::uint64_t h = mixed(bits_of(p[0]) << 32 | bits_of(p[1]), bits_of(p[2]));
      h = mixed(h, bits_of(mesh.uv[i][0]) << 32 | bits_of(mesh.uv[i][1]));
      corner[i] =
          mixed(h, std::uint64_t{mesh.chart[i]} << 32 | std::bit_cast<std::uint32_t>(colour));
    }
    order_.resize(mesh.triangle.size());
    for (std::uint32_t t = 0; t < order_.size(); ++t) {
      std::array<std::uint64_t, 3> h{};
      for (std::size_t k = 0; k < 3; ++k) {
        h[k] = corner[mesh.triangle[t][k]];
      }
      std::rotate(h.begin(), std::min_element(h.begin(), h.end()), h.end());
      order_[t] = {mixed(mixed(h[0], h[1]), h[2]), t};
    }
    std::sort(order_.begin(), order_.end(), [](const Keyed& a, const Keyed& b) {
      return a.key != b.key ? a.key < b.key : a.triangle < b.triangle;
    });
  }
  const std::vector<Keyed>& order() const { return order_; }

 private:
  std::vector<Keyed> order_;
};

/// A one-to-one map that grows, and can be taken back to what it was.
class Matching {
 public:
  explicit Matching(std::size_t count) : forth_(count, kNone), back_(count, kNone) {}
  bool allows(std::uint32_t a, std::uint32_t b) const {
    return forth_[a] == b || (forth_[a] == kNone && back_[b] == kNone);
  }
  bool knows(std::uint32_t a) const { return forth_[a] != kNone; }
  void join(std::uint32_t a, std::uint32_t b) {
    if (forth_[a] == kNone && journaled_) {
      journal_.push_back(a);
    }
    forth_[a] = b;
    back_[b] = a;
  }
  /// From now on take_back() undoes what is joined; or all so far stays.
  void begin_trial(bool trial) {
    journaled_ = trial;
    journal_.clear();
  }
  void take_back() {
    for (const std::uint32_t a : journal_) {
      back_[forth_[a]] = kNone;
      forth_[a] = kNone;
    }
    journal_.clear();
  }

 private:
  std::vector<std::uint32_t> forth_;
  std::vector<std::uint32_t> back_;
  std::vector<std::uint32_t> journal_;
  bool journaled_ = false;
};

class Matcher {
 public:
  Matcher(const TexturedMesh& a, const TexturedMesh& b)
      : a_(a), b_(b), vertices_(a.position.size()), texture_vertices_(a.uv.size()) {}

  std::string run() {
    const KeyedTriangles keyed_a(a_);
    const KeyedTriangles keyed_b(b_);
    const std::vector<Keyed>& order_a = keyed_a.order();
    const std::vector<Keyed>& order_b = keyed_b.order();
    for (std::size_t i = 0, j = 0; i < order_a.size(); i = j) {
      while (j < order_a.size() && order_a[j].key == order_a[i].key) {
        if (order_b[j].key != order_a[j].key) {
          return difference_at(order_a[j].triangle);
        }
        ++j;
      }
      if (j - i > 1) {
        for (std::size_t k = i; k < j; ++k) {
          alike_.push_back({order_a[k].triangle, static_cast<std::uint32_t>(i),
                            static_cast<std::uint32_t>(j), kNone});
        }
      } else if (!match(order_a[i].triangle, order_b[i].triangle, 0)) {
        return difference_at(order_a[i].triangle);
      }
    }
    return match_alike(order_b);
  }

 private:
  /// A triangle that others are like: those from begin to end of the sorted ones.
  struct Alike {
    std::uint32_t triangle;
    std::uint32_t begin;
    std::uint32_t end;
    std::uint32_t match;  // among the sorted ones
  };

  static std::string difference_at(std::uint32_t triangle) {
    return "triangle " + std::to_string(triangle) + " came back with other corners";
  }

  bool same_corner(std::uint32_t i, std::uint32_t j) const {
    const std::uint32_t v = a_.vertex[i];
    const std::uint32_t w = b_.vertex[j];
    return a_.uv[i] == b_.uv[j] && a_.chart[i] == b_.chart[j] && a_.position[v] == b_.position[w] &&
           (a_.colour.empty() || a_.colour[v] == b_.colour[w]);
  }

  /// Maps triangle s to t, turned in any of the three ways from the first, if that goes with all so
  /// far.
  bool match(std::uint32_t s, std::uint32_t t, std::size_t first_turn) {
    const auto& x = a_.triangle[s];
    const auto& y = b_.triangle[t];
    for (std::size_t turn = first_turn; turn < 3; ++turn) {
      bool fits = true;
      for (std::size_t k = 0; k < 3 && fits; ++k) {
        const std::uint32_t i = x[k];
        const std::uint32_t j = y[(k + turn) % 3];
        fits = same_corner(i, j) && texture_vertices_.allows(i, j) &&
               vertices_.allows(a_.vertex[i], b_.vertex[j]);
      }
      if (fits) {
        for (std::size_t k = 0; k < 3; ++k) {
          const std::uint32_t i = x[k];
          const std::uint32_t j = y[(k + turn) % 3];
          texture_vertices_.join(i, j);
          vertices_.join(a_.vertex[i], b_.vertex[j]);
        }
        return true;
      }
    }
    return false;
  }

  bool has_known_side(std::uint32_t s) const {
    int known = 0;
    for (const std::uint32_t i : a_.triangle[s]) {
      known += vertices_.knows(a_.vertex[i]) ? 1 : 0;
    }
    return known > 1;
  }

  /// Matches what lies beside matched triangles, which leaves no choice. False if something there
  /// has no match. `joined`: what was matched, by place in alike_.
  bool propagate(const std::vector<Keyed>& order, std::vector<std::uint32_t>& joined) {
    for (bool again = true; again;) {
      again = false;
      for (std::uint32_t i = 0; i < alike_.size(); ++i) {
        Alike& a = alike_[i];
        if (a.match != kNone || !has_known_side(a.triangle)) {
          continue;
        }
        for (std::uint32_t j = a.begin; j < a.end && a.match == kNone; ++j) {
          if (taken_[j] == 0 && match(a.triangle, order[j].triangle, 0)) {
            a.match = j;
            taken_[j] = 1;
            joined.push_back(i);
            again = true;
          }
        }
        if (a.match == kNone) {
          return false;
        }
      }
    }
    return true;
  }

  bool try_seed(Alike& a, std::uint32_t place, std::uint32_t j, std::size_t turn,
                const std::vector<Keyed>& order) {
    vertices_.begin_trial(true);
    texture_vertices_.begin_trial(true);
    std::vector<std::uint32_t> joined;
    if (match(a.triangle, order[j].triangle, turn)) {
      a.match = j;
      taken_[j] = 1;
      joined.push_back(place);
      if (propagate(order, joined)) {
        return true;
      }
    }
    for (const std::uint32_t i : joined) {
      taken_[alike_[i].match] = 0;
      alike_[i].match = kNone;
    }
    vertices_.take_back();
    texture_vertices_.take_back();
    return false;
  }

  /// Those that only their neighbours tell apart: first what lies beside matched ones; then whole
  /// components, each begun from any match that can be carried through. Components that are alike
  /// throughout can stand for each other, so no choice is taken back later.
  std::string match_alike(const std::vector<Keyed>& order) {
    constexpr const char* kDifference = "of the triangles alike, some are connected differently";
    if (alike_.empty()) {
      return {};
    }
    taken_.assign(order.size(), 0);
    std::vector<std::uint32_t> joined;
    if (!propagate(order, joined)) {
      return kDifference;
    }
    for (std::uint32_t i = 0; i < alike_.size(); ++i) {
      Alike& a = alike_[i];
      for (std::uint32_t j = a.begin; j < a.end && a.match == kNone; ++j) {
        for (std::size_t turn = 0; turn < 3 && taken_[j] == 0 && a.match == kNone; ++turn) {
          try_seed(a, i, j, turn, order);
        }
      }
      if (a.match == kNone) {
        return kDifference;
      }
    }
    return {};
  }

  const TexturedMesh& a_;
  const TexturedMesh& b_;
  Matching vertices_;
  Matching texture_vertices_;
  std::vector<Alike> alike_;
  std::vector<std::uint8_t> taken_;
};

}  // namespace

std::string difference_of(const TexturedMesh& meant, const TexturedMesh& read) {
  const auto say = [](const char* what, std::size_t a, std::size_t b) {
    return std::to_string(b) + " " + what + " came back where " + std::to_string(a) + " were meant";
  };
  if (meant.position.size() != read.position.size()) {
    return say("vertices", meant.position.size(), read.position.size());
  }
  if (meant.uv.size() != read.uv.size()) {
    return say("texture vertices", meant.uv.size(), read.uv.size());
  }
  if (meant.triangle.size() != read.triangle.size()) {
    return say("triangles", meant.triangle.size(), read.triangle.size());
  }
  if (meant.colour.size() != read.colour.size()) {
    return say("colours", meant.colour.size(), read.colour.size());
  }
  return Matcher(meant, read).run();
}

}  // namespace rattan
