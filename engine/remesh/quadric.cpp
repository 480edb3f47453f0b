// SPDX-License-Identifier: MIT
#include "engine/remesh/quadric.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <emmintrin.h>
#include <limits>

#include <Eigen/Dense>

#include "engine/core/errors.h"

namespace rattan {

namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
constexpr std::uint64_t kNoCell = std::numeric_limits<std::uint64_t>::max();
// A crease of 90 degrees must count for vertices on both sides, the far side of a thin plate not.
constexpr double kFacingAway = -0.3;

/// Vertices sorted into cubes of one side, columns of cubes hashed; nearest vertex within that
/// side.
class VertexGrid {
 public:
  VertexGrid(std::span<const Vec3d> positions, std::span<const Vec3d> normals, double side)
      : positions_(positions), normals_(normals), side_(side) {
    low_ = Vec3d::Constant(std::numeric_limits<double>::infinity());
    Vec3d high = -low_;
    for (const Vec3d& p : positions) {
      low_ = low_.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    // 21 bits an axis, and a margin of one cell on either side.
    side_ = std::max(side_, (high - low_).maxCoeff() / ((1 << 21) - 4));
    low_ -= Vec3d::Constant(side_);
    std::vector<std::pair<std::uint64_t, std::uint32_t>> sorted(positions.size());
    for (std::uint32_t v = 0; v < positions.size(); ++v) {
      sorted[v] = {key(positions[v]), v};
    }
    std::sort(sorted.begin(), sorted.end());
    members_.resize(sorted.size());
    keys_.resize(sorted.size());
    std::size_t columns = 0;
    for (std::size_t i = 0; i < sorted.size(); ++i) {
      keys_[i] = sorted[i].first;
      members_[i] = sorted[i].second;
      columns += i == 0 || keys_[i] >> kAxisBits != keys_[i - 1] >> kAxisBits ? 1 : 0;
    }
    table_.assign(std::bit_ceil(2 * columns + 1), Column{kNoCell, 0, 0});
    for (std::size_t i = 0; i < keys_.size();) {
      const std::uint64_t column = keys_[i] >> kAxisBits;
      std::size_t j = i;
      while (j < keys_.size() && keys_[j] >> kAxisBits == column) {
        ++j;
      }
      std::size_t at = slot(column, table_.size());
      while (table_[at].column != kNoCell) {
        at = (at + 1) & (table_.size() - 1);
      }
      table_[at] = {column, static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j)};
      i = j;
    }
  }

  /// Keeps the candidates of the cells asked for last: triangles come in curve order and stay long
  /// in one cell.
  class Cache {
   public:
    Cache() : slots_(kSlots) {}

   private:
    friend class VertexGrid;
    static constexpr std::size_t kSlots = 256;
    struct Slot {
      std::uint64_t key = kNoCell;
      std::vector<std::uint32_t> candidates;  ///< ascending
      /// Theirs, x, y and z by turns, two candidates at a time; an odd one out has infinity beside.
      std::vector<double> coordinates;
    };
    std::vector<Slot> slots_;
  };

  std::uint32_t nearest(const Vec3d& p, const Vec3d& normal, Cache& cache) const {
    const std::uint64_t k = key(p);
    if (k == kNoCell) {
      return kNone;
    }
    Cache::Slot& s = cache.slots_[slot(k, Cache::kSlots)];
    if (s.key != k) {
      s.key = k;
      gather(k, s);
    }
    // Nearly always the nearest of all faces the right way.
    const std::uint32_t first = nearest_of(p, s);
    if (first == kNone || normals_[first].dot(normal) > kFacingAway) {
      return first;
    }
    double best = side_ * side_;
    std::uint32_t vertex = kNone;
    for (const std::uint32_t v : s.candidates) {
      const double d2 = (positions_[v] - p).squaredNorm();
      if ((d2 < best || (d2 == best && v < vertex)) && normals_[v].dot(normal) > kFacingAway) {
        best = d2;
        vertex = v;
      }
    }
    return vertex;
  }

 private:
  static constexpr int kAxisBits = 21;

  /// All cells of one x and y. Their members follow each other, by z.
  struct Column {
    std::uint64_t column;
    std::uint32_t begin;
    std::uint32_t end;
  };

  static std::size_t slot(std::uint64_t k, std::size_t size) {
    return static_cast<std::size_t>((k * 0x9E3779B97F4A7C15ULL) >> 32) & (size - 1);
  }

