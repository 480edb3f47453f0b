// SPDX-License-Identifier: MIT
// libpng and libjpeg report errors by longjmp: what has a destructor lives outside the functions
// that call setjmp.
#include "io/layout/texture_picture.h"

#include <csetjmp>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <exception>
#include <fstream>
#include <jpeglib.h>
#include <string_view>

#include <png.h>

#include "engine/core/errors.h"
#include "io/file/atomic_file.h"

namespace rattan {
namespace {

constexpr const char* kRemedy =
    "Give a whole PNG or JPEG file of that name, or convert the picture";

enum class Kind { kPng, kJpeg, kOther };

Kind kind_of(std::string_view bytes) {
  if (bytes.starts_with("\x89PNG\r\n\x1a\n")) {
    return Kind::kPng;
  }
  return bytes.starts_with("\xff\xd8\xff") ? Kind::kJpeg : Kind::kOther;
}

[[noreturn]] void refuse(const std::string& path, const std::string& why) {
  throw InputError(path, "", "the texture " + why, kRemedy);
}

class JpegReader {
 public:
  explicit JpegReader(std::string_view bytes) : bytes_(bytes) {
    info_.err = jpeg_std_error(&errors_.base);
    errors_.base.error_exit = [](j_common_ptr info) {
      auto* errors = reinterpret_cast<Errors*>(info->err);
      info->err->format_message(info, errors->text);
      std::longjmp(errors->back, 1);
    };
    errors_.base.output_message = [](j_common_ptr) {};
  }
  ~JpegReader() {
    if (created_) {
      jpeg_destroy_decompress(&info_);
    }
  }
  JpegReader(const JpegReader&) = delete;
  JpegReader& operator=(const JpegReader&) = delete;

  bool read_header() {
    if (setjmp(errors_.back) != 0) {
      return false;
    }
    jpeg_create_decompress(&info_);
    created_ = true;
    jpeg_mem_src(&info_, reinterpret_cast<const unsigned char*>(bytes_.data()), bytes_.size());
    jpeg_read_header(&info_, TRUE);
    return true;
  }
  bool read_rows(Image& image) {
    if (setjmp(errors_.back) != 0) {
      return false;
    }
    info_.out_color_space = JCS_RGB;
    info_.dct_method = JDCT_ISLOW;  // the same bits with and without SIMD
    jpeg_start_decompress(&info_);
    while (info_.output_scanline < info_.output_height) {
      JSAMPROW row = image.at(0, static_cast<int>(info_.output_scanline)).data();
      jpeg_read_scanlines(&info_, &row, 1);
    }
    jpeg_finish_decompress(&info_);
    return true;
  }
  PictureSize size() const { return {info_.image_width, info_.image_height}; }
  /// Of the failure; or of what was wrong and mended (a file cut off is filled with grey).
  const char* text() const { return errors_.text; }
  bool damaged() const { return info_.err->num_warnings > 0; }

 private:
  struct Errors {
    jpeg_error_mgr base;
    std::jmp_buf back;
    char text[JMSG_LENGTH_MAX] = "";
  };
  std::string_view bytes_;
  Errors errors_{};
  jpeg_decompress_struct info_{};
  bool created_ = false;
};

class PngWriter {
 public:
  explicit PngWriter(AtomicFile& file) : file_(file) {
    png_ = png_create_write_struct(
        PNG_LIBPNG_VER_STRING, this,
        [](png_structp png, png_const_charp message) {
          auto* self = static_cast<PngWriter*>(png_get_error_ptr(png));
          std::snprintf(self->text_, sizeof(self->text_), "%s", message);
          std::longjmp(self->back_, 1);
        },
        nullptr);
    info_ = png_ == nullptr ? nullptr : png_create_info_struct(png_);
  }
  ~PngWriter() { png_destroy_write_struct(&png_, &info_); }
  PngWriter(const PngWriter&) = delete;
  PngWriter& operator=(const PngWriter&) = delete;

