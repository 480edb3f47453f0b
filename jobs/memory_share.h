// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace rattan {

/// Half of the memory that the machine has free, within what the control group grants; bytes, at
/// least 256 MiB.
std::uint64_t default_memory_share();

}  // namespace rattan
