// SPDX-License-Identifier: MIT
#include "io/picture/render.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>

#include <Eigen/Geometry>

#include "engine/core/errors.h"
#include "engine/core/parallel.h"
#include "io/picture/albedo.h"
#include "io/picture/field_lines.h"
#include "io/picture/samples.h"
#include "io/picture/surface_lines.h"

namespace rattan {
namespace {

using Vec2f = Eigen::Vector2f;

constexpr std::size_t kRows = 4;
constexpr Rgb kFieldColour{24, 66, 128};

float smooth_step(float low, float high, float x) {
  const float t = std::clamp((x - low) / (high - low), 0.0F, 1.0F);
  return t * t * (3.0F - 2.0F * t);
}

/// Area-weighted vertex normals of a part (world space), where it brings none.
std::vector<Vec3f> vertex_normals(const SceneMesh& mesh) {
  std::vector<Vec3f> normals(mesh.positions.size(), Vec3f::Zero());
  for (const LocalTriangle& t : mesh.triangles) {
    const Vec3f& p = mesh.positions[t[0]];
    const Vec3f n = (mesh.positions[t[1]] - p).cross(mesh.positions[t[2]] - p);
    for (const std::uint32_t v : t) {
      normals[v] += n;
    }
  }
  for (Vec3f& n : normals) {
    n.normalize();
  }
  return normals;
}

/// Of two neighbouring directions of a cross field, `b` as whichever quarter turn is nearest to
/// `a`.
Vec3f nearest_turn(const Vec3f& a, const Vec3f& b, const Vec3f& normal) {
  const Vec3f turned = normal.cross(b);
  const float straight = a.dot(b);
  const float across = a.dot(turned);
  if (std::abs(straight) >= std::abs(across)) {
    return straight < 0.0F ? Vec3f(-b) : b;
  }
  return across < 0.0F ? Vec3f(-turned) : turned;
}

/// Takes one part's hits into the grid, if they are the nearest so far. Of an overlay only the
/// colours, for `depth` are then the overlay's own: else null.
class Sampler {
 public:
  Sampler(const SceneMesh& mesh, const PartScene& part, const Camera& camera,
          std::span<const Look> looks, const RenderOptions& options, SampleGrid& grid,
          std::vector<float>* depth = nullptr)
      : mesh_(mesh),
        part_(part),
        camera_(camera),
        looks_(looks),
        options_(options),
        grid_(grid),
        depth_(depth == nullptr ? grid.depth : *depth),
        is_overlay_(depth != nullptr),
        albedo_(mesh, part.positions(), camera, options),
        scale_(static_cast<float>(options.samples)) {
    if (mesh.corner_normals.empty() && !is_overlay_) {
      if (mesh.normals.empty()) {
        own_normals_ = vertex_normals(mesh);
      }
      normals_ = mesh.normals.empty() ? std::span<const Vec3f>(own_normals_) : mesh.normals;
    }
  }

  void run() {
    if (part_.positions().empty()) {
      return;
    }
    // Only rays through the part's box.
    Vec2f low(1e30F, 1e30F);
    Vec2f high = -low;
    for (int c = 0; c < 8; ++c) {
      const Vec3f corner((c & 1) != 0 ? part_.high().x() : part_.low().x(),
                         (c & 2) != 0 ? part_.high().y() : part_.low().y(),
                         (c & 4) != 0 ? part_.high().z() : part_.low().z());
      if (!(corner.z() > 0.0F)) {
        continue;
      }
      const Vec2f at = camera_.project(corner).head<2>();
      low = low.cwiseMin(at);
      high = high.cwiseMax(at);
    }
    const auto clip = [&](float v, int most) {
      return std::clamp(static_cast<int>(v * scale_), 0, most);
    };
    const int x0 = clip(low.x() - 1.0F, options_.width * options_.samples);
    const int x1 = clip(high.x() + 2.0F, options_.width * options_.samples);
    const int y0 = clip(low.y() - 1.0F, options_.height * options_.samples);
    const int y1 = clip(high.y() + 2.0F, options_.height * options_.samples);
    if (y1 <= y0) {
      return;
    }
    parallel_indices(
        static_cast<std::size_t>(y1 - y0),
        [&](std::size_t row) {
          const int y = y0 + static_cast<int>(row);
          for (int x = x0; x < x1; ++x) {
            sample(x, y);
          }
        },
        kRows);
  }

