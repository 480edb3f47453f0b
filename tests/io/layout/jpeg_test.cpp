// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <jpeglib.h>
#include <string>

#include <gtest/gtest.h>

#include "engine/core/errors.h"
#include "io/file/atomic_file.h"
#include "io/layout/texture_picture.h"
#include "tests/io/test_meshes.h"

namespace rattan {
namespace {

std::string jpeg_of(const Image& image, bool grey) {
  jpeg_compress_struct info{};
  jpeg_error_mgr errors{};
  info.err = jpeg_std_error(&errors);
  jpeg_create_compress(&info);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&info, &bytes, &size);
  info.image_width = static_cast<JDIMENSION>(image.width());
  info.image_height = static_cast<JDIMENSION>(image.height());
  info.input_components = 3;
  info.in_color_space = JCS_RGB;
  jpeg_set_defaults(&info);
  if (grey) {
    jpeg_set_colorspace(&info, JCS_GRAYSCALE);
  }
  jpeg_set_quality(&info, 95, TRUE);
  jpeg_start_compress(&info, TRUE);
  for (int y = 0; y < image.height(); ++y) {
    Rgb* row = const_cast<Rgb*>(&image.at(0, y));
    JSAMPROW samples = row->data();
    jpeg_write_scanlines(&info, &samples, 1);
  }
  jpeg_finish_compress(&info);
  jpeg_destroy_compress(&info);
  const std::string text(reinterpret_cast<char*>(bytes), size);
  std::free(bytes);
  return text;
}

Image gradient(int width, int height) {
  Image image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      image.at(x, y) = {static_cast<std::uint8_t>(250 * x / width),
                        static_cast<std::uint8_t>(250 * y / height), 90};
    }
  }
  return image;
}

TEST(TexturePicture, JpegIsReadInColour) {
  const testing::ScratchDirectory folder;
  const Image image = gradient(200, 120);
  std::ofstream(folder.file("p.jpg"), std::ios::binary) << jpeg_of(image, false);
  const Image back = read_picture(folder.file("p.jpg"));
  ASSERT_EQ(back.width(), 200);
  ASSERT_EQ(back.height(), 120);
  EXPECT_EQ(picture_size(folder.file("p.jpg")).width, 200U);
  EXPECT_EQ(picture_size(folder.file("p.jpg")).height, 120U);
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 200; ++x) {
      for (std::size_t k = 0; k < 3; ++k) {
        ASSERT_NEAR(back.at(x, y)[k], image.at(x, y)[k], 8) << x << " " << y;
      }
    }
  }
}

TEST(TexturePicture, GreyJpegBecomesColour) {
  const testing::ScratchDirectory folder;
  std::ofstream(folder.file("p.jpg"), std::ios::binary)
      << jpeg_of(Image(40, 30, {77, 77, 77}), true);
  const Image back = read_picture(folder.file("p.jpg"));
  ASSERT_EQ(back.width(), 40);
  EXPECT_NEAR(back.at(20, 15)[0], 77, 1);
  EXPECT_EQ(back.at(20, 15)[0], back.at(20, 15)[2]);
}

// Every cut and a bent byte now and then: a sentence or a picture, never more.
TEST(TexturePicture, DamagedJpegIsRefused) {
  const testing::ScratchDirectory folder;
  const std::string whole = jpeg_of(gradient(64, 64), false);
  const std::string path = folder.file("p.jpg");
  for (std::size_t n = 0; n + 2 < whole.size(); n += 1 + n / 16) {
    std::ofstream(path, std::ios::binary) << whole.substr(0, n);
    EXPECT_THROW(read_picture(path), InputError) << n;
  }
  for (std::size_t n = 0; n < whole.size(); n += 7) {
    std::string bent = whole;
    bent[n] = static_cast<char>(bent[n] ^ 0x5a);
    std::ofstream(path, std::ios::binary) << bent;
    try {
      const PictureSize size = picture_size(path);
      if (std::uint64_t{size.width} * size.height < 1000000) {
        read_picture(path);
      }
    } catch (const InputError&) {
    }
  }
}

}  // namespace
}  // namespace rattan
