// SPDX-License-Identifier: MIT
#pragma once

// Pictures that hold textures: PNG and JPEG in, PNG out row by row.

#include <cstdint>
#include <string>

#include "io/picture/image.h"

namespace rattan {

struct PictureSize {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
};

/// From the header of a PNG or JPEG file, told by its first bytes. Throws InputError.
PictureSize picture_size(const std::string& path);

/// A PNG or JPEG file; grey becomes colour, alpha is put on white. Takes the file and 3 bytes a
/// pixel of memory, and 4 a pixel more where a PNG is interlaced. Throws InputError.
Image read_picture(const std::string& path);

/// As write_png, but with no more than a few rows of the file in memory.
void write_png_rows(const Image& image, const std::string& path);

}  // namespace rattan
