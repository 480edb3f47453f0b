// SPDX-License-Identifier: MIT
#include "jobs/view_script.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "engine/core/errors.h"
#include "io/picture/thumbnail.h"

namespace rattan {
namespace {

using Vec3i = Eigen::Vector3i;

constexpr int kMostStep = 8191;  // coordinates are within +- this
constexpr std::uint32_t kUnseen = std::numeric_limits<std::uint32_t>::max();

/// Faces over shared vertices, small.
struct SmallMesh {
  std::vector<Vec3f> positions;
  std::vector<Vec3f> normals;  ///< of any length
  std::vector<std::uint32_t> begin{0};
  std::vector<std::uint32_t> corners;

  std::size_t face_count() const { return begin.size() - 1; }
  std::span<const std::uint32_t> face(std::size_t f) const {
    return {corners.data() + begin[f], corners.data() + begin[f + 1]};
  }
  void end_face() { begin.push_back(static_cast<std::uint32_t>(corners.size())); }
};

/// Vertices in one cell of a grid become one, at their mean; faces that lose their area go, and of
/// those on the same vertices all but the first.
class GridReduction {
 public:
  GridReduction(const PolygonMesh& mesh, const MeshSight& sight) : mesh_(mesh), sight_(sight) {}

  SmallMesh run(std::size_t most_faces) {
    normals_.assign(sight_.positions.size(), Vec3f::Zero());
    double area = 0.0;
    for_each_face([&](std::span<const std::uint32_t> c) {
      Vec3f sum = Vec3f::Zero();
      for (std::size_t i = 1; i + 1 < c.size(); ++i) {
        const Vec3f& p = sight_.positions[c[0]];
        sum += (sight_.positions[c[i]] - p).cross(sight_.positions[c[i + 1]] - p);
      }
      area += 0.5 * static_cast<double>(sum.norm());
      for (const std::uint32_t v : c) {
        normals_[v] += sum;
      }
    });
    // A surface takes about 1.5 cells for each square of a cell's side.
    const double least = (sight_.high - sight_.low).maxCoeff() / 1e6;
    double cell = std::max(std::sqrt(1.5 * area / static_cast<double>(most_faces)), least);
    for (;;) {
      merge(cell);
      collect();
      if (faces_.size() <= most_faces) {
        return result();
      }
      cell *=
          1.02 * std::sqrt(static_cast<double>(faces_.size()) / static_cast<double>(most_faces));
    }
  }

 private:
  struct Face {
    std::array<std::uint32_t, 4> sorted;  // kUnseen behind the third of a triangle
    std::uint32_t order;
    std::array<std::uint32_t, 4> corners;
    bool operator<(const Face& o) const {
      return sorted != o.sorted ? sorted < o.sorted : order < o.order;
    }
  };

  /// Faces of at most four corners; larger ones as fans of triangles.
  template <class F>
  void for_each_face(const F& f) const {
    for (std::size_t i = 0; i < mesh_.face_count(); ++i) {
      const auto face = mesh_.face(i);
      if (face.size() <= 4) {
        f(face);
        continue;
      }
      for (std::size_t k = 1; k + 1 < face.size(); ++k) {
        const std::array<std::uint32_t, 3> part{face[0], face[k], face[k + 1]};
        f(std::span<const std::uint32_t>(part));
      }
    }
  }

  void merge(double cell) {
    constexpr std::uint64_t kMost = (std::uint64_t{1} << 21) - 1;
    std::vector<std::pair<std::uint64_t, std::uint32_t>> cells;
    cells.reserve(sight_.positions.size());
    for (std::uint32_t v = 0; v < sight_.positions.size(); ++v) {
      std::uint64_t key = 0;
      for (int k = 0; k < 3; ++k) {
        const double at = (static_cast<double>(sight_.positions[v][k]) - sight_.low[k]) / cell;
        key = key << 21 | std::min(static_cast<std::uint64_t>(std::max(at, 0.0)), kMost);
      }
      cells.emplace_back(key, v);
    }
    std::sort(cells.begin(), cells.end());
    cell_of_.resize(cells.size());
    means_.clear();
    for (std::size_t begin = 0; begin < cells.size();) {
      std::size_t end = begin;
      Vec3d sum = Vec3d::Zero();
      for (; end < cells.size() && cells[end].first == cells[begin].first; ++end) {
        sum += sight_.positions[cells[end].second].cast<double>();
        cell_of_[cells[end].second] = static_cast<std::uint32_t>(means_.size());
      }
      means_.push_back((sum / static_cast<double>(end - begin)).cast<float>());
      begin = end;
    }
  }

