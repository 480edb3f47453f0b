// SPDX-License-Identifier: MIT
#pragma once

// Reads a user's direction field: text, a line "x y z" or "x y z fidelity" for each vertex of the
// scan, in the scan file's order; "#" begins a comment. Compressed files are recognised.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>

#include "engine/mesh/wanted_direction.h"

namespace rattan {

/// Hands the directions to `take` in blocks, scaled to unit length (zero stays zero). Throws
/// InputError with the line for what is no number, not finite, or a fidelity outside [0, 1], and if
/// there are not `expected` of them. Returns the SHA-256 of the file, 64 hexadecimal digits.
std::string read_field(const std::string& path, std::uint64_t expected,
                       const std::function<void(std::span<const VertexDirection>)>& take);

}  // namespace rattan
