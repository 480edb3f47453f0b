// SPDX-License-Identifier: MIT
#include "io/synth/synth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "engine/core/errors.h"
#include "io/synth/centres.h"
#include "io/synth/holes.h"
#include "io/synth/noise.h"
#include "io/synth/patches.h"
#include "io/synth/ply_stream.h"

namespace rattan {
namespace synth {
namespace {

constexpr std::uint64_t kMaxTriangles = 8000000000U;  // 32-bit indices in the file
constexpr double kUnits = 125.0;                      // half the size of the result
// Half-width of the displacement within the surface, in local edge lengths. Below a quarter of the
// diagonal, so that quads stay convex and no triangle turns over.
constexpr double kJitter = 0.25;
constexpr double kAgainstShortest = 0.2;  // share of diagonals that are the longer ones
constexpr std::uint32_t kNone = 0xffffffffU;
constexpr std::size_t kOpenPatches = 4;  // written in turns, a band of rows each
constexpr std::size_t kChunk = 192;      // triangles that stay together
constexpr std::size_t kChunks = 512;     // chunks shuffled with each other

// Grids on the sphere are finer towards the ends of a patch: the spacing varies by two in either
// direction. Symmetric, so that both patches of an edge agree. Those on a plate vary by themselves.
double uneven(PatchKind kind, double t) {
  return kind == PatchKind::kCubeFace ? t - 0.4 * t * (1.0 - t) * (1.0 - 2.0 * t) : t;
}

// From the base shape to the scan's vertices.
class Surface {
 public:
  Surface(const PatchComplex& complex, const SynthOptions& options)
      : seed_(hash(options.seed, 21)),
        noise_(options.noise),
        extent_(complex.extent),
        height_(options.genus == 0 ? 1.0 : 0.65),
        relief_(hash(options.seed, 22),
                10.0 * std::sqrt(complex.area / static_cast<double>(options.triangles))) {}

  BasePoint base(const Patch& patch, std::uint32_t i, std::uint32_t j) const {
    return patch.evaluate(uneven(patch.kind, static_cast<double>(i) / patch.nu),
                          uneven(patch.kind, static_cast<double>(j) / patch.nv));
  }

  /// `spacing` is the local edge length; `name` tells the vertex from all others.
  Vec3f finish(const BasePoint& point, double spacing, std::uint64_t name) const {
    const std::uint64_t bits = hash(seed_, name);
    const std::uint64_t more = mix(bits);
    const Vec3d& n = point.normal;
    const Vec3d other = std::abs(n.x()) < 0.6 ? Vec3d(1, 0, 0) : Vec3d(0, 1, 0);
    Vec3d a = n.cross(other);
    a /= std::sqrt(a.squaredNorm());
    const Vec3d b = n.cross(a);
    const double reach = 2.0 * kJitter * spacing;
    const Vec3d p =
        point.position + a * (reach * (unit(bits) - 0.5)) + b * (reach * (unit(bits >> 32) - 0.5));
    // Two uniforms: most errors are small, none is beyond the half-width.
    const double error = noise_ * spacing * (unit(more) + unit(more >> 32) - 1.0);
    return bent(p + n * (height_ * relief_(p) + error));
  }

  double noise() const { return noise_; }

 private:
  // No real object is a straight plate or a round ball.
  Vec3f bent(const Vec3d& p) const {
    const Vec3d q = p / extent_;
    const Vec3d r(1.1 * q.x() + 0.10 * q.y() * q.y(), 0.95 * q.y() - 0.08 * q.x() * q.z(),
                  q.z() + 0.16 * q.x() * q.x() - 0.12 * q.x() * q.y());
    return (r * kUnits).cast<float>();
  }

