// SPDX-License-Identifier: MIT
#include "io/picture/thumbnail.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>
#include <png.h>

#include "engine/core/errors.h"
#include "io/picture/scene.h"

namespace rattan {
namespace {

constexpr int kSamples = 2;  // a pixel is kSamples * kSamples samples
constexpr double kMargin = 0.04;
constexpr std::size_t kChunk = 4096;

// The palette: a ramp from ink to light for each kind of surface, then the rims, which let the page
// shine through.
constexpr int kPlain = 0;
constexpr int kTinted = 1;
constexpr int kInside = 2;
constexpr int kKinds = 3;
constexpr std::array<int, kKinds> kLevels{128, 56, 40};
constexpr int kRimLevels = 10;
constexpr int kRims = kSamples * kSamples - 1;
constexpr int kFirstRim = 1 + 128 + 56 + 40;
constexpr int kColours = kFirstRim + kRims * kRimLevels;
static_assert(kColours <= 256);

constexpr std::array<float, 3> kInk{30.0F, 33.0F, 42.0F};
constexpr std::array<std::array<float, 3>, kKinds> kLight{
    {{250.0F, 246.0F, 238.0F}, {250.0F, 196.0F, 122.0F}, {196.0F, 160.0F, 146.0F}}};

struct Palette {
  std::array<png_byte, 4 * kColours> rgba{};
  std::array<int, kKinds> first{};

  Palette() {
    int at = 1;  // the first is transparent
    for (int kind = 0; kind < kKinds; ++kind) {
      const auto k = static_cast<std::size_t>(kind);
      first[k] = at;
      for (int level = 0; level < kLevels[k]; ++level) {
        set(at++, kind, static_cast<float>(level) / static_cast<float>(kLevels[k] - 1), 255);
      }
    }
    for (int rim = 1; rim <= kRims; ++rim) {
      for (int level = 0; level < kRimLevels; ++level) {
        set(at++, kPlain, static_cast<float>(level) / (kRimLevels - 1), 255 * rim / (kRims + 1));
      }
    }
  }

 private:
  void set(int at, int kind, float level, int alpha) {
    for (std::size_t c = 0; c < 3; ++c) {
      const float light = kLight[static_cast<std::size_t>(kind)][c];
      rgba[4 * static_cast<std::size_t>(at) + c] =
          static_cast<png_byte>(std::lround(kInk[c] + level * (light - kInk[c])));
    }
    rgba[4 * static_cast<std::size_t>(at) + 3] = static_cast<png_byte>(alpha);
  }
};

struct Sample {
  float nearness = 0.0F;  ///< 1 / depth; 0 where there is nothing
  std::uint8_t light = 0;
  std::uint8_t kind = kPlain;
};

/// Of a unit normal in camera space, 0 to 1, as the eye wants it (gamma applied).
float light_on(const Vec3f& n) {
  static const Vec3f kKey = Vec3f(-0.50F, 0.62F, -0.60F).normalized();
  static const Vec3f kFill = Vec3f(0.80F, 0.10F, -0.55F).normalized();
  const float sky = 0.16F + 0.12F * n.y();
  const float key = 0.66F * std::max(0.0F, n.dot(kKey));
  const float fill = 0.12F * std::max(0.0F, n.dot(kFill));
  const float facing = std::min(1.0F, 0.45F - 0.9F * n.z());  // rims are darker
  return std::sqrt(std::clamp((sky + key + fill) * facing, 0.0F, 1.0F));
}

/// A corner on the picture: samples right and down, and nearness.
struct Corner {
  float x, y, nearness, light;
};

class Canvas {
 public:
  Canvas(int width, int height)
      : width_(width),
        height_(height),
        samples_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {}

