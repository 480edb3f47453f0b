// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "io/picture/camera.h"
#include "io/picture/samples.h"

namespace rattan {

/// How one kind of line is drawn; width 0: not at all.
struct LineStyle {
  float width = 0.0F;  ///< pixels
  float opacity = 1.0F;
  Rgb colour{};
};

/// Styles by LineKind, of pictures of one look.
using LineStyles = std::array<LineStyle, 4>;
LineStyles line_styles(Look look, float width);

/// Lines of one look, drawn where the surface that was sampled doesn't hide them, nor on its
/// inside: of one width however finely the surface is cut into triangles. A byte a sample.
class LineLayer {
 public:
  LineLayer(const SampleGrid& grid, const Camera& camera, const LineStyles& styles);
  void add(std::span<const SurfaceLine> lines);
  /// Mixes them into the colours of a look.
  void apply(SampleGrid& grid, std::size_t look) const;

 private:
  struct Flat;
  void draw(const Flat& line, int first_row, int last_row);

  const SampleGrid& grid_;
  const Camera& camera_;
  LineStyles styles_;
  std::vector<std::uint8_t> cover_;  // two bits of kind, six of coverage
};

}  // namespace rattan
