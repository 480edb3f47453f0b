// SPDX-License-Identifier: MIT
#include "io/file/decompressor.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <new>
#include <vector>
#include <zlib.h>
#include <zstd.h>
#include <zstd_errors.h>

#include "engine/core/errors.h"

namespace rattan {
namespace {

constexpr std::size_t kInputBytes = std::size_t{128} << 10;
// The longest look-back of a Zstandard frame that is followed: what `zstd --ultra -22` needs.
constexpr int kMaxWindowLog = 27;

/// The compressed bytes, with their place in the file.
class Input {
 public:
  Input(std::string_view head, std::string path, Decompressor::Source source)
      : path_(std::move(path)), source_(std::move(source)), bytes_(kInputBytes) {
    std::copy(head.begin(), head.end(), bytes_.begin());
    size_ = head.size();
  }

  /// False at the end of the file.
  bool fill() {
    if (at_ < size_) {
      return true;
    }
    before_ += size_;
    at_ = 0;
    size_ = source_(bytes_.data(), bytes_.size());
    return size_ > 0;
  }
  const char* data() const { return bytes_.data() + at_; }
  std::size_t available() const { return size_ - at_; }
  void consume(std::size_t n) { at_ += n; }
  [[noreturn]] void fail(const std::string& problem, const std::string& remedy) const {
    throw InputError(path_, "byte " + std::to_string(before_ + at_), problem, remedy);
  }
  [[noreturn]] void fail_cut_off(const char* what) const {
    fail(std::string("the ") + what + " data end too early",
         "The file is cut off; copy or compress it again");
  }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
  Decompressor::Source source_;
  std::vector<char> bytes_;
  std::size_t at_ = 0;
  std::size_t size_ = 0;
  std::uint64_t before_ = 0;  // bytes of the file before those held
};

class Gzip final : public Decompressor {
 public:
  explicit Gzip(Input input) : input_(std::move(input)) {
    constexpr int kGzipHeader = 16;
    if (::inflateInit2(&stream_, MAX_WBITS + kGzipHeader) != Z_OK) {
      throw ResourceError(input_.path() + ": no memory is left to decompress it.");
    }
  }
  ~Gzip() override { ::inflateEnd(&stream_); }
  Gzip(const Gzip&) = delete;
  Gzip& operator=(const Gzip&) = delete;

  std::size_t read(char* to, std::size_t n) override {
    n = std::min<std::size_t>(n, std::numeric_limits<uInt>::max());
    stream_.next_out = reinterpret_cast<Bytef*>(to);
    stream_.avail_out = static_cast<uInt>(n);
    while (stream_.avail_out == n && !done_) {
      if (!input_.fill()) {
        if (in_member_) {
          input_.fail_cut_off("gzip");
        }
        done_ = true;
        break;
      }
      if (!in_member_ && skip_padding()) {
        continue;
      }
      inflate_some();
    }
    return n - stream_.avail_out;
  }

 private:
  // Tapes and some tools fill up with zeros behind the last member.
  bool skip_padding() {
    if (!after_member_ || *input_.data() != 0) {
      return false;
    }
    while (input_.available() > 0 && *input_.data() == 0) {
      input_.consume(1);
    }
    return true;
  }

  void inflate_some() {
    in_member_ = true;
    const std::size_t given = input_.available();
    stream_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(input_.data()));
    stream_.avail_in = static_cast<uInt>(given);
    const int result = ::inflate(&stream_, Z_NO_FLUSH);
    input_.consume(given - stream_.avail_in);
    if (result == Z_STREAM_END) {
      in_member_ = false;
      after_member_ = true;
      ::inflateReset(&stream_);
    } else if (result == Z_MEM_ERROR) {
      throw ResourceError(input_.path() + ": no memory is left to decompress it.");
    } else if (result != Z_OK && result != Z_BUF_ERROR) {
      input_.fail(std::string("the gzip data are damaged (") +
                      (stream_.msg != nullptr ? stream_.msg : "no reason given") + ")",
                  "Copy or compress the file again");
    }
  }

  Input input_;
  z_stream stream_{};
  bool in_member_ = false;
  bool after_member_ = false;
  bool done_ = false;
};

class Zstandard final : public Decompressor {
 public:
  explicit Zstandard(Input input) : input_(std::move(input)), stream_(::ZSTD_createDStream()) {
    if (stream_ == nullptr) {
      throw ResourceError(input_.path() + ": no memory is left to decompress it.");
    }
    ::ZSTD_DCtx_setParameter(stream_, ZSTD_d_windowLogMax, kMaxWindowLog);
  }
  ~Zstandard() override { ::ZSTD_freeDStream(stream_); }
  Zstandard(const Zstandard&) = delete;
  Zstandard& operator=(const Zstandard&) = delete;

  std::size_t read(char* to, std::size_t n) override {
    ZSTD_outBuffer out{to, n, 0};
    while (out.pos == 0) {
      const bool more = input_.fill();
      if (!more && at_frame_end_) {
        break;
      }
      // Without input, what the decoder still holds comes out; if nothing does, the data are cut.
      ZSTD_inBuffer in{input_.data(), more ? input_.available() : 0, 0};
      const std::size_t result = ::ZSTD_decompressStream(stream_, &out, &in);
      if (::ZSTD_isError(result) != 0) {
        fail(result);
      }
      input_.consume(in.pos);
      at_frame_end_ = result == 0;
      if (!more && out.pos == 0 && !at_frame_end_) {
        input_.fail_cut_off("Zstandard");
      }
    }
    return out.pos;
  }

 private:
  [[noreturn]] void fail(std::size_t result) const {
    switch (::ZSTD_getErrorCode(result)) {
      case ZSTD_error_memory_allocation:
        throw ResourceError(input_.path() + ": no memory is left to decompress it.");
      case ZSTD_error_frameParameter_windowTooLarge:
        input_.fail("the Zstandard data look back further than 128 MiB",
                    "Compress the file again without --long");
      default:
        input_.fail(
            std::string("the Zstandard data are damaged (") + ::ZSTD_getErrorName(result) + ")",
            "Copy or compress the file again");
    }
  }

  Input input_;
  ZSTD_DStream* stream_;
  bool at_frame_end_ = false;
};

}  // namespace

std::unique_ptr<Decompressor> Decompressor::recognise(std::string_view head, std::string path,
                                                      Source source) {
  const bool zstd_frame = head.starts_with("\x28\xb5\x2f\xfd");
  const bool skippable =
      head.size() >= 4 && (head[0] & 0xf0) == 0x50 && head.substr(1, 3) == "\x2a\x4d\x18";
  if (head.starts_with("\x1f\x8b")) {
    return std::make_unique<Gzip>(Input(head, std::move(path), std::move(source)));
  }
  if (zstd_frame || skippable) {
    return std::make_unique<Zstandard>(Input(head, std::move(path), std::move(source)));
  }
  return nullptr;
}

}  // namespace rattan
