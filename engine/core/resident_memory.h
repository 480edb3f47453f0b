// SPDX-License-Identifier: MIT
#pragma once

// What the kernel charges this process with, and how to give back what the allocator keeps.

#include <cstdint>

namespace rattan {

/// Bytes of this process in memory now; 0 if the system doesn't say. Takes a few microseconds.
std::uint64_t resident_bytes();

/// Has the allocator return free pages to the system: jemalloc if the program is linked with it,
/// else glibc's.
void return_free_pages();

/// From now on memory that the allocator takes from the system comes in pages of 2 MiB where the
/// system has them: far fewer faults, but a few MiB more resident. For work that takes little
/// of the memory it may have. Stays; does nothing without jemalloc.
void prefer_large_pages();

/// While it lives, freed pages return to the system at once: for work in memory with little of it
/// to spare, during which nobody looks at the process's size. Costs page faults. Does nothing
/// without jemalloc, or if not wanted. Not nested.
class PromptReturn {
 public:
  explicit PromptReturn(bool wanted);
  PromptReturn(const PromptReturn&) = delete;
  PromptReturn& operator=(const PromptReturn&) = delete;
  ~PromptReturn();

 private:
  bool active_ = false;
};

}  // namespace rattan