  std::uint64_t key(const Vec3d& p) const {
    const Vec3d c = (p - low_) / side_;
    constexpr double kLimit = (1 << 21) - 1;
    if (!(c.minCoeff() >= 0.0 && c.maxCoeff() < kLimit)) {
      return kNoCell;
    }
    return static_cast<std::uint64_t>(c.x()) << 42 | static_cast<std::uint64_t>(c.y()) << 21 |
           static_cast<std::uint64_t>(c.z());
  }

  /// The nearest candidate within the side, of several the lowest; whichever way it faces.
  std::uint32_t nearest_of(const Vec3d& p, const Cache::Slot& s) const {
    const __m128d px = _mm_set1_pd(p.x());
    const __m128d py = _mm_set1_pd(p.y());
    const __m128d pz = _mm_set1_pd(p.z());
    __m128d best = _mm_set1_pd(std::numeric_limits<double>::infinity());
    __m128i best_at = _mm_setzero_si128();
    __m128i at = _mm_set_epi64x(1, 0);
    for (std::size_t k = 0; k < s.coordinates.size(); k += 6) {
      const __m128d x = _mm_loadu_pd(s.coordinates.data() + k) - px;
      const __m128d y = _mm_loadu_pd(s.coordinates.data() + k + 2) - py;
      const __m128d z = _mm_loadu_pd(s.coordinates.data() + k + 4) - pz;
      const __m128d d2 = x * x + (y * y + z * z);
      const __m128i nearer = _mm_castpd_si128(_mm_cmplt_pd(d2, best));
      best = _mm_min_pd(d2, best);
      best_at = _mm_or_si128(_mm_and_si128(nearer, at), _mm_andnot_si128(nearer, best_at));
      at = _mm_add_epi64(at, _mm_set1_epi64x(2));
    }
    const double even = _mm_cvtsd_f64(best);
    const double odd = _mm_cvtsd_f64(_mm_unpackhi_pd(best, best));
    const auto even_at = static_cast<std::size_t>(_mm_cvtsi128_si64(best_at));
    const auto odd_at =
        static_cast<std::size_t>(_mm_cvtsi128_si64(_mm_unpackhi_epi64(best_at, best_at)));
    if (!(std::min(even, odd) <= side_ * side_)) {
      return kNone;
    }
    return s.candidates[even < odd || (even == odd && even_at < odd_at) ? even_at : odd_at];
  }

  void gather(std::uint64_t k, Cache::Slot& slot_of_key) const {
    std::vector<std::uint32_t>& out = slot_of_key.candidates;
    constexpr std::uint64_t kMask = (1 << kAxisBits) - 1;
    const std::array<std::uint64_t, 3> c{k >> (2 * kAxisBits), k >> kAxisBits & kMask, k & kMask};
    out.clear();
    for (std::uint64_t x = std::max<std::uint64_t>(c[0], 1) - 1; x <= c[0] + 1; ++x) {
      for (std::uint64_t y = std::max<std::uint64_t>(c[1], 1) - 1; y <= c[1] + 1; ++y) {
        const std::uint64_t column = x << kAxisBits | y;
        std::size_t at = slot(column, table_.size());
        while (table_[at].column != kNoCell && table_[at].column != column) {
          at = (at + 1) & (table_.size() - 1);
        }
        if (table_[at].column == column) {
          const std::uint64_t first = column << kAxisBits | (std::max<std::uint64_t>(c[2], 1) - 1);
          const std::uint64_t last = column << kAxisBits | (c[2] + 1);
          const auto end = keys_.begin() + table_[at].end;
          auto i = std::lower_bound(keys_.begin() + table_[at].begin, end, first);
          for (; i != end && *i <= last; ++i) {
            out.push_back(members_[static_cast<std::size_t>(i - keys_.begin())]);
          }
        }
      }
    }
    std::sort(out.begin(), out.end());
    std::vector<double>& x = slot_of_key.coordinates;
    x.assign((out.size() + 1) / 2 * 6, std::numeric_limits<double>::infinity());
    for (std::size_t i = 0; i < out.size(); ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        x[i / 2 * 6 + 2 * axis + i % 2] = positions_[out[i]][static_cast<Eigen::Index>(axis)];
      }
    }
  }

