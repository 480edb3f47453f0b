// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace rattan {

/// sRGB, 0 to 255 a channel.
using Rgb = std::array<std::uint8_t, 3>;

/// Between a (t = 0) and b (t = 1).
Rgb mix(const Rgb& a, const Rgb& b, float t);

/// Rows from the top, pixels from the left; 3 bytes a pixel.
class Image {
 public:
  Image() = default;
  Image(int width, int height, Rgb fill = {255, 255, 255});

  int width() const { return width_; }
  int height() const { return height_; }
  Rgb& at(int x, int y) { return pixels_[index(x, y)]; }
  const Rgb& at(int x, int y) const { return pixels_[index(x, y)]; }

  /// Mixes `colour` in; 0 leaves the pixel, 1 replaces it. Outside the image nothing happens.
  void blend(int x, int y, const Rgb& colour, float amount);
  /// Copies `other` with its top left corner at (x, y); parts outside are cut off.
  void paste(const Image& other, int x, int y);

  const Rgb* data() const { return pixels_.data(); }
  Rgb* data() { return pixels_.data(); }

 private:
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(x);
  }
  int width_ = 0;
  int height_ = 0;
  std::vector<Rgb> pixels_;
};

/// Coordinates of the strokes below are pixels, the centre of the top left one at (0.5, 0.5).
struct Point2 {
  float x = 0.0F;
  float y = 0.0F;
};

/// An anti-aliased line with round ends.
void draw_stroke(Image& image, Point2 a, Point2 b, float width, const Rgb& colour,
                 float opacity = 1.0F);
/// An anti-aliased disc with a ring around it.
void draw_dot(Image& image, Point2 centre, float radius, const Rgb& colour, float ring,
              const Rgb& ring_colour);

/// Printable ASCII in a built-in stroke font, `height` pixels from baseline to the top of capitals;
/// (x, y) is the left end of the baseline. Other bytes show as an empty box.
void draw_text(Image& image, std::string_view text, Point2 baseline, float height,
               const Rgb& colour);
/// Pixels draw_text() advances.
float text_width(std::string_view text, float height);

/// Complete or absent (AtomicFile). Throws InputError or ResourceError like it.
void write_png(const Image& image, const std::string& path);
/// Throws InputError. Alpha is put on white.
Image read_png(const std::string& path);

}  // namespace rattan
