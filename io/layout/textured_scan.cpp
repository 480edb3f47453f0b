// SPDX-License-Identifier: MIT
#include "io/layout/textured_scan.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <system_error>
#include <utility>

#include "engine/core/errors.h"
#include "engine/mesh/curve.h"
#include "engine/mesh/radix_sort.h"
#include "io/layout/texture_picture.h"
#include "io/layout/textured_faces.h"

namespace rattan {
namespace {

constexpr std::uint32_t kBare = std::numeric_limits<std::uint32_t>::max();
/// Distance up to which a point belongs to a triangle, in parts of the scan's diagonal: many times
/// the rounding of single precision, far below the size of a pixel.
constexpr double kTouching = 1e-6;

constexpr std::uint64_t kVertexBytes = sizeof(Vec3f);
constexpr std::uint64_t kTextureVertexBytes = sizeof(std::array<float, 2>);

struct SortKey {
  std::uint64_t place;
  std::uint32_t triangle;
};
/// Corners, texture corners, material; then the sort with its second buffer and one list renewed,
/// or later the index, which takes less.
constexpr std::uint64_t kTriangleBytes =
    3 * sizeof(LocalTriangle) + sizeof(std::uint32_t) + 2 * sizeof(SortKey);

bool is_textured(const std::array<std::uint64_t, 3>& texture) {
  return std::find(texture.begin(), texture.end(), kNoTexture) == texture.end();
}

class Counter : public TexturedFaceSink {
 public:
  void add_vertex(const Vec3d&) override { ++outline.vertices; }
  void add_texture_vertex(double, double) override { ++outline.texture_vertices; }
  void add_triangle(const std::array<std::uint64_t, 3>&,
                    const std::array<std::uint64_t, 3>& texture, std::uint32_t material) override {
    ++outline.triangles;
    if (material != kNoMaterial && is_textured(texture)) {
      if (textured.size() <= material) {
        textured.resize(std::size_t{material} + 1, 0);
      }
      ++textured[material];
    }
  }
  TextureOutline outline;
  std::vector<std::uint64_t> textured;  // by material
};

float sensible(double t) {
  return std::abs(t) < 1e6 ? static_cast<float>(t) : 0.0F;
}

/// The pixel's number along one axis; `at` may be one beyond either end.
int wrapped(double at, int size, bool clamped) {
  const int i = static_cast<int>(at);
  if (clamped) {
    return std::clamp(i, 0, size - 1);
  }
  const int rest = i % size;
  return rest < 0 ? rest + size : rest;
}

}  // namespace

TextureOutline outline_textures(const std::string& scan) {
  Counter counter;
  const std::vector<Material> materials = read_textured_faces(scan, counter);
  TextureOutline outline = counter.outline;
  std::map<std::string, PictureSize> pictures;
  std::uint64_t largest_file = 0;
  for (const Material& m : materials) {
    for (const std::string& file : {m.file, m.picture}) {
      if (!file.empty()) {
        outline.files.push_back(file);
      }
    }
  }
  for (std::size_t m = 0; m < counter.textured.size(); ++m) {
    const std::string& picture = materials[m].picture;
    if (picture.empty() || counter.textured[m] == 0) {
      continue;
    }
    outline.textured += counter.textured[m];
    const auto [at, is_new] = pictures.try_emplace(picture);
    if (is_new) {
      at->second = picture_size(picture);
      outline.pixels += std::uint64_t{at->second.width} * at->second.height;
      std::error_code unknown;
      const std::uintmax_t bytes = std::filesystem::file_size(picture, unknown);
      largest_file = unknown ? largest_file : std::max<std::uint64_t>(largest_file, bytes);
    }
  }
  if (outline.textured > 0) {
    outline.bytes =
        outline.vertices * kVertexBytes + outline.texture_vertices * kTextureVertexBytes +
        outline.triangles * kTriangleBytes + outline.pixels * sizeof(Rgb) + largest_file;
  }
  return outline;
}

class TexturedScan::Loader : public TexturedFaceSink {
 public:
  Loader(TexturedScan& to, const Vec3d& origin, double unit)
      : to_(to), origin_(origin), unit_(unit) {}