  std::span<const Vec3d> positions_;
  std::span<const Vec3d> normals_;
  double side_;
  Vec3d low_;
  std::vector<std::uint64_t> keys_;  ///< ascending
  std::vector<std::uint32_t> members_;
  std::vector<Column> table_;
};

}  // namespace

std::vector<VertexQuadric> gather_quadrics(Store& store, const ScanMesh& mesh,
                                           std::span<const Vec3d> positions,
                                           std::span<const Vec3d> normals, double reach,
                                           TaskGraph& graph) {
  ensure(positions.size() == normals.size(), "one normal a vertex");
  ensure(positions.size() < kNone, "remesh vertices are numbered in 32 bits");
  std::vector<VertexQuadric> quadrics(positions.size());
  if (positions.empty() || !(reach > 0.0)) {
    return quadrics;
  }
  const VertexGrid grid(positions, normals, reach);
  struct Part {
    std::uint32_t vertex;
    double area;
    Vec3d normal;
    double d;
  };
  struct State {
    TileMesh mesh;
    std::vector<Part> parts;
  };
  run_pass<State>(
      graph, "quadrics", mesh.layout.tile_count(),
      [&](TileId t, State& s) { s.mesh = load_tile(store, mesh, t); },
      [&](TileId, State& s) {
        VertexGrid::Cache cache;
        const std::span<const Vec3f> x = s.mesh.positions.span();
        const auto owned = s.mesh.triangles.span().first(s.mesh.counts.owned);
        s.parts.reserve(owned.size());
        for (const LocalTriangle& t : owned) {
          const Vec3d a = x[t[0]].cast<double>();
          const Vec3d b = x[t[1]].cast<double>();
          const Vec3d c = x[t[2]].cast<double>();
          Vec3d n = (b - a).cross(c - a);
          const double twice = n.norm();
          if (!(twice > 0.0)) {
            continue;
          }
          n /= twice;
          const Vec3d centroid = (a + b + c) * (1.0 / 3.0);
          const std::uint32_t v = grid.nearest(centroid, n, cache);
          if (v != kNone) {
            s.parts.push_back({v, 0.5 * twice, n, n.dot(centroid - positions[v])});
          }
        }
        s.mesh = {};
      },
      [&](TileId, State& s) {
        // Serial, in the order of the triangles: the sums must not depend on the tiles.
        for (const Part& p : s.parts) {
          VertexQuadric& q = quadrics[p.vertex];
          const Vec3d an = p.area * p.normal;
          q.nn[0] += an.x() * p.normal.x();
          q.nn[1] += an.x() * p.normal.y();
          q.nn[2] += an.x() * p.normal.z();
          q.nn[3] += an.y() * p.normal.y();
          q.nn[4] += an.y() * p.normal.z();
          q.nn[5] += an.z() * p.normal.z();
          q.nd[0] += an.x() * p.d;
          q.nd[1] += an.y() * p.d;
          q.nd[2] += an.z() * p.d;
          q.area += p.area;
        }
      });
  return quadrics;
}

Vec3d quadric_displacement(const VertexQuadric& quadric, const Vec3d& vertex_normal,
                           double tangential_weight, double normal_weight) {
  if (!(quadric.area > 0.0)) {
    return Vec3d::Zero();
  }
  Eigen::Matrix3d m;
  m << quadric.nn[0], quadric.nn[1], quadric.nn[2],  //
      quadric.nn[1], quadric.nn[3], quadric.nn[4],   //
      quadric.nn[2], quadric.nn[4], quadric.nn[5];
  m += quadric.area *
       (tangential_weight * Eigen::Matrix3d::Identity() +
        (normal_weight - tangential_weight) * vertex_normal * vertex_normal.transpose());
  const Vec3d rhs(quadric.nd[0], quadric.nd[1], quadric.nd[2]);
  return m.llt().solve(rhs);
}

double bentness(const VertexQuadric& quadric, const Vec3d& vertex_normal) {
  if (!(quadric.area > 0.0)) {
    return 1.0;
  }
  const Vec3d& n = vertex_normal;
  const double along = quadric.nn[0] * n.x() * n.x() + quadric.nn[3] * n.y() * n.y() +
                       quadric.nn[5] * n.z() * n.z() +
                       2.0 * (quadric.nn[1] * n.x() * n.y() + quadric.nn[2] * n.x() * n.z() +
                              quadric.nn[4] * n.y() * n.z());
  return 1.0 - along / quadric.area;
}

}  // namespace rattan
