// SPDX-License-Identifier: MIT
#include "io/remesh/polygon_triangles.h"

#include <algorithm>
#include <limits>
#include <map>
#include <span>

#include <Eigen/Geometry>

#include "engine/core/errors.h"

namespace rattan {
namespace {

using Key = std::uint64_t;

Key pair_key(std::uint32_t a, std::uint32_t b) {
  return (static_cast<Key>(std::min(a, b)) << 32) | std::max(a, b);
}

/// Calls f(key) for each diagonal of the fan.
template <class F>
void for_diagonals(std::span<const std::uint32_t> face, std::size_t apex, const F& f) {
  const std::size_t n = face.size();
  for (std::size_t j = 2; j + 1 < n; ++j) {
    f(pair_key(face[apex], face[(apex + j) % n]));
  }
}

/// A quad has two fans, any other polygon as many as corners.
std::size_t fan_count(std::size_t degree) {
  return degree == 4 ? 2 : degree;
}

/// Fans by badness: folded triangles first of all, then the length of the diagonals.
void rank_fans(const PolygonMesh& mesh, std::size_t f, std::vector<std::uint32_t>& order) {
  const auto face = mesh.face(f);
  const std::size_t n = face.size();
  const auto at = [&](std::size_t i) -> const Vec3d& { return mesh.positions[face[i % n]]; };
  Vec3d area = Vec3d::Zero();
  for (std::size_t i = 1; i + 1 < n; ++i) {
    area += (at(i) - at(0)).cross(at(i + 1) - at(0));
  }
  const std::size_t fans = fan_count(n);
  std::vector<std::pair<std::uint32_t, double>> score(fans);
  order.resize(fans);
  for (std::uint32_t a = 0; a < fans; ++a) {
    order[a] = a;
    for (std::size_t t = 0; t + 2 < n; ++t) {
      const Vec3d& tip = at(a);
      const double toward = (at(a + t + 1) - tip).cross(at(a + t + 2) - tip).dot(area);
      score[a].first += toward > 0.0 ? 0 : 1;
      score[a].second += t + 3 < n ? (at(a + t + 2) - tip).squaredNorm() : 0.0;
    }
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t x, std::uint32_t y) { return score[x] < score[y]; });
}

/// The few faces that want a diagonal which something else wants too: each gets a fan of its own by
/// augmenting paths (a face that stands in the way moves to another fan where it can).
class Contest {
 public:
  Contest(const PolygonMesh& mesh, const std::vector<Key>& edges, std::vector<std::uint32_t>& apex)
      : mesh_(mesh), edges_(edges), apex_(apex) {}

  bool place(std::size_t f) {
    seen_.clear();
    return try_place(f);
  }

 private:
  bool try_place(std::size_t f) {
    std::vector<std::uint32_t> order;
    rank_fans(mesh_, f, order);
    const auto face = mesh_.face(f);
    for (const std::uint32_t a : order) {
      bool blocked = false;
      std::vector<Key> taken;
      for_diagonals(face, a, [&](Key key) {
        blocked = blocked || std::binary_search(edges_.begin(), edges_.end(), key) ||
                  std::find(seen_.begin(), seen_.end(), key) != seen_.end();
        if (const auto owner = owner_.find(key); owner != owner_.end() && owner->second != f) {
          taken.push_back(key);
        }
      });
      if (blocked || taken.size() > 1) {
        continue;
      }
      if (!taken.empty()) {
        // While the one in the way looks for another fan, no face it pushes on in turn may take a
        // diagonal of this one.
        const auto mark = static_cast<std::ptrdiff_t>(seen_.size());
        seen_.push_back(taken.front());
        for_diagonals(face, a, [&](Key key) { seen_.push_back(key); });
        const auto end = static_cast<std::ptrdiff_t>(seen_.size());
        if (!try_place(owner_.at(taken.front()))) {
          seen_.erase(seen_.begin() + mark + 1, seen_.begin() + end);
          continue;
        }
      }
      take(f, a);
      return true;
    }
    return false;
  }

  void take(std::size_t f, std::uint32_t a) {
    for_diagonals(mesh_.face(f), apex_[f], [&](Key key) {
      if (const auto owner = owner_.find(key); owner != owner_.end() && owner->second == f) {
        owner_.erase(owner);
      }
    });
    apex_[f] = a;
    for_diagonals(mesh_.face(f), a, [&](Key key) { owner_[key] = f; });
  }

  const PolygonMesh& mesh_;
  const std::vector<Key>& edges_;
  std::vector<std::uint32_t>& apex_;
  std::map<Key, std::size_t> owner_;
  std::vector<Key> seen_;
};

}  // namespace

std::vector<std::uint32_t> choose_fan_apexes(const PolygonMesh& mesh) {
  const std::size_t faces = mesh.face_count();
  std::vector<std::uint32_t> apex(faces, 0);
  std::vector<Key> edges;
  struct Wish {
    Key key;
    std::size_t face;
  };
  std::vector<Wish> wishes;
  edges.reserve(mesh.corners.size());
  for (std::size_t f = 0; f < faces; ++f) {
    const auto face = mesh.face(f);
    for (std::size_t i = 0; i < face.size(); ++i) {
      edges.push_back(pair_key(face[i], face[(i + 1) % face.size()]));
    }
    if (face.size() > 3) {
      for (std::size_t a = 0; a < fan_count(face.size()); ++a) {
        for_diagonals(face, a, [&](Key key) { wishes.push_back({key, f}); });
      }
    }
  }
  if (wishes.empty()) {
    return apex;
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  std::sort(wishes.begin(), wishes.end(), [](const Wish& x, const Wish& y) {
    return x.key != y.key ? x.key < y.key : x.face < y.face;
  });

  std::vector<char> contested(faces, 0);
  auto edge = edges.begin();
  for (std::size_t i = 0, j = 0; i < wishes.size(); i = j) {
    while (j < wishes.size() && wishes[j].key == wishes[i].key) {
      ++j;
    }
    edge = std::lower_bound(edge, edges.end(), wishes[i].key);
    const bool is_edge = edge != edges.end() && *edge == wishes[i].key;
    if (is_edge || wishes[i].face != wishes[j - 1].face) {
      for (std::size_t k = i; k < j; ++k) {
        contested[wishes[k].face] = 1;
      }
    }
  }

  Contest contest(mesh, edges, apex);
  std::vector<std::uint32_t> order;
  for (std::size_t f = 0; f < faces; ++f) {
    if (mesh.degree(f) <= 3) {
      continue;
    }
    if (contested[f] == 0) {
      rank_fans(mesh, f, order);
      apex[f] = order.front();
    } else if (!contest.place(f)) {
      throw InternalError("face " + std::to_string(f) +
                          " cannot be cut into triangles for Draco: edges elsewhere join all its "
                          "opposite corners");
    }
  }
  return apex;
}

}  // namespace rattan
