// SPDX-License-Identifier: MIT
#include "io/picture/image.h"

#include <algorithm>
#include <cmath>

#include <png.h>

#include "engine/core/errors.h"
#include "io/file/atomic_file.h"

namespace rattan {

Rgb mix(const Rgb& a, const Rgb& b, float t) {
  Rgb out;
  for (std::size_t k = 0; k < 3; ++k) {
    out[k] = static_cast<std::uint8_t>(
        std::lround(static_cast<float>(a[k]) * (1.0F - t) + static_cast<float>(b[k]) * t));
  }
  return out;
}

Image::Image(int width, int height, Rgb fill)
    : width_(width),
      height_(height),
      pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), fill) {}

void Image::blend(int x, int y, const Rgb& colour, float amount) {
  if (x < 0 || y < 0 || x >= width_ || y >= height_ || !(amount > 0.0F)) {
    return;
  }
  const float a = std::min(amount, 1.0F);
  Rgb& pixel = at(x, y);
  for (std::size_t k = 0; k < 3; ++k) {
    const float old = pixel[k];
    pixel[k] =
        static_cast<std::uint8_t>(std::lround(old + a * (static_cast<float>(colour[k]) - old)));
  }
}

void Image::paste(const Image& other, int x, int y) {
  const int first = std::max(0, -x);
  const int last = std::min(other.width_, width_ - x);
  for (int j = std::max(0, -y); j < std::min(other.height_, height_ - y) && first < last; ++j) {
    std::copy_n(&other.at(first, j), last - first, &at(x + first, y + j));
  }
}

void draw_stroke(Image& image, Point2 a, Point2 b, float width, const Rgb& colour, float opacity) {
  const float reach = 0.5F * width + 0.5F;
  const auto low = [&](float p, float q) {
    return static_cast<int>(std::floor(std::min(p, q) - reach));
  };
  const auto high = [&](float p, float q) {
    return static_cast<int>(std::ceil(std::max(p, q) + reach));
  };
  const float dx = b.x - a.x;
  const float dy = b.y - a.y;
  const float length2 = dx * dx + dy * dy;
  for (int y = low(a.y, b.y); y <= high(a.y, b.y); ++y) {
    for (int x = low(a.x, b.x); x <= high(a.x, b.x); ++x) {
      const float px = static_cast<float>(x) + 0.5F - a.x;
      const float py = static_cast<float>(y) + 0.5F - a.y;
      const float t = length2 > 0.0F ? std::clamp((px * dx + py * dy) / length2, 0.0F, 1.0F) : 0.0F;
      const float distance = std::hypot(px - t * dx, py - t * dy);
      image.blend(x, y, colour, opacity * std::clamp(reach - distance, 0.0F, 1.0F));
    }
  }
}

void draw_dot(Image& image, Point2 centre, float radius, const Rgb& colour, float ring,
              const Rgb& ring_colour) {
  draw_stroke(image, centre, centre, 2.0F * (radius + ring), ring_colour);
  draw_stroke(image, centre, centre, 2.0F * radius, colour);
}

void write_png(const Image& image, const std::string& path) {
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  header.width = static_cast<png_uint_32>(image.width());
  header.height = static_cast<png_uint_32>(image.height());
  header.format = PNG_FORMAT_RGB;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(header);
  std::string bytes(size, '\0');
  if (png_image_write_to_memory(&header, bytes.data(), &size, 0, image.data(), 0, nullptr) == 0) {
    throw InternalError(std::string("libpng cannot encode the picture: ") + header.message);
  }
  AtomicFile file(path);
  file.write(std::string_view(bytes).substr(0, size));
  file.commit();
}

Image read_png(const std::string& path) {
  const std::string bytes = read_file(path);
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_memory(&header, bytes.data(), bytes.size()) == 0) {
    throw InputError(path, "", std::string("it is no PNG picture (") + header.message + ")",
                     "Give a PNG file");
  }
  header.format = PNG_FORMAT_RGB;
  Image image(static_cast<int>(header.width), static_cast<int>(header.height));
  const png_color white{255, 255, 255};
  if (png_image_finish_read(&header, &white, image.data(), 0, nullptr) == 0) {
    throw InputError(path, "", std::string("the picture is damaged (") + header.message + ")",
                     "Give a whole PNG file");
  }
  return image;
}

}  // namespace rattan