  void add_vertex(const Vec3d& position) override {
    to_.positions_.push_back(((position - origin_) / unit_).cast<float>());
  }
  void add_texture_vertex(double u, double v) override {
    to_.texture_.push_back({sensible(u), sensible(v)});
  }
  void add_triangle(const std::array<std::uint64_t, 3>& vertex,
                    const std::array<std::uint64_t, 3>& texture, std::uint32_t material) override {
    const bool textured = is_textured(texture);
    LocalTriangle v;
    LocalTriangle t;
    for (std::size_t k = 0; k < 3; ++k) {
      highest_vertex_ = std::max(highest_vertex_, vertex[k]);
      v[k] = static_cast<std::uint32_t>(vertex[k]);
      t[k] = textured ? static_cast<std::uint32_t>(texture[k]) : kBare;
      highest_texture_ = textured ? std::max(highest_texture_, texture[k]) : highest_texture_;
    }
    to_.triangles_.push_back(v);
    to_.texture_corners_.push_back(t);
    to_.material_of_.push_back(material);
    has_texture_ = has_texture_ || textured;
  }
  /// Indices in range; triangles with corners that are no numbers dropped.
  void finish() {
    const auto check = [&](std::uint64_t highest, std::size_t count, const char* what) {
      if (highest >= count || count >= kBare) {
        throw InputError(to_.scan_, "",
                         std::string("a face refers to ") + what + " " +
                             std::to_string(highest + 1) + " of " + std::to_string(count),
                         "Export the scan again");
      }
    };
    if (!to_.triangles_.empty()) {
      check(highest_vertex_, to_.positions_.size(), "vertex");
    }
    if (has_texture_) {
      check(highest_texture_, to_.texture_.size(), "texture vertex");
    }
    std::size_t kept = 0;
    for (std::size_t t = 0; t < to_.triangles_.size(); ++t) {
      const LocalTriangle& corners = to_.triangles_[t];
      if (std::all_of(corners.begin(), corners.end(),
                      [&](std::uint32_t v) { return to_.positions_[v].allFinite(); })) {
        to_.triangles_[kept] = corners;
        to_.texture_corners_[kept] = to_.texture_corners_[t];
        to_.material_of_[kept] = to_.material_of_[t];
        ++kept;
      }
    }
    to_.triangles_.resize(kept);
    to_.texture_corners_.resize(kept);
    to_.material_of_.resize(kept);
  }

 private:
  TexturedScan& to_;
  const Vec3d origin_;
  const double unit_;
  std::uint64_t highest_vertex_ = 0;
  std::uint64_t highest_texture_ = 0;
  bool has_texture_ = false;
};

TexturedScan::TexturedScan(const std::string& scan, const TextureOutline& outline,
                           const Vec3d& origin, double unit)
    : scan_(scan) {
  positions_.reserve(outline.vertices);
  texture_.reserve(outline.texture_vertices);
  triangles_.reserve(outline.triangles);
  texture_corners_.reserve(outline.triangles);
  material_of_.reserve(outline.triangles);
  Loader loader(*this, origin, unit);
  materials_ = read_textured_faces(scan, loader);
  loader.finish();
  sort_triangles();
  index_ = std::make_unique<TriangleIndex>(positions_, triangles_);
  if (!triangles_.empty()) {
    const double diagonal = (index_->box_max() - index_->box_min()).cast<double>().norm();
    tolerance2_ = kTouching * kTouching * diagonal * diagonal;
  }
  load_pictures();
}

void TexturedScan::sort_triangles() {
  Vec3d lo = Vec3d::Constant(std::numeric_limits<double>::max());
  Vec3d hi = -lo;
  for (const LocalTriangle& t : triangles_) {
    for (const std::uint32_t v : t) {
      lo = lo.cwiseMin(positions_[v].cast<double>());
      hi = hi.cwiseMax(positions_[v].cast<double>());
    }
  }
  const HilbertCurve curve(lo, hi);
  std::vector<SortKey> keys(triangles_.size());
  std::vector<SortKey> scratch(triangles_.size());
  parallel_indices(triangles_.size(), [&](std::size_t i) {
    const LocalTriangle& t = triangles_[i];
    const Vec3d sum = positions_[t[0]].cast<double>() + positions_[t[1]].cast<double>() +
                      positions_[t[2]].cast<double>();
    keys[i] = {curve(sum / 3.0), static_cast<std::uint32_t>(i)};
  });
  radix_sort(keys, scratch, [](const SortKey& k) { return k.place; });
  const auto reorder = [&](auto& list) {
    auto sorted = list;
    parallel_indices(list.size(), [&](std::size_t i) { sorted[i] = list[keys[i].triangle]; });
    list.swap(sorted);
  };
  reorder(triangles_);
  reorder(texture_corners_);
  reorder(material_of_);
}

void TexturedScan::load_pictures() {
  std::vector<std::uint8_t> used(materials_.size(), 0);
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    if (material_of_[t] != kNoMaterial && texture_corners_[t][0] != kBare) {
      used[material_of_[t]] = 1;
    }
  }
  std::map<std::string, std::uint32_t> number;
  picture_of_.assign(materials_.size(), kBare);
  for (std::size_t m = 0; m < materials_.size(); ++m) {
    if (used[m] == 0 || materials_[m].picture.empty()) {
      continue;
    }
    const auto [at, is_new] =
        number.try_emplace(materials_[m].picture, static_cast<std::uint32_t>(pictures_.size()));
    if (is_new) {
      pictures_.push_back(read_picture(materials_[m].picture));
    }
    picture_of_[m] = at->second;
  }
}

