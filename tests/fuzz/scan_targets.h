// SPDX-License-Identifier: MIT
#pragma once

// The readers as functions of bytes, for libFuzzer and for the short deterministic runs.

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace rattan::fuzz {

/// ply, obj, stl, off, drc: that reader, whatever the bytes are. gz, zst, any: as `rattan remesh`
/// reads a file.
std::vector<std::string> scan_targets();

/// Reads the bytes. Returns whether they were taken for a scan; InputError and ResourceError are
/// the only other ways out. Aborts where a reader breaks a promise: an index out of range, more
/// vertices or triangles than the bytes can hold, colours that do not match their vertices.
bool read_bytes_as(std::string_view target, const std::uint8_t* data, std::size_t size);

/// Small whole files to start from.
std::vector<std::string> seeds_of(std::string_view target);

}  // namespace rattan::fuzz
