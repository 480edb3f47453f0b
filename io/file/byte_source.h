// SPDX-License-Identifier: MIT
#pragma once

// A file as a forward stream over one fixed buffer, by bytes or by lines, hashed on the way if
// asked. Gzip and Zstandard files are told by their first bytes and give their content.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace rattan {

class Decompressor;
struct ScanFileInfo;

class ByteSource {
 public:
  /// Opens the file. Throws InputError if it is missing, unreadable or a directory.
  ByteSource(std::string path, std::size_t buffer_bytes, ScanFileInfo& info);
  ~ByteSource();
  ByteSource(const ByteSource&) = delete;
  ByteSource& operator=(const ByteSource&) = delete;

  const std::string& path() const { return path_; }
  /// Size of the content; 0 if it is not known (a pipe, a compressed file).
  std::uint64_t content_bytes() const { return content_bytes_; }
  bool is_compressed() const { return decompressor_ != nullptr; }

  const char* data() const { return cursor_; }
  std::size_t available() const { return static_cast<std::size_t>(end_ - cursor_); }
  /// Position of data() in the content.
  std::uint64_t offset() const { return read_bytes_ - available(); }
  /// Makes `n` bytes available, growing the buffer if it is smaller; false if the file ends before.
  bool fill(std::size_t n) { return available() >= n || fill_slow(n); }
  void consume(std::size_t n) { cursor_ += n; }
  /// False if the file ends before `n` bytes.
  bool skip(std::uint64_t n);
  /// Reads to the end of the file, so that the hash covers all of it (and the checksum of a
  /// compressed file is verified).
  void drain();

  /// Next line without its "\n" or "\r\n"; valid until the next call. False at the end of the file.
  /// Throws InputError for a line beyond 16 MiB.
  bool next_line(std::string_view& line);
  /// Number of the line returned last, from 1.
  std::uint64_t line_number() const { return line_number_; }

  [[noreturn]] void fail_at_line(const std::string& problem, const std::string& remedy) const;
  [[noreturn]] void fail_at_byte(std::uint64_t at, const std::string& problem,
                                 const std::string& remedy) const;

 private:
  class Hasher;

  bool fill_slow(std::size_t n);
  void open_content(std::uint64_t file_bytes);
  /// Moves what is unread to the front and reads once; false at the end of the file.
  bool read_more();
  /// Up to n bytes of the file as it is on disk; 0 at its end.
  std::size_t read_file(char* to, std::size_t n);

  std::string path_;
  ScanFileInfo& info_;
  int descriptor_ = -1;
  std::uint64_t content_bytes_ = 0;
  std::uint64_t read_bytes_ = 0;  // of the content
  std::uint64_t file_read_ = 0;   // of the file
  std::uint64_t line_number_ = 0;
  bool at_end_ = false;
  std::vector<char> buffer_;
  const char* cursor_ = nullptr;
  const char* end_ = nullptr;
  std::unique_ptr<Hasher> hasher_;
  std::unique_ptr<Decompressor> decompressor_;
};

}  // namespace rattan
