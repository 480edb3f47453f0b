// SPDX-License-Identifier: MIT
#include "io/remesh/mesh_identity.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <vector>

namespace rattan {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
constexpr std::uint64_t kNoEdge = std::numeric_limits<std::uint64_t>::max();

std::string count_difference(const PolygonMesh& meant, const PolygonMesh& read) {
  const auto say = [](const char* what, std::size_t a, std::size_t b) {
    return std::to_string(b) + " " + what + " came back where " + std::to_string(a) + " were meant";
  };
  if (meant.vertex_count() != read.vertex_count()) {
    return say("vertices", meant.vertex_count(), read.vertex_count());
  }
  if (meant.face_count() != read.face_count()) {
    return say("faces", meant.face_count(), read.face_count());
  }
  if (meant.corners.size() != read.corners.size()) {
    return say("corners", meant.corners.size(), read.corners.size());
  }
  if (meant.colours.size() != read.colours.size()) {
    return say("colours", meant.colours.size(), read.colours.size());
  }
  return {};
}

/// Order of vertices by position, then colour.
int compare(const PolygonMesh& a, std::uint32_t v, const PolygonMesh& b, std::uint32_t w) {
  for (int k = 0; k < 3; ++k) {
    if (a.positions[v][k] != b.positions[w][k]) {
      return a.positions[v][k] < b.positions[w][k] ? -1 : 1;
    }
  }
  if (a.colours.empty() || a.colours[v] == b.colours[w]) {
    return 0;
  }
  return a.colours[v] < b.colours[w] ? -1 : 1;
}

std::vector<std::uint32_t> by_place(const PolygonMesh& mesh) {
  std::vector<std::uint32_t> order(mesh.vertex_count());
  std::iota(order.begin(), order.end(), 0U);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    const int less = compare(mesh, a, mesh, b);
    return less != 0 ? less < 0 : a < b;
  });
  return order;
}

/// Faces as sequences of vertex labels from the least rotation, and their sorted order.
class LabelledFaces {
 public:
  LabelledFaces(const PolygonMesh& mesh, const std::vector<std::uint32_t>& label) : mesh_(mesh) {
    start_.resize(mesh.face_count());
    labels_.resize(mesh.corners.size());
    for (std::size_t i = 0; i < labels_.size(); ++i) {
      labels_[i] = label[mesh.corners[i]];
    }
    for (std::size_t f = 0; f < start_.size(); ++f) {
      std::uint32_t best = 0;
      for (std::uint32_t s = 1; s < mesh.degree(f); ++s) {
        if (compare(f, s, *this, f, best) < 0) {
          best = s;
        }
      }
      start_[f] = best;
    }
    order_.resize(start_.size());
    std::iota(order_.begin(), order_.end(), 0U);
    std::sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) {
      const int c = compare(a, *this, b);
      return c != 0 ? c < 0 : a < b;
    });
  }

  int compare(std::size_t f, const LabelledFaces& other, std::size_t g) const {
    return compare(f, start_[f], other, g, other.start_[g]);
  }
  int compare(std::size_t f, std::uint32_t s, const LabelledFaces& other, std::size_t g,
              std::uint32_t t) const {
    const std::size_t n = mesh_.degree(f);
    const std::size_t m = other.mesh_.degree(g);
    if (n != m) {
      return n < m ? -1 : 1;
    }
    for (std::size_t i = 0; i < n; ++i) {
      const std::uint32_t a = labels_[mesh_.face_begin[f] + (s + i) % n];
      const std::uint32_t b = other.labels_[other.mesh_.face_begin[g] + (t + i) % n];
      if (a != b) {
        return a < b ? -1 : 1;
      }
    }
    return 0;
  }

  const std::vector<std::uint32_t>& order() const { return order_; }

 private:
  const PolygonMesh& mesh_;
  std::vector<std::uint32_t> labels_;
  std::vector<std::uint32_t> start_;
  std::vector<std::uint32_t> order_;
};

/// Twin of each half-edge (numbered like its corner), kNoEdge at a boundary.
struct Twins {
  std::vector<std::uint64_t> twin;
  std::vector<std::uint32_t> face;
  bool ok = true;