  std::uint64_t seed_;
  double noise_;
  double extent_;
  double height_;  // of the relief: tunnels are narrower than a sphere
  Relief relief_;
};

// Triangles in chunks whose order is shuffled within a window, each turned at random.
class TriangleShuffle {
 public:
  TriangleShuffle(PlyStream& out, std::uint64_t seed) : out_(out), seed_(seed) {
    window_.reserve(kChunk * kChunks);
  }
  void add(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    switch (mix(seed_ + count_++) % 3) {
      case 0:
        window_.push_back({a, b, c});
        break;
      case 1:
        window_.push_back({b, c, a});
        break;
      default:
        window_.push_back({c, a, b});
        break;
    }
    if (window_.size() == kChunk * kChunks) {
      flush();
    }
  }
  void flush() {
    std::vector<std::size_t> order((window_.size() + kChunk - 1) / kChunk);
    for (std::size_t k = 0; k < order.size(); ++k) {
      order[k] = k;
      std::swap(order[k], order[hash(seed_, 31, count_, k) % (k + 1)]);
    }
    for (const std::size_t chunk : order) {
      const std::size_t end = std::min(window_.size(), (chunk + 1) * kChunk);
      for (std::size_t t = chunk * kChunk; t < end; ++t) {
        out_.add_triangle(window_[t]);
      }
    }
    window_.clear();
  }
  std::uint64_t count() const { return count_; }

 private:
  PlyStream& out_;
  std::uint64_t seed_;
  std::uint64_t count_ = 0;
  std::vector<std::array<std::uint32_t, 3>> window_;
};

struct Scan {
  const PatchComplex& complex;
  const Holes& holes;
  const Centres& centres;
  const Surface& surface;
  std::uint64_t seed;
  std::vector<Vec3f> border;  // positions of the vertices on corners and edges
  PlyStream& out;
  TriangleShuffle& triangles;
  std::uint32_t next_vertex = 0;
};

// The row of a patch, vertex by vertex.
struct VertexRow {
  std::vector<BasePoint> base;
  std::vector<Vec3f> position;
  std::vector<std::uint32_t> id;
};

// One patch, row of quads by row of quads.
class PatchRun {
 public:
  PatchRun(Scan& scan, std::uint32_t number)
      : scan_(scan), number_(number), patch_(scan.complex.patches[number]) {
    for (VertexRow* row : {&low_, &high_}) {
      row->base.resize(patch_.nu + 1);
      row->position.resize(patch_.nu + 1);
      row->id.resize(patch_.nu + 1);
    }
    missing_low_.resize(patch_.nu);
    missing_high_.resize(patch_.nu);
    evaluate(low_, 0);
    for (std::uint32_t i = 0; i <= patch_.nu; ++i) {
      take_border(low_, i, 0);
    }
    has_missing_high_ = scan_.holes.mark(number_, 0, missing_high_);
  }

  bool done() const { return row_ == patch_.nv; }
  std::uint64_t triangles_left() const { return 2 * std::uint64_t{patch_.nu} * (patch_.nv - row_); }

  void write_row() {
    std::swap(missing_low_, missing_high_);
    has_missing_low_ = has_missing_high_;
    has_missing_high_ = row_ + 1 < patch_.nv && scan_.holes.mark(number_, row_ + 1, missing_high_);
    write_vertices(row_ + 1);
    write_triangles();
    std::swap(low_, high_);
    ++row_;
  }

 private:
  void evaluate(VertexRow& row, std::uint32_t j) const {
    for (std::uint32_t i = 0; i <= patch_.nu; ++i) {
      row.base[i] = scan_.surface.base(patch_, i, j);
    }
  }
  void take_border(VertexRow& row, std::uint32_t i, std::uint32_t j) const {
    const std::uint64_t vertex = scan_.complex.border_vertex(patch_, i, j);
    row.id[i] = static_cast<std::uint32_t>(vertex);
    row.position[i] = scan_.border[vertex];
  }
  std::uint64_t name(std::uint64_t i, std::uint64_t j, std::uint64_t kind) const {
    return hash(kind, number_, i, j);
  }
  // The shorter way to the neighbours before and below.
  double spacing(std::uint32_t i) const {
    return std::sqrt(std::min((high_.base[i].position - high_.base[i - 1].position).squaredNorm(),
                              (high_.base[i].position - low_.base[i].position).squaredNorm()));
  }
  bool is_missing_vertex(std::uint32_t i) const {
    return has_missing_low_ && has_missing_high_ && missing_low_[i - 1] != 0 &&
           missing_low_[i] != 0 && missing_high_[i - 1] != 0 && missing_high_[i] != 0;
  }

