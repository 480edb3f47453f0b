// SPDX-License-Identifier: MIT
#pragma once

// Whether chunks come from memory or from a disk, counted in the whole process: where loading
// waits, the scheduler gives it a thread of its own.

#include <cstdint>

namespace rattan {

/// A store had to read a chunk from its files.
void note_disk_read();
/// How many there were so far.
std::uint64_t disk_reads();

}  // namespace rattan