  /// `drawn`: bit k is set if the edge from corner k to the next is a line.
  void triangle(std::array<Corner, 3> c, unsigned drawn, std::uint8_t kind, float line_width,
                float line_strength) {
    float area = (c[1].x - c[0].x) * (c[2].y - c[0].y) - (c[2].x - c[0].x) * (c[1].y - c[0].y);
    if (area < 0.0F) {
      std::swap(c[1], c[2]);
      drawn = (drawn & 2U) | (drawn >> 2U & 1U) | (drawn & 1U) << 2U;
      area = -area;
    }
    if (!(area > 1e-9F)) {
      return;
    }
    const auto [x_low, x_high] = std::minmax({c[0].x, c[1].x, c[2].x});
    const auto [y_low, y_high] = std::minmax({c[0].y, c[1].y, c[2].y});
    const int x0 = std::max(0, static_cast<int>(std::ceil(x_low - 0.5F)));
    const int x1 = std::min(width_ - 1, static_cast<int>(std::floor(x_high - 0.5F)));
    const int y0 = std::max(0, static_cast<int>(std::ceil(y_low - 0.5F)));
    const int y1 = std::min(height_ - 1, static_cast<int>(std::floor(y_high - 0.5F)));
    if (x0 > x1 || y0 > y1) {
      return;
    }
    // Side k is opposite to corner k: inside[k] = a + x * dx + y * dy, 1 at the corner; the
    // distance to the side is inside[k] * tall[k].
    std::array<float, 3> dx{};
    std::array<float, 3> dy{};
    std::array<float, 3> row{};
    std::array<float, 3> tall{};
    for (std::size_t k = 0; k < 3; ++k) {
      const Corner& a = c[(k + 1) % 3];
      const Corner& b = c[(k + 2) % 3];
      dx[k] = (a.y - b.y) / area;
      dy[k] = (b.x - a.x) / area;
      row[k] = dx[k] * (static_cast<float>(x0) + 0.5F - a.x) +
               dy[k] * (static_cast<float>(y0) + 0.5F - a.y);
      const bool line = (drawn >> ((k + 1) % 3) & 1U) != 0;
      tall[k] =
          line ? area / std::hypot(a.x - b.x, a.y - b.y) : std::numeric_limits<float>::infinity();
    }
    for (int y = y0; y <= y1; ++y) {
      std::array<float, 3> in = row;
      Sample* sample = &samples_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                                 static_cast<std::size_t>(x0)];
      for (int x = x0; x <= x1; ++x, ++sample) {
        if (in[0] >= 0.0F && in[1] >= 0.0F && in[2] >= 0.0F) {
          const float nearness =
              in[0] * c[0].nearness + in[1] * c[1].nearness + in[2] * c[2].nearness;
          if (nearness > sample->nearness) {
            // An infinite height beside a zero would be no number: max takes it for none.
            float side = std::numeric_limits<float>::infinity();
            for (std::size_t k = 0; k < 3; ++k) {
              side = std::min(side, std::max(in[k], 1e-6F) * tall[k]);
            }
            const float cover = std::clamp(0.5F * line_width - side + 0.5F, 0.0F, 1.0F);
            const float light = in[0] * c[0].light + in[1] * c[1].light + in[2] * c[2].light;
            sample->nearness = nearness;
            sample->light =
                static_cast<std::uint8_t>(255.0F * light * (1.0F - line_strength * cover));
            sample->kind = kind;
          }
        }
        for (std::size_t k = 0; k < 3; ++k) {
          in[k] += dx[k];
        }
      }
      for (std::size_t k = 0; k < 3; ++k) {
        row[k] += dy[k];
      }
    }
  }

  /// One byte a pixel.
  std::vector<png_byte> indices(const Palette& palette) const {
    const int width = width_ / kSamples;
    const int height = height_ / kSamples;
    std::vector<png_byte> out;
    out.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        out.push_back(pixel(palette, x, y));
      }
    }
    return out;
  }

 private:
  png_byte pixel(const Palette& palette, int x, int y) const {
    int hits = 0;
    int light = 0;
    std::array<int, kKinds> kinds{};
    for (int j = 0; j < kSamples; ++j) {
      for (int i = 0; i < kSamples; ++i) {
        const Sample& s =
            samples_[static_cast<std::size_t>(kSamples * y + j) * static_cast<std::size_t>(width_) +
                     static_cast<std::size_t>(kSamples * x + i)];
        if (s.nearness > 0.0F) {
          ++hits;
          light += s.light;
          ++kinds[s.kind];
        }
      }
    }
    if (hits == 0) {
      return 0;
    }
    const float level = static_cast<float>(light) / (255.0F * static_cast<float>(hits));
    if (hits <= kRims) {
      return static_cast<png_byte>(kFirstRim + (hits - 1) * kRimLevels +
                                   std::lround(level * (kRimLevels - 1)));
    }
    const auto kind =
        static_cast<std::size_t>(std::max_element(kinds.begin(), kinds.end()) - kinds.begin());
    return static_cast<png_byte>(palette.first[kind] +
                                 std::lround(level * static_cast<float>(kLevels[kind] - 1)));
  }

  int width_, height_;
  std::vector<Sample> samples_;
};