  explicit Twins(const PolygonMesh& mesh) {
    struct Edge {
      std::uint64_t key;
      std::uint64_t corner;
    };
    std::vector<Edge> edges;
    edges.reserve(mesh.corners.size());
    face.resize(mesh.corners.size());
    twin.assign(mesh.corners.size(), kNoEdge);
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
      for (std::uint64_t c = mesh.face_begin[f]; c < mesh.face_begin[f + 1]; ++c) {
        face[c] = static_cast<std::uint32_t>(f);
        edges.push_back({(std::uint64_t{from(mesh, f, c)} << 32) | to(mesh, f, c), c});
      }
    }
    std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
      return a.key != b.key ? a.key < b.key : a.corner < b.corner;
    });
    for (std::size_t i = 0; i < edges.size(); ++i) {
      ok = ok && (i == 0 || edges[i].key != edges[i - 1].key);
      const std::uint64_t back = (edges[i].key << 32) | (edges[i].key >> 32);
      const auto it = std::lower_bound(edges.begin(), edges.end(), back,
                                       [](const Edge& e, std::uint64_t k) { return e.key < k; });
      if (it != edges.end() && it->key == back) {
        twin[edges[i].corner] = it->corner;
      }
    }
  }

  static std::uint32_t from(const PolygonMesh& mesh, std::size_t, std::uint64_t c) {
    return mesh.corners[c];
  }
  static std::uint32_t to(const PolygonMesh& mesh, std::size_t f, std::uint64_t c) {
    return mesh.corners[c + 1 == mesh.face_begin[f + 1] ? mesh.face_begin[f] : c + 1];
  }
};

/// Maps edge-connected components of the meant mesh onto components of the one read, each from one
/// pair of faces. Components that carry the same labels are interchangeable, so no choice made for
/// one has to be taken back for another.
class ComponentMatcher {
 public:
  ComponentMatcher(const PolygonMesh& a, const std::vector<std::uint32_t>& label_a,
                   const PolygonMesh& b, const std::vector<std::uint32_t>& label_b)
      : a_(a),
        b_(b),
        label_a_(label_a),
        label_b_(label_b),
        twins_a_(a),
        twins_b_(b),
        faces_a_(a, label_a),
        faces_b_(b, label_b),
        vertex_(a.vertex_count(), kNone),
        vertex_back_(b.vertex_count(), kNone),
        face_(a.face_count(), kNone),
        face_back_(b.face_count(), kNone) {}

  std::string run() {
    if (!twins_a_.ok || !twins_b_.ok) {
      return "two faces use an edge in the same direction";
    }
    for (const std::uint32_t f : faces_a_.order()) {
      if (face_[f] == kNone && !match_component(f)) {
        return "the faces around face " + std::to_string(f) + " are connected differently";
      }
    }
    return {};
  }

 private:
  bool match_component(std::uint32_t seed) {
    const auto& order = faces_b_.order();
    auto it = std::lower_bound(
        order.begin(), order.end(), seed,
        [&](std::uint32_t g, std::uint32_t f) { return faces_a_.compare(f, faces_b_, g) > 0; });
    for (; it != order.end() && faces_a_.compare(seed, faces_b_, *it) == 0; ++it) {
      if (face_back_[*it] != kNone) {
        continue;
      }
      for (std::uint32_t turn = 0; turn < a_.degree(seed); ++turn) {
        if (propagate(seed, *it, turn)) {
          return true;
        }
        undo();
      }
    }
    return false;
  }

  bool pair(std::uint32_t f, std::uint32_t g, std::uint64_t turn) {
    const std::uint64_t n = a_.degree(f);
    if (n != b_.degree(g) || face_back_[g] != kNone) {
      return false;
    }
    face_[f] = g;
    face_back_[g] = f;
    work_.push_back({f, turn});
    for (std::uint64_t i = 0; i < n; ++i) {
      const std::uint32_t v = a_.corners[a_.face_begin[f] + i];
      const std::uint32_t w = b_.corners[b_.face_begin[g] + (i + turn) % n];
      if (vertex_[v] == kNone && vertex_back_[w] == kNone && label_a_[v] == label_b_[w]) {
        vertex_[v] = w;
        vertex_back_[w] = v;
        mapped_.push_back(v);
      } else if (vertex_[v] != w) {
        return false;
      }
    }
    return true;
  }

