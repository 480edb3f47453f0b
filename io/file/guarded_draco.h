// SPDX-License-Identifier: MIT
#pragma once

// Decoding a Draco file that nobody vouches for; internal to io/.

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace draco {
class Mesh;
class PointAttribute;
}  // namespace draco

namespace rattan {

/// The mesh in the bytes of a Draco file. The library allocates what a file declares before it
/// finds out that the data are missing, so the counts are compared with the size of the file and,
/// with the attributes, with `memory_bytes` first. Throws InputError, with `path`, for what is no
/// whole Draco mesh, and ResourceError if decoding would take more than `memory_bytes`.
std::unique_ptr<draco::Mesh> decode_draco_mesh(std::string_view bytes, const std::string& path,
                                               std::uint64_t memory_bytes);

/// Whether its values are integers or floating-point numbers. The library converts truth values
/// too, but a damaged file holds bytes for them that are neither, and reading those is undefined.
bool holds_numbers(const draco::PointAttribute& attribute);

}  // namespace rattan