  void write_vertices(std::uint32_t j) {
    evaluate(high_, j);
    for (std::uint32_t i = 0; i <= patch_.nu; ++i) {
      if (i == 0 || i == patch_.nu || j == patch_.nv) {
        take_border(high_, i, j);
      } else if (is_missing_vertex(i)) {
        high_.id[i] = kNone;
      } else {
        high_.id[i] = scan_.next_vertex++;
        high_.position[i] = scan_.surface.finish(high_.base[i], spacing(i), name(i, j, 1));
        scan_.out.add_vertex(high_.position[i]);
      }
    }
  }

  void write_triangles() {
    row_of_centres_.begin(scan_.centres, number_, row_);
    for (std::uint32_t i = 0; i < patch_.nu; ++i) {
      if (has_missing_low_ && missing_low_[i] != 0) {
        continue;
      }
      const std::uint32_t a = low_.id[i], b = low_.id[i + 1];
      const std::uint32_t c = high_.id[i + 1], d = high_.id[i];
      if (row_of_centres_(i)) {
        const std::uint32_t m = scan_.next_vertex++;
        scan_.out.add_vertex(centre(i));
        scan_.triangles.add(a, b, m);
        scan_.triangles.add(b, c, m);
        scan_.triangles.add(c, d, m);
        scan_.triangles.add(d, a, m);
      } else if (splits_along_ac(i)) {
        scan_.triangles.add(a, b, c);
        scan_.triangles.add(a, c, d);
      } else {
        scan_.triangles.add(a, b, d);
        scan_.triangles.add(b, c, d);
      }
    }
  }

  // Between the finished corners, so that it lies inside the quad, with half the noise of a vertex.
  Vec3f centre(std::uint32_t i) const {
    const std::uint64_t bits = name(i, row_, 2);
    const Vec3f& a = low_.position[i];
    const Vec3f& b = low_.position[i + 1];
    const Vec3f& c = high_.position[i + 1];
    const Vec3f& d = high_.position[i];
    const float s = static_cast<float>(0.4 + 0.2 * unit(bits));
    const float t = static_cast<float>(0.4 + 0.2 * unit(bits >> 32));
    const Vec3f inside = (a * (1.0F - s) + b * s) * (1.0F - t) + (d * (1.0F - s) + c * s) * t;
    const Vec3f normal = (c - a).cross(d - b);
    const float length = std::sqrt(normal.squaredNorm());
    const float error = length > 0.0F
                            ? static_cast<float>(scan_.surface.noise() * (unit(mix(bits)) - 0.5)) /
                                  std::sqrt(length)
                            : 0.0F;
    return inside + normal * error;
  }

  bool splits_along_ac(std::uint32_t i) const {
    // At the outer corner of a plate both sheets have three vertices of this quad in common: the
    // diagonal between two of them would be an edge of four triangles.
    if (patch_.kind == PatchKind::kCorner && i + 1 == patch_.nu && row_ + 1 == patch_.nv) {
      return true;
    }
    const bool ac = (high_.position[i + 1] - low_.position[i]).squaredNorm() <
                    (high_.position[i] - low_.position[i + 1]).squaredNorm();
    return ac != (unit(name(i, row_, 3)) < kAgainstShortest);
  }