 private:
  void sample(int x, int y) {
    const float px = (static_cast<float>(x) + 0.5F) / scale_;
    const float py = (static_cast<float>(y) + 0.5F) / scale_;
    const Vec3f ray = camera_.ray(px, py);
    const std::size_t at =
        static_cast<std::size_t>(y) * grid_.fine_width() + static_cast<std::size_t>(x);
    PartScene::Hit hit{};
    if (!part_.intersect(ray, depth_[at], hit)) {
      return;
    }
    depth_[at] = hit.depth;
    const LocalTriangle& t = mesh_.triangles[hit.triangle];
    const std::array<float, 3> w{1.0F - hit.u - hit.v, hit.u, hit.v};
    const std::array<Vec3f, 3> p{part_.positions()[t[0]], part_.positions()[t[1]],
                                 part_.positions()[t[2]]};
    // Camera space is left-handed: turn the cross product round.
    Vec3f flat = -(p[1] - p[0]).cross(p[2] - p[0]);
    flat.normalize();
    const bool inside = flat.dot(ray) > 0.0F;
    for (std::size_t l = 0; l < looks_.size(); ++l) {
      grid_.colours[at * looks_.size() + l] = albedo_.at(looks_[l], hit, Vec2f(px, py), inside);
    }
    if (is_overlay_) {
      return;
    }
    if (!grid_.inside.empty()) {
      grid_.inside[at] = inside ? 1 : 0;
    }
    Vec3f n = Vec3f::Zero();
    for (std::size_t k = 0; k < 3; ++k) {
      n += w[k] * (mesh_.corner_normals.empty()
                       ? normals_[t[k]]
                       : mesh_.corner_normals[3 * std::size_t{hit.triangle} + k]);
    }
    const Vec3f world_normal = n.normalized();
    n = camera_.turn(world_normal);
    // Across creases the mean of the neighbours' normals says little.
    const float agree = n.dot(flat);
    n = agree > 0.0F || !n.allFinite() ? n : Vec3f(-n);
    n = (n * smooth_step(0.65F, 0.92F, std::abs(agree)) +
         flat * (1.0F - smooth_step(0.65F, 0.92F, std::abs(agree))));
    if (inside) {
      n = -n;
    }
    if (!n.allFinite() || n.isZero(0.0F)) {
      n = -ray;
    }
    n.normalize();
    for (std::size_t k = 0; k < 3; ++k) {
      grid_.normals[at][k] =
          static_cast<std::int16_t>(std::lround(n[static_cast<int>(k)] * 32767.0F));
    }
    const int s = options_.samples;
    if (x % s == s / 2 && y % s == s / 2) {
      const std::size_t pixel =
          static_cast<std::size_t>(y / s) * static_cast<std::size_t>(grid_.width) +
          static_cast<std::size_t>(x / s);
      const auto note = [&](std::span<const Vec3f> from, std::vector<Vec3f>& to) {
        if (!to.empty()) {
          to[pixel] = from.empty() || inside ? Vec3f::Zero() : direction(from, t, w, world_normal);
        }
      };
      note(mesh_.directions, grid_.directions);
      note(mesh_.raw_directions, grid_.raw_directions);
    }
  }

  /// Of the field at a point of a triangle, camera space; zero where there is none.
  Vec3f direction(std::span<const Vec3f> field, const LocalTriangle& t,
                  const std::array<float, 3>& w, const Vec3f& normal) const {
    const Vec3f& first = field[t[0]];
    Vec3f mean = Vec3f::Zero();
    for (std::size_t k = 0; k < 3; ++k) {
      mean += w[k] * nearest_turn(first, field[t[k]], normal);
    }
    mean -= normal * normal.dot(mean);
    return mean.norm() > 0.0F ? camera_.turn(mean.normalized()) : Vec3f::Zero();
  }

