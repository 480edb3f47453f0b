// SPDX-License-Identifier: MIT
#pragma once

// Splits a batch into parts of even cost.

#include <cstdint>
#include <span>
#include <vector>

namespace rattan {

/// The part, from 0, of each: the costliest first, each into the part that has the least so far,
/// ties by place. Depends on nothing but the costs, so that every process finds the same parts. The
/// costliest part is at most 4/3 of what the best packing has.
std::vector<std::uint32_t> pack(std::span<const double> costs, std::uint32_t parts);

}  // namespace rattan
