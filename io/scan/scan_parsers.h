// SPDX-License-Identifier: MIT
#pragma once

// The readers of the single formats; internal to io/. Each leaves the source where its data end,
// fills `info` and throws InputError.

#include <cstdint>
#include <string_view>

#include "io/file/byte_source.h"
#include "io/scan/scan_blocks.h"
#include "io/scan/scan_reader.h"

namespace rattan {

inline constexpr const char* kSupportedFormats = "PLY, OBJ, STL, OFF or Draco";

void read_ply(ByteSource& source, ScanBlocks& blocks, ScanFileInfo& info);
void read_obj(ByteSource& source, ScanBlocks& blocks, ScanFileInfo& info);
void read_stl(ByteSource& source, ScanBlocks& blocks, ScanFileInfo& info);
void read_off(ByteSource& source, ScanBlocks& blocks, ScanFileInfo& info);
/// The only one that is not a stream: refuses what would take more than `memory_bytes` to decode.
void read_draco(ByteSource& source, ScanBlocks& blocks, ScanFileInfo& info,
                std::uint64_t memory_bytes);
/// Whether the size is the one that a binary STL file of this count has.
bool is_binary_stl(const ByteSource& source);
/// Whether the line can start an OFF file: OFF, COFF, NOFF, ... alone or before counts.
bool is_off_keyword(std::string_view line);

}  // namespace rattan