std::uint32_t TexturedScan::nearest(const Vec3d& p, std::uint32_t hint) const {
  ClosestHit hit;
  index_->try_triangle(p, hint, hit);
  index_->closest(p, hit);
  return static_cast<std::uint32_t>(hit.triangle);
}

bool TexturedScan::holds(std::uint32_t triangle, const Vec3d& p) const {
  return index_->evaluate(p, triangle).distance2 <= tolerance2_;
}

Vec2d TexturedScan::texture(std::uint32_t triangle, const Vec3d& p) const {
  const LocalTriangle& corners = texture_corners_[triangle];
  if (corners[0] == kBare) {
    return Vec2d::Zero();
  }
  const ClosestOnTriangle at = index_->evaluate(p, triangle);
  Vec2d uv = Vec2d::Zero();
  for (std::size_t k = 0; k < 3; ++k) {
    const auto& t = texture_[corners[k]];
    uv += at.weights[k] * Vec2d(t[0], t[1]);
  }
  return uv;
}

std::array<double, 3> TexturedScan::colour(std::uint32_t triangle, const Vec2d& texture) const {
  const std::uint32_t m = material_of_[triangle];
  if (m == kNoMaterial) {
    return {255.0, 255.0, 255.0};
  }
  const Material& material = materials_[m];
  if (picture_of_[m] == kBare || texture_corners_[triangle][0] == kBare) {
    const Rgb& c = material.colour;
    return {static_cast<double>(c[0]), static_cast<double>(c[1]), static_cast<double>(c[2])};
  }
  Vec2d uv = texture.cwiseProduct(material.scale) + material.offset;
  for (double& t : uv) {
    t = material.clamped ? std::clamp(t, 0.0, 1.0) : t - std::floor(t);
  }
  const Image& picture = pictures_[picture_of_[m]];
  // Rows come from the top, texture coordinates from below.
  const double x = uv.x() * picture.width() - 0.5;
  const double y = (1.0 - uv.y()) * picture.height() - 0.5;
  const double x0 = std::floor(x);
  const double y0 = std::floor(y);
  const int left = wrapped(x0, picture.width(), material.clamped);
  const int right = wrapped(x0 + 1.0, picture.width(), material.clamped);
  const int upper = wrapped(y0, picture.height(), material.clamped);
  const int lower = wrapped(y0 + 1.0, picture.height(), material.clamped);
  std::array<double, 3> colour{};
  const auto add = [&](int column, int row, double weight) {
    const Rgb& pixel = picture.at(column, row);
    for (std::size_t k = 0; k < 3; ++k) {
      colour[k] += weight * pixel[k];
    }
  };
  add(left, upper, (x0 + 1.0 - x) * (y0 + 1.0 - y));
  add(right, upper, (x - x0) * (y0 + 1.0 - y));
  add(left, lower, (x0 + 1.0 - x) * (y - y0));
  add(right, lower, (x - x0) * (y - y0));
  return colour;
}

}  // namespace rattan