  Scan& scan_;
  std::uint32_t number_;
  const Patch& patch_;
  std::uint32_t row_ = 0;
  VertexRow low_, high_;
  std::vector<std::uint8_t> missing_low_, missing_high_;
  bool has_missing_low_ = false;
  bool has_missing_high_ = false;
  Centres::Row row_of_centres_;
};

// Corners, then the insides of edges, in the order of their numbers.
void write_border(Scan& scan) {
  const PatchComplex& complex = scan.complex;
  const auto add = [&](const Patch& patch, std::uint32_t i, std::uint32_t j, std::uint32_t near_i,
                       std::uint32_t near_j) {
    const BasePoint point = scan.surface.base(patch, i, j);
    const BasePoint near = scan.surface.base(patch, near_i, near_j);
    // Half, because the spacing across the edge may be the shorter one.
    const double spacing = 0.5 * std::sqrt((point.position - near.position).squaredNorm());
    scan.border.push_back(scan.surface.finish(point, spacing, hash(4, scan.next_vertex)));
    scan.out.add_vertex(scan.border.back());
    ++scan.next_vertex;
  };
  for (const auto& [p, corner] : complex.corners) {
    const Patch& patch = complex.patches[p];
    const std::uint32_t i = corner == 1 || corner == 2 ? patch.nu : 0;
    const std::uint32_t j = corner >= 2 ? patch.nv : 0;
    add(patch, i, j, i == 0 ? 1 : i - 1, j);
  }
  for (const PatchEdge& edge : complex.edges) {
    const Patch& patch = complex.patches[edge.patch];
    for (std::uint32_t k = 1; k < edge.segments; ++k) {
      const std::uint32_t along = edge.reversed ? edge.segments - k : k;
      if (edge.side % 2 == 0) {
        const std::uint32_t j = edge.side == 0 ? 0 : patch.nv;
        add(patch, along, j, along - 1, j);
      } else {
        const std::uint32_t i = edge.side == 3 ? 0 : patch.nu;
        add(patch, i, along, i, along - 1);
      }
    }
  }
}

// A few patches are open at a time and take turns, a band of rows each.
void write_patches(Scan& scan, std::uint64_t total, ProgressSink& progress) {
  std::vector<std::uint32_t> waiting(scan.complex.patches.size());
  for (std::uint32_t p = 0; p < waiting.size(); ++p) {
    waiting[p] = p;
    std::swap(waiting[p], waiting[hash(scan.seed, 41, p) % (p + 1)]);
  }
  std::vector<std::unique_ptr<PatchRun>> open;
  for (std::uint64_t turn = 0; !waiting.empty() || !open.empty(); ++turn) {
    while (open.size() < kOpenPatches && !waiting.empty()) {
      open.push_back(std::make_unique<PatchRun>(scan, waiting.back()));
      waiting.pop_back();
    }
    const std::size_t chosen = hash(scan.seed, 42, turn) % open.size();
    const std::uint64_t rows = 4 + hash(scan.seed, 43, turn) % 28;
    for (std::uint64_t r = 0; r < rows && !open[chosen]->done(); ++r) {
      open[chosen]->write_row();
    }
    if (open[chosen]->done()) {
      open.erase(open.begin() + static_cast<std::ptrdiff_t>(chosen));
    }
    progress.progress("synthesise", scan.triangles.count(), total);
  }
}

}  // namespace
}  // namespace synth

SynthResult synthesise(const SynthOptions& options, const std::string& path,
                       ProgressSink& progress) {
  using namespace synth;
  if (options.triangles < 12 || options.triangles > kMaxTriangles) {
    throw UsageError("A scan of " + std::to_string(options.triangles) +
                     " triangles cannot be made; ask for 12 to 8000000000.");
  }
  if (options.genus < 0 || options.genus > 100000 || options.holes < 0 ||
      !(options.noise >= 0.0 && options.noise <= 1.0)) {
    throw UsageError(
        "The genus must be 0 to 100000, the number of holes not negative and the noise 0 to 1 edge "
        "lengths.");
  }
  const PatchComplex complex = make_patches(options.genus, options.triangles);
  const Holes holes(complex, static_cast<std::uint64_t>(options.holes), hash(options.seed, 51));
  const std::uint64_t quads = complex.quads() - holes.missing_quads();
  const std::uint64_t wanted = options.triangles / 2 > quads ? options.triangles / 2 - quads : 0;
  const Centres centres(complex, holes, wanted, hash(options.seed, 52));

  std::uint64_t inner = 0;
  for (const Patch& patch : complex.patches) {
    inner += std::uint64_t{patch.nu - 1} * (patch.nv - 1);
  }
  const SynthResult result{
      complex.border_vertices + inner - holes.missing_vertices() + centres.count(),
      2 * (quads + centres.count())};

  PlyStream out(path, result.vertices, result.triangles,
                "Rattan synth seed " + std::to_string(options.seed) + " genus " +
                    std::to_string(options.genus) + " holes " + std::to_string(options.holes));
  TriangleShuffle triangles(out, hash(options.seed, 53));
  const Surface surface(complex, options);
  Scan scan{complex, holes, centres, surface, hash(options.seed, 54), {}, out, triangles, 0};
  scan.border.reserve(complex.border_vertices);
  write_border(scan);
  write_patches(scan, result.triangles, progress);
  triangles.flush();
  out.finish();
  return result;
}

}  // namespace rattan
