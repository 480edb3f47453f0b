// SPDX-License-Identifier: MIT
#pragma once

// Reads a scan file as a stream: PLY (ASCII, little and big endian), OBJ, STL (ASCII and binary),
// OFF, Draco, each also compressed by gzip or Zstandard. The format is told by the file's first
// bytes, then by its extension. Memory: a fixed buffer, whatever the file holds (but for Draco,
// which is decoded whole); counts in headers are believed only as far as the bytes bear them out.

#include <cstddef>
#include <cstdint>
#include <string>

#include "engine/mesh/scan_sink.h"

namespace rattan {

/// What a scan file is and holds. `want_sha256` is set by the caller, the rest by read_scan.
struct ScanFileInfo {
  bool want_sha256 = false;

  std::string format;             ///< e.g. "PLY, binary little endian"
  std::uint64_t bytes = 0;        ///< size of the file; 0 for a pipe until read_scan returns
  std::uint64_t bytes_read = 0;   ///< advances while reading: a sink may report it as progress
  std::uint64_t vertices = 0;     ///< declared while reading (PLY, OFF), handed out after
  std::uint64_t triangles = 0;    ///< declared faces while reading (PLY, OFF), handed out after
  std::uint64_t polygons = 0;     ///< faces of more than three corners
  std::uint64_t small_faces = 0;  ///< faces of fewer than three corners, dropped
  bool colours = false;           ///< vertices have colours; known before the first is handed out
  std::string sha256;             ///< of the file's bytes, 64 hexadecimal digits, if wanted
};

/// The defaults are right for everyone but tests.
struct ScanReadOptions {
  std::size_t buffer_bytes = std::size_t{1} << 20;
  std::size_t block_records = 8192;  ///< vertices or triangles handed to the sink at a time
  /// What decoding a Draco file may take.
  std::uint64_t memory_bytes = std::uint64_t{4} << 30;
};

/// Streams the file at `path` into `sink`, on the calling thread; hashing runs beside it. Every
/// index handed out is below the final number of vertices, although for OBJ this is known only once
/// read_scan has returned. `info` may be null. Throws InputError for whatever is wrong with the
/// file, ResourceError for a Draco file beyond options.memory_bytes, and lets the sink's exceptions
/// through.
void read_scan(const std::string& path, ScanSink& sink, ScanFileInfo* info = nullptr,
               const ScanReadOptions& options = {});

}  // namespace rattan