  const SceneMesh& mesh_;
  const PartScene& part_;
  const Camera& camera_;
  std::span<const Look> looks_;
  const RenderOptions& options_;
  SampleGrid& grid_;
  std::vector<float>& depth_;
  const bool is_overlay_;
  const Albedo albedo_;
  float scale_;
  std::vector<Vec3f> own_normals_;
  std::span<const Vec3f> normals_;
};

struct Tone {
  std::array<float, 256> linear;
  std::array<std::uint8_t, 4096> srgb;
  Tone() {
    for (std::size_t i = 0; i < linear.size(); ++i) {
      const float c = static_cast<float>(i) / 255.0F;
      linear[i] = c <= 0.04045F ? c / 12.92F : std::pow((c + 0.055F) / 1.055F, 2.4F);
    }
    for (std::size_t i = 0; i < srgb.size(); ++i) {
      const float c = static_cast<float>(i) / 4095.0F;
      const float s = c <= 0.0031308F ? 12.92F * c : 1.055F * std::pow(c, 1.0F / 2.4F) - 0.055F;
      srgb[i] = static_cast<std::uint8_t>(std::lround(255.0F * s));
    }
  }
  std::uint8_t encode(float c) const {
    return srgb[static_cast<std::size_t>(std::lround(std::clamp(c, 0.0F, 1.0F) * 4095.0F))];
  }
};

/// Light that a surface of albedo 1 sends to the eye: sky and ground, a key light from the upper
/// left with a soft shadow, a faint fill from the right; `gloss` is added whatever the albedo.
struct Shade {
  Vec3f diffuse;
  float gloss;
};

Shade shade(const Vec3f& n, const Vec3f& view, const Occlusion::Light& light) {
  const Vec3f key = key_light();
  const Vec3f fill = Vec3f(0.80F, 0.10F, -0.55F).normalized();
  const float open = light.ambient * (0.35F + 0.65F * light.ambient);
  const float up = 0.5F + 0.5F * n.y();
  const Vec3f ambient =
      open * (Vec3f(0.30F, 0.287F, 0.273F) * (1.0F - up) + Vec3f(0.42F, 0.43F, 0.45F) * up);
  const float lit = std::max(0.0F, n.dot(key)) * (0.15F + 0.85F * light.key);
  const float filled = std::max(0.0F, n.dot(fill)) * (0.4F + 0.6F * light.ambient);
  const Vec3f half = (key - view).normalized();
  Shade out;
  out.diffuse = ambient + lit * Vec3f(0.74F, 0.728F, 0.704F) + filled * Vec3f(0.15F, 0.16F, 0.18F);
  out.gloss = 0.05F * light.key * std::pow(std::max(0.0F, n.dot(half)), 28.0F);
  return out;
}

/// Samples to pixels, all looks at once. `lines`: of each look, opacity of the field's lines; empty
/// where it has none.
std::vector<Image> resolve(const SampleGrid& grid, const Occlusion& occlusion, const Camera& camera,
                           std::span<const Look> looks,
                           const std::vector<std::vector<float>>& lines,
                           const RenderOptions& options) {
  static const Tone kTone;
  std::vector<Image> images(looks.size(), Image(options.width, options.height, options.background));
  const auto s = static_cast<std::size_t>(grid.samples);
  Vec3f background;
  for (int k = 0; k < 3; ++k) {
    background[k] = kTone.linear[options.background[static_cast<std::size_t>(k)]];
  }
  const auto pixel = [&](std::size_t x, std::size_t y, std::vector<Vec3f>& sums) {
    std::fill(sums.begin(), sums.end(), Vec3f::Zero());
    const Vec3f view =
        camera.ray(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F).normalized();
    const std::size_t at_pixel = y * static_cast<std::size_t>(options.width) + x;
    // Light is looked up again only for samples on another piece of surface than the one before.
    float depth = 0.0F;
    Vec3f normal = Vec3f::Zero();
    Occlusion::Light light;
    bool hit = false;
    for (std::size_t i = 0; i < s * s; ++i) {
      const std::size_t at = (y * s + i / s) * grid.fine_width() + x * s + i % s;
      if (!std::isfinite(grid.depth[at])) {
        for (Vec3f& sum : sums) {
          sum += background;
        }
        continue;
      }
      const Vec3f n = grid.normal(at);
      if (!hit || n.dot(normal) < 0.97F || std::abs(grid.depth[at] - depth) > occlusion.nearby()) {
        light = occlusion.at(grid, at, static_cast<int>(x), static_cast<int>(y));
        depth = grid.depth[at];
        normal = n;
      }
      hit = true;
      const Shade shaded = shade(n, view, light);
      for (std::size_t l = 0; l < looks.size(); ++l) {
        Rgb albedo = grid.colours[at * looks.size() + l];
        if (!lines[l].empty()) {
          albedo = mix(albedo, kFieldColour, 0.82F * lines[l][at_pixel]);
        }
        for (int k = 0; k < 3; ++k) {
          sums[l][k] +=
              std::min(1.0F, kTone.linear[albedo[static_cast<std::size_t>(k)]] * shaded.diffuse[k] +
                                 shaded.gloss);
        }
      }
    }
    for (std::size_t l = 0; hit && l < looks.size(); ++l) {
      const Vec3f mean = sums[l] / static_cast<float>(s * s);
      images[l].at(static_cast<int>(x), static_cast<int>(y)) = {
          kTone.encode(mean[0]), kTone.encode(mean[1]), kTone.encode(mean[2])};
    }
  };
  parallel_chunks(
      static_cast<std::size_t>(options.height),
      [&](std::size_t begin, std::size_t end) {
        std::vector<Vec3f> sums(looks.size());
        for (std::size_t y = begin; y < end; ++y) {
          for (std::size_t x = 0; x < static_cast<std::size_t>(options.width); ++x) {
            pixel(x, y, sums);
          }
        }
      },
      kRows);
  return images;
}

void draw_dots(Image& image, Look look, const SampleGrid& grid, const Camera& camera,
               std::span<const Dot> dots) {
  const auto slack = static_cast<float>(4e-3 * camera.diagonal());
  for (const Dot& dot : dots) {
    if (look == Look::kField && !dot.of_field) {
      continue;
    }
    const Vec3f at = camera.project(camera.to_camera(dot.position));
    const int x = static_cast<int>(std::floor(at.x()));
    const int y = static_cast<int>(std::floor(at.y()));
    if (x < 0 || y < 0 || x >= grid.width || y >= grid.height ||
        !(at.z() <= grid.depth[grid.middle(x, y)] + slack)) {
      continue;
    }
    draw_dot(image, {at.x(), at.y()}, dot.radius, dot.colour, dot.radius < 2.5F ? 0.0F : 1.0F,
             {250, 250, 250});
  }
}

}  // namespace

std::size_t render_bytes(const RenderOptions& options, std::size_t looks) {
  const std::size_t pixels =
      static_cast<std::size_t>(options.width) * static_cast<std::size_t>(options.height);
  const auto samples =
      static_cast<std::size_t>(options.samples) * static_cast<std::size_t>(options.samples);
  // Samples; occlusion; the field's directions, crosses, depths and lines; images.
  return pixels * (samples * (sizeof(float) + 3 * sizeof(std::int16_t) + 3 * looks) +
                   (2 * sizeof(Vec3f) + sizeof(std::uint32_t)) +
                   (2 * sizeof(Vec3f) + 5 * sizeof(Vec2f)) + 3 * looks);
}

namespace {

/// Lines of a surface's parts, on those pictures that show some.
void draw_lines(const SurfaceSource& surface, const Camera& camera, std::span<const Look> looks,
                const RenderOptions& options, SampleGrid& grid) {
  std::vector<std::pair<std::size_t, LineLayer>> layers;
  for (std::size_t l = 0; l < looks.size(); ++l) {
    const LineStyles styles = line_styles(looks[l], options.line_width);
    if (std::any_of(styles.begin(), styles.end(),
                    [](const LineStyle& s) { return s.width > 0.0F; })) {
      layers.emplace_back(l, LineLayer(grid, camera, styles));
    }
  }
  if (layers.empty()) {
    return;
  }
  surface([&](const SceneMesh& mesh) {
    for (auto& [look, layer] : layers) {
      layer.add(mesh.lines);
    }
  });
  for (const auto& [look, layer] : layers) {
    layer.apply(grid, look);
  }
}

}  // namespace

std::vector<Image> render(const SurfaceSource& surface, const Camera& camera,
                          std::span<const Look> looks, std::span<const Dot> dots,
                          const RenderOptions& options, const Overlay& overlay) {
  ensure(options.width > 0 && options.height > 0 && options.samples > 0 && !looks.empty(),
         "a picture has pixels");
  const auto wanted = [&](Look look) {
    return std::find(looks.begin(), looks.end(), look) != looks.end();
  };
  const RayDevice device;
  SampleGrid grid(options.width, options.height, options.samples, static_cast<int>(looks.size()),
                  wanted(Look::kField), wanted(Look::kRawField));
  if (!overlay.looks.empty() || wanted(Look::kCharts) || wanted(Look::kTexture)) {
    grid.inside.assign(grid.depth.size(), 0);
  }
  std::vector<std::unique_ptr<PartScene>> kept;
  std::size_t triangles = 0;
  bool all_kept = true;
  surface([&](const SceneMesh& mesh) {
    auto part = std::make_unique<PartScene>(device.get(), mesh, camera);
    Sampler(mesh, *part, camera, looks, options, grid).run();
    triangles += mesh.triangles.size();
    all_kept = all_kept && triangles <= options.resident_triangles;
    if (all_kept) {
      kept.push_back(std::move(part));
    } else {
      kept.clear();
    }
  });
  draw_lines(surface, camera, looks, options, grid);
  Occlusion occlusion(grid, camera, static_cast<float>(0.16 * camera.diagonal()));
  if (all_kept) {
    for (const auto& part : kept) {
      occlusion.add(*part);
    }
    kept.clear();
  } else {
    surface([&](const SceneMesh& mesh) { occlusion.add(PartScene(device.get(), mesh, camera)); });
  }
  std::vector<std::vector<float>> lines(looks.size());
  for (std::size_t l = 0; l < looks.size(); ++l) {
    if (looks[l] == Look::kField || looks[l] == Look::kRawField) {
      lines[l] =
          trace_field_lines(grid, looks[l] == Look::kField ? grid.directions : grid.raw_directions,
                            camera, options.field_spacing, options.line_width);
    }
  }
  std::vector<Image> images = resolve(grid, occlusion, camera, looks, lines, options);
  for (std::size_t l = 0; l < looks.size(); ++l) {
    if (looks[l] != Look::kPlain && looks[l] != Look::kRawField) {
      draw_dots(images[l], looks[l], grid, camera, dots);
    }
  }
  if (overlay.looks.empty()) {
    return images;
  }
  // The same surface cut otherwise: depths, normals and light are there already.
  lines.assign(overlay.looks.size(), {});
  grid.directions = {};
  grid.raw_directions = {};
  grid.looks = static_cast<int>(overlay.looks.size());
  grid.colours.assign(grid.depth.size() * overlay.looks.size(), options.surface);
  grid.colours.shrink_to_fit();
  {
    std::vector<float> depth(grid.depth.size(), std::numeric_limits<float>::infinity());
    overlay.surface([&](const SceneMesh& mesh) {
      const PartScene part(device.get(), mesh, camera);
      Sampler(mesh, part, camera, overlay.looks, options, grid, &depth).run();
    });
  }
  draw_lines(overlay.surface, camera, overlay.looks, options, grid);
  for (Image& image : resolve(grid, occlusion, camera, overlay.looks, lines, options)) {
    images.push_back(std::move(image));
  }
  return images;
}

}  // namespace rattan