  void collect() {
    faces_.clear();
    for_each_face([&](std::span<const std::uint32_t> face) {
      Face out{{kUnseen, kUnseen, kUnseen, kUnseen}, static_cast<std::uint32_t>(faces_.size()), {}};
      out.corners = out.sorted;
      std::size_t n = 0;
      for (const std::uint32_t v : face) {
        const std::uint32_t c = cell_of_[v];
        if (n == 0 || (out.corners[n - 1] != c && (n < 3 || out.corners[0] != c))) {
          out.corners[n++] = c;
        }
      }
      if (n == 3 && out.corners[2] == out.corners[0]) {
        n = 2;
      }
      if (n < 3) {
        return;
      }
      out.sorted = out.corners;  // what is unused comes last
      std::sort(out.sorted.begin(), out.sorted.end());
      if (out.sorted[0] != out.sorted[1] && out.sorted[1] != out.sorted[2] &&
          out.sorted[2] != out.sorted[3]) {
        faces_.push_back(out);
      }
    });
    std::sort(faces_.begin(), faces_.end());
    faces_.erase(std::unique(faces_.begin(), faces_.end(),
                             [](const Face& a, const Face& b) { return a.sorted == b.sorted; }),
                 faces_.end());
    std::sort(faces_.begin(), faces_.end(),
              [](const Face& a, const Face& b) { return a.order < b.order; });
  }

  SmallMesh result() {
    SmallMesh out;
    out.normals.assign(means_.size(), Vec3f::Zero());
    for (std::size_t v = 0; v < cell_of_.size(); ++v) {
      out.normals[cell_of_[v]] += normals_[v];
    }
    out.positions = std::move(means_);
    for (const Face& face : faces_) {
      for (const std::uint32_t c : face.corners) {
        if (c != kUnseen) {
          out.corners.push_back(c);
        }
      }
      out.end_face();
    }
    return out;
  }

  const PolygonMesh& mesh_;
  const MeshSight& sight_;
  std::vector<Vec3f> normals_;
  std::vector<std::uint32_t> cell_of_;
  std::vector<Vec3f> means_;
  std::vector<Face> faces_;
};

std::string base64(std::span<const std::uint8_t> bytes) {
  static constexpr char kDigits[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t n = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      word = word << 8 | (k < n ? bytes[i + k] : 0U);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      out += k <= n ? kDigits[word >> (18 - 6 * k) & 63U] : '=';
    }
  }
  return out;
}

/// A direction on the octahedron |x| + |y| + |z| = 1, its lower half folded outward.
std::array<std::uint8_t, 2> octahedral(const Vec3f& n) {
  const float size = std::abs(n.x()) + std::abs(n.y()) + std::abs(n.z());
  if (!(size > 0.0F)) {
    return {128, 128};
  }
  float x = n.x() / size;
  float y = n.y() / size;
  if (n.z() < 0.0F) {
    const float folded_x = (1.0F - std::abs(y)) * (x < 0.0F ? -1.0F : 1.0F);
    y = (1.0F - std::abs(x)) * (y < 0.0F ? -1.0F : 1.0F);
    x = folded_x;
  }
  return {static_cast<std::uint8_t>(std::lround(127.5F + 127.0F * x)),
          static_cast<std::uint8_t>(std::lround(127.5F + 127.0F * y))};
}

/// Connectivity and positions in one stream of bytes.
class Encoder {
 public:
  Encoder(std::span<const Vec3f> positions, double step)
      : positions_(positions), step_(step), number_(positions.size(), kUnseen) {}

  void face(std::span<const std::uint32_t> face) {
    const std::size_t n = face.size();
    // New corners last, so that as many as can be are expected from old ones.
    std::size_t first = 0;
    for (std::size_t k = 0; k < n; ++k) {
      if (number_[face[k]] != kUnseen && number_[face[(k + n - 1) % n]] == kUnseen) {
        first = k;
        break;
      }
    }
    std::array<Vec3i, 4> at{};
    for (std::size_t k = 0; k < n; ++k) {
      const std::uint32_t v = face[(first + k) % n];
      if (number_[v] != kUnseen) {
        put(next_ - number_[v]);
        last_ = step_of(v);
      } else {
        put(0);
        number_[v] = next_++;
        const Vec3i is = step_of(v);
        const Vec3i expected = n == 4 && k == 3 ? Vec3i(at[0] + at[2] - at[1]) : last_;
        for (int i = 0; i < 3; ++i) {
          const int d = is[i] - expected[i];
          put(d < 0 ? static_cast<std::uint32_t>(-2 * d - 1) : static_cast<std::uint32_t>(2 * d));
        }
        last_ = is;
      }
      if (k < 4) {
        at[k] = last_;
      }
    }
  }

  std::uint32_t vertices() const { return next_; }
  /// Of each vertex of the mesh, in what comes out; kUnseen if it isn't.
  std::span<const std::uint32_t> numbers() const { return number_; }
  std::string text() const { return base64(bytes_); }

