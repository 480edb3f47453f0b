// SPDX-License-Identifier: MIT
#pragma once

// Gzip and Zstandard data as a forward stream in bounded memory; internal to io/.

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace rattan {

/// Bytes that tell any of the compressions below.
inline constexpr std::size_t kCompressionMagicBytes = 4;

class Decompressor {
 public:
  /// Reads up to n (> 0) bytes of the compressed file; 0 at its end.
  using Source = std::function<std::size_t(char*, std::size_t)>;

  /// For the compression that `head`, the first bytes of the file (already taken from `source`),
  /// tells; null if none. `path` names the file in errors.
  static std::unique_ptr<Decompressor> recognise(std::string_view head, std::string path,
                                                 Source source);
  virtual ~Decompressor() = default;

  /// Up to n (> 0) bytes of content; 0 at its end. Several members or frames follow each other as
  /// one content. Throws InputError for data that are damaged or end too early.
  virtual std::size_t read(char* to, std::size_t n) = 0;
};

}  // namespace rattan