  bool propagate(std::uint32_t seed, std::uint32_t target, std::uint64_t first_turn) {
    work_.clear();
    mapped_.clear();
    if (!pair(seed, target, first_turn)) {
      return false;
    }
    for (std::size_t done = 0; done < work_.size(); ++done) {
      const auto [f, turn] = work_[done];
      const std::uint32_t g = face_[f];
      const std::uint64_t n = a_.degree(f);
      for (std::uint64_t i = 0; i < n; ++i) {
        const std::uint64_t other_a = twins_a_.twin[a_.face_begin[f] + i];
        const std::uint64_t other_b = twins_b_.twin[b_.face_begin[g] + (i + turn) % n];
        if ((other_a == kNoEdge) != (other_b == kNoEdge)) {
          return false;
        }
        if (other_a == kNoEdge) {
          continue;
        }
        const std::uint32_t next_f = twins_a_.face[other_a];
        const std::uint32_t next_g = twins_b_.face[other_b];
        if (face_[next_f] != kNone) {
          if (face_[next_f] != next_g) {
            return false;
          }
          continue;
        }
        const std::uint64_t m = a_.degree(next_f);
        const std::uint64_t at_a = other_a - a_.face_begin[next_f];
        const std::uint64_t at_b = other_b - b_.face_begin[next_g];
        if (!pair(next_f, next_g, (at_b + m - at_a % m) % m)) {
          return false;
        }
      }
    }
    return true;
  }

  void undo() {
    for (const auto& [f, turn] : work_) {
      face_back_[face_[f]] = kNone;
      face_[f] = kNone;
    }
    for (const std::uint32_t v : mapped_) {
      vertex_back_[vertex_[v]] = kNone;
      vertex_[v] = kNone;
    }
  }

  struct Pairing {
    std::uint32_t face;
    std::uint64_t turn;  // corner i of the face is corner i + turn of its image
  };
  const PolygonMesh& a_;
  const PolygonMesh& b_;
  const std::vector<std::uint32_t>& label_a_;
  const std::vector<std::uint32_t>& label_b_;
  Twins twins_a_;
  Twins twins_b_;
  LabelledFaces faces_a_;
  LabelledFaces faces_b_;
  std::vector<std::uint32_t> vertex_, vertex_back_;
  std::vector<std::uint32_t> face_, face_back_;
  std::vector<Pairing> work_;
  std::vector<std::uint32_t> mapped_;
};

}  // namespace

std::string difference_in_order(const PolygonMesh& meant, const PolygonMesh& read) {
  if (std::string d = count_difference(meant, read); !d.empty()) {
    return d;
  }
  for (std::size_t v = 0; v < meant.vertex_count(); ++v) {
    if (meant.positions[v] != read.positions[v]) {
      return "vertex " + std::to_string(v) + " came back at another place";
    }
    if (!meant.colours.empty() && meant.colours[v] != read.colours[v]) {
      return "vertex " + std::to_string(v) + " came back in another colour";
    }
  }
  for (std::size_t f = 0; f < meant.face_count(); ++f) {
    if (meant.face_begin[f + 1] != read.face_begin[f + 1] ||
        !std::equal(meant.face(f).begin(), meant.face(f).end(), read.face(f).begin())) {
      return "face " + std::to_string(f) + " came back with other corners";
    }
  }
  return {};
}

std::string difference_as_meshes(const PolygonMesh& meant, const PolygonMesh& read) {
  if (std::string d = count_difference(meant, read); !d.empty()) {
    return d;
  }
  // Label vertices by the rank of their position and colour; sorted, these must agree.
  const std::vector<std::uint32_t> order_a = by_place(meant);
  const std::vector<std::uint32_t> order_b = by_place(read);
  std::vector<std::uint32_t> label_a(order_a.size());
  std::vector<std::uint32_t> label_b(order_b.size());
  std::uint32_t rank = 0;
  bool shared = false;
  for (std::size_t i = 0; i < order_a.size(); ++i) {
    if (compare(meant, order_a[i], read, order_b[i]) != 0) {
      const bool moved = meant.positions[order_a[i]] != read.positions[order_b[i]];
      return "vertex " + std::to_string(order_a[i]) + " came back " +
             (moved ? "at another place" : "in another colour");
    }
    if (i > 0 && compare(meant, order_a[i], meant, order_a[i - 1]) != 0) {
      ++rank;
    } else {
      shared = shared || i > 0;
    }
    label_a[order_a[i]] = rank;
    label_b[order_b[i]] = rank;
  }
  if (shared) {
    return ComponentMatcher(meant, label_a, read, label_b).run();
  }
  const LabelledFaces faces_a(meant, label_a);
  const LabelledFaces faces_b(read, label_b);
  for (std::size_t i = 0; i < faces_a.order().size(); ++i) {
    if (faces_a.compare(faces_a.order()[i], faces_b, faces_b.order()[i]) != 0) {
      return "face " + std::to_string(faces_a.order()[i]) + " came back with other corners";
    }
  }
  return {};
}

}  // namespace rattan