Vec3f area_of(std::span<const Vec3f> p, std::span<const std::uint32_t> face) {
  Vec3f area = Vec3f::Zero();
  for (std::size_t i = 1; i + 1 < face.size(); ++i) {
    area += (p[face[i]] - p[face[0]]).cross(p[face[i + 1]] - p[face[0]]);
  }
  return area;
}

std::vector<Vec3f> vertex_normals(const PolygonMesh& mesh, std::span<const Vec3f> positions) {
  std::vector<Vec3f> normals(positions.size(), Vec3f::Zero());
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    const Vec3f area = area_of(positions, mesh.face(f));
    for (const std::uint32_t v : mesh.face(f)) {
      normals[v] += area;
    }
  }
  return normals;
}

/// Pixels that the mean edge takes where it faces the eye.
float edge_pixels(const PolygonMesh& mesh, std::span<const Vec3f> positions, const Camera& camera) {
  double length = 0.0;
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    const auto face = mesh.face(f);
    for (std::size_t i = 0; i < face.size(); ++i) {
      length += (positions[face[i]] - positions[face[(i + 1) % face.size()]]).norm();
    }
  }
  const auto mean = static_cast<float>(
      length / static_cast<double>(std::max<std::size_t>(mesh.corners.size(), 1)));
  const auto depth = static_cast<float>(2.6 * camera.diagonal());
  return camera.project({mean, 0.0F, depth}).x() - camera.project({0.0F, 0.0F, depth}).x();
}

/// Draws all faces.
class Painter {
 public:
  Painter(const PolygonMesh& mesh, const MeshSight& sight, const Camera& camera, Canvas& canvas)
      : mesh_(mesh),
        positions_(sight.positions),
        normals_(vertex_normals(mesh, sight.positions)),
        camera_(camera),
        canvas_(canvas) {
    std::size_t quads = 0;
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
      quads += mesh.degree(f) == 4 ? 1 : 0;
    }
    tint_ = 2 * quads >= mesh.face_count();
    const float edge = edge_pixels(mesh, sight.positions, camera);
    line_width_ = kSamples * std::clamp(0.1F * edge, 0.45F, 1.0F);
    line_strength_ = 0.8F * std::clamp((edge - 2.0F) / 5.0F, 0.0F, 1.0F);
  }

  void run() {
    for (std::size_t f = 0; f < mesh_.face_count(); ++f) {
      face(mesh_.face(f));
    }
  }

 private:
  void face(std::span<const std::uint32_t> face) {
    const std::size_t n = face.size();
    const Vec3f area = area_of(positions_, face);
    // Camera space is left-handed, but turning keeps a normal a normal.
    Vec3f flat = camera_.turn(area);
    const float size = flat.norm();
    if (!(size > 0.0F)) {
      return;
    }
    flat /= size;
    const bool inside = flat.dot(camera_.to_camera(positions_[face[0]])) > 0.0F;
    const std::uint8_t kind = inside ? kInside : tint_ && n != 4 ? kTinted : kPlain;
    corners_.clear();
    for (const std::uint32_t v : face) {
      Vec3f n_v = camera_.turn(normals_[v]);
      n_v /= std::max(n_v.norm(), std::numeric_limits<float>::min());
      // Across creases the mean of the neighbours' normals says little.
      const float agree = std::clamp((n_v.dot(flat) - 0.7F) / 0.2F, 0.0F, 1.0F);
      Vec3f lit = agree * n_v + (1.0F - agree) * flat;
      lit.normalize();
      const Vec3f at = camera_.project(camera_.to_camera(positions_[v]));
      corners_.push_back({kSamples * at.x(), kSamples * at.y(), 1.0F / at.z(),
                          light_on(inside ? Vec3f(-lit) : lit)});
    }
    const std::size_t apex = apex_of(face, area);
    for (std::size_t t = 0; t + 2 < n; ++t) {
      const unsigned drawn = (t == 0 ? 1U : 0U) | 2U | (t + 3 == n ? 4U : 0U);
      canvas_.triangle({corners_[apex], corners_[(apex + t + 1) % n], corners_[(apex + t + 2) % n]},
                       drawn, kind, line_width_, line_strength_);
    }
  }

  /// The corner whose fan folds the quad least.
  std::size_t apex_of(std::span<const std::uint32_t> face, const Vec3f& area) const {
    if (face.size() != 4) {
      return 0;
    }
    const auto p = [&](std::size_t i) -> const Vec3f& { return positions_[face[i % 4]]; };
    const auto worst = [&](std::size_t a) {
      return std::min((p(a + 1) - p(a)).cross(p(a + 2) - p(a)).dot(area),
                      (p(a + 2) - p(a)).cross(p(a + 3) - p(a)).dot(area));
    };
    return worst(1) > worst(0) ? 1 : 0;
  }

  const PolygonMesh& mesh_;
  std::span<const Vec3f> positions_;
  std::vector<Vec3f> normals_;
  const Camera& camera_;
  Canvas& canvas_;
  bool tint_ = false;
  float line_width_ = 1.0F;
  float line_strength_ = 0.0F;
  std::vector<Corner> corners_;
};