  void write(const Image& image) {
    if (info_ == nullptr || !write_rows(image)) {
      if (thrown_) {
        std::rethrow_exception(thrown_);
      }
      throw InternalError(std::string("libpng cannot encode the picture: ") + text_);
    }
  }

 private:
  bool write_rows(const Image& image) {
    if (setjmp(back_) != 0) {
      return false;
    }
    png_set_write_fn(
        png_, this,
        [](png_structp png, png_bytep bytes, std::size_t count) {
          auto* self = static_cast<PngWriter*>(png_get_io_ptr(png));
          if (!self->put(bytes, count)) {
            png_error(png, "the file cannot be written");
          }
        },
        nullptr);
    png_set_user_limits(png_, 0x7fffffff, 0x7fffffff);
    png_set_IHDR(png_, info_, static_cast<png_uint_32>(image.width()),
                 static_cast<png_uint_32>(image.height()), 8, PNG_COLOR_TYPE_RGB,
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB(png_, info_, PNG_sRGB_INTENT_PERCEPTUAL);
    png_write_info(png_, info_);
    for (int y = 0; y < image.height(); ++y) {
      png_write_row(png_, image.at(0, y).data());
    }
    png_write_end(png_, info_);
    return true;
  }
  // Exceptions must not pass through libpng.
  bool put(const void* bytes, std::size_t count) noexcept {
    try {
      file_.write(bytes, count);
    } catch (...) {
      thrown_ = std::current_exception();
    }
    return !thrown_;
  }

  AtomicFile& file_;
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
  std::jmp_buf back_{};
  char text_[200] = "";
  std::exception_ptr thrown_;
};

std::uint32_t big_endian(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = at; i < at + 4; ++i) {
    value = value << 8 | static_cast<unsigned char>(bytes[i]);
  }
  return value;
}

}  // namespace

PictureSize picture_size(const std::string& path) {
  // A JPEG's size stands behind whatever a camera has put into its header.
  constexpr std::size_t kHeader = std::size_t{1} << 22;
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    refuse(path, "cannot be opened");
  }
  std::string bytes(kHeader, '\0');
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  PictureSize size;
  if (kind_of(bytes) == Kind::kPng && bytes.size() >= 24) {
    size = {big_endian(bytes, 16), big_endian(bytes, 20)};
  } else if (kind_of(bytes) == Kind::kJpeg) {
    JpegReader reader(bytes);
    if (!reader.read_header()) {
      refuse(path, std::string("is damaged (") + reader.text() + ")");
    }
    size = reader.size();
  } else {
    refuse(path, "is neither a PNG nor a JPEG picture");
  }
  if (size.width == 0 || size.height == 0 || size.width > 0x7fffffffU ||
      size.height > 0x7fffffffU) {
    refuse(path, "is damaged (its size is not sensible)");
  }
  return size;
}

Image read_picture(const std::string& path) {
  std::string head(8, '\0');
  {
    std::ifstream file(path, std::ios::binary);
    file.read(head.data(), static_cast<std::streamsize>(head.size()));
  }
  if (kind_of(head) == Kind::kPng) {
    return read_png(path);
  }
  const std::string bytes = read_file(path);
  if (kind_of(bytes) != Kind::kJpeg) {
    refuse(path, "is neither a PNG nor a JPEG picture");
  }
  JpegReader reader(bytes);
  Image image;
  if (reader.read_header()) {
    const PictureSize size = reader.size();
    image = Image(static_cast<int>(size.width), static_cast<int>(size.height));
    if (reader.read_rows(image) && !reader.damaged()) {
      return image;
    }
  }
  refuse(path, std::string("is damaged (") +
                   (reader.text()[0] != '\0' ? reader.text() : "cut off") + ")");
}

void write_png_rows(const Image& image, const std::string& path) {
  AtomicFile file(path);
  PngWriter(file).write(image);
  file.commit();
}

}  // namespace rattan