 private:
  Vec3i step_of(std::uint32_t v) const {
    Vec3i out;
    for (int k = 0; k < 3; ++k) {
      out[k] = static_cast<int>(std::lround(static_cast<double>(positions_[v][k]) / step_));
    }
    return out;
  }
  void put(std::uint32_t value) {
    for (; value >= 128; value >>= 7) {
      bytes_.push_back(static_cast<std::uint8_t>(value & 127U) | 128U);
    }
    bytes_.push_back(static_cast<std::uint8_t>(value));
  }

  std::span<const Vec3f> positions_;
  double step_;
  std::vector<std::uint32_t> number_;
  std::uint32_t next_ = 0;
  Vec3i last_ = Vec3i::Zero();
  std::vector<std::uint8_t> bytes_;
};

/// Faces of a mesh of either kind, those with equally many corners together: quads, triangles, the
/// rest.
template <class Mesh>
nlohmann::json encode_faces(const Mesh& mesh, Encoder& encoder) {
  std::vector<std::uint32_t> by_degree;
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    const std::size_t degree = mesh.face(f).size();
    if (by_degree.size() <= degree) {
      by_degree.resize(degree + 1);
    }
    ++by_degree[degree];
  }
  std::vector<std::size_t> degrees;
  for (std::size_t d = 3; d < by_degree.size(); ++d) {
    if (by_degree[d] > 0) {
      degrees.push_back(d);
    }
  }
  std::stable_partition(degrees.begin(), degrees.end(), [](std::size_t d) { return d == 4; });
  nlohmann::json groups = nlohmann::json::array();
  for (const std::size_t d : degrees) {
    groups.push_back({d, by_degree[d]});
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
      if (mesh.face(f).size() == d) {
        encoder.face(mesh.face(f));
      }
    }
  }
  return groups;
}

nlohmann::json vector_json(const Vec3f& v) {
  nlohmann::json out = nlohmann::json::array();
  for (int k = 0; k < 3; ++k) {
    out.push_back(std::round(1e5 * static_cast<double>(v[k])) / 1e5);
  }
  return out;
}

/// Rows of the camera's frame.
nlohmann::json view_json(const MeshSight& sight) {
  const Camera camera(sight.low, sight.high, sight.view);
  std::array<Vec3f, 3> rows;
  for (int k = 0; k < 3; ++k) {
    const Vec3f turned = camera.turn(Vec3f::Unit(k));
    rows[0][k] = turned.x();
    rows[1][k] = turned.y();
    rows[2][k] = -turned.z();
  }
  return {vector_json(rows[0]), vector_json(rows[1]), vector_json(rows[2])};
}

}  // namespace

std::size_t view_script_bytes(const PolygonMesh& mesh, const ViewScriptOptions& options) {
  const bool reduced = mesh.face_count() > options.most_faces;
  const std::size_t shown = std::min(mesh.face_count(), options.most_faces);
  return mesh.vertex_count() * (sizeof(Vec3f) + (reduced ? 44 : 4)) +
         (reduced ? 2 * shown * 64 : 0) + shown * 64 + (std::size_t{1} << 20);
}

std::string view_script(const PolygonMesh& mesh, const std::string& name,
                        const ViewScriptOptions& options) {
  ensure(mesh.face_count() > 0, "a view shows something");
  const MeshSight sight(mesh);
  const double step = std::max(sight.high.maxCoeff(), 1e-300) / kMostStep;
  nlohmann::json head;
  head["name"] = name;
  head["faces"] = mesh.face_count();
  head["scale"] = step;
  head["up"] = vector_json(
      (sight.view.up.isZero(0.0) ? Vec3d(Vec3d::Unit(sight.view.up_axis)) : sight.view.up)
          .cast<float>());
  head["view"] = view_json(sight);
  const auto finish = [&](const Encoder& encoder, nlohmann::json groups) {
    head["groups"] = std::move(groups);
    head["vertices"] = encoder.vertices();
    head["data"] = encoder.text();
  };
  if (mesh.face_count() <= options.most_faces) {
    Encoder encoder(sight.positions, step);
    nlohmann::json groups = encode_faces(mesh, encoder);
    finish(encoder, std::move(groups));
  } else {
    const SmallMesh small = GridReduction(mesh, sight).run(options.most_faces);
    Encoder encoder(small.positions, step);
    nlohmann::json groups = encode_faces(small, encoder);
    finish(encoder, std::move(groups));
    std::vector<std::uint8_t> normals(2 * std::size_t{encoder.vertices()});
    for (std::size_t v = 0; v < small.normals.size(); ++v) {
      if (const std::uint32_t number = encoder.numbers()[v]; number != kUnseen) {
        const auto [x, y] = octahedral(small.normals[v]);
        normals[2 * std::size_t{number}] = x;
        normals[2 * std::size_t{number} + 1] = y;
      }
    }
    head["normals"] = base64(normals);
  }
  return "rattan_view(" + head.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace) +
         ");\n";
}

}  // namespace rattan