std::string encode(const Palette& palette, const std::vector<png_byte>& pixels, int width,
                   int height) {
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  header.width = static_cast<png_uint_32>(width);
  header.height = static_cast<png_uint_32>(height);
  header.format = PNG_FORMAT_RGBA_COLORMAP;
  header.flags = PNG_IMAGE_FLAG_FAST;
  header.colormap_entries = kColours;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(header);
  std::string bytes(size, '\0');
  if (png_image_write_to_memory(&header, bytes.data(), &size, 0, pixels.data(), 0,
                                palette.rgba.data()) == 0) {
    throw InternalError(std::string("libpng cannot encode the thumbnail: ") + header.message);
  }
  bytes.resize(size);
  return bytes;
}

}  // namespace

MeshSight::MeshSight(const PolygonMesh& mesh)
    : low(Vec3d::Constant(std::numeric_limits<double>::infinity())), high(-low) {
  for (const Vec3d& p : mesh.positions) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const Vec3d middle = 0.5 * (low + high);
  low -= middle;
  high -= middle;
  positions.reserve(mesh.vertex_count());
  for (const Vec3d& p : mesh.positions) {
    positions.push_back((p - middle).cast<float>());
  }
  UpAxisGuess up(low, high);
  std::vector<LocalTriangle> some;
  some.reserve(kChunk);
  const auto flush = [&] {
    up.add(positions, some);
    some.clear();
  };
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    const auto face = mesh.face(f);
    for (std::size_t i = 1; i + 1 < face.size(); ++i) {
      some.push_back({face[0], face[i], face[i + 1]});
    }
    if (some.size() + 64 > kChunk) {
      flush();
    }
  }
  flush();
  view = up.view();
}

std::size_t thumbnail_bytes(const PolygonMesh& mesh, const ThumbnailOptions& options) {
  const std::size_t pixels =
      static_cast<std::size_t>(options.width) * static_cast<std::size_t>(options.height);
  return pixels * (kSamples * kSamples * sizeof(Sample) + 4) +
         mesh.vertex_count() * 2 * sizeof(Vec3f) + (std::size_t{3} << 20);
}

std::string draw_thumbnail(const PolygonMesh& mesh, const ThumbnailOptions& options) {
  ensure(mesh.face_count() > 0 && options.width > 0 && options.height > 0,
         "a thumbnail shows something");
  static const Palette kPalette;
  const MeshSight sight(mesh);
  Camera camera(sight.low, sight.high, sight.view);
  camera.include(sight.positions);
  camera.fit(options.width, options.height, kMargin);
  Canvas canvas(kSamples * options.width, kSamples * options.height);
  Painter(mesh, sight, camera, canvas).run();
  return encode(kPalette, canvas.indices(kPalette), options.width, options.height);
}

}  // namespace rattan
