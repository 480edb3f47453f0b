// SPDX-License-Identifier: MIT
#include "engine/core/resident_memory.h"

#include <array>
#include <cstddef>
#include <cstdio>
#include <fcntl.h>
#include <malloc.h>
#include <string>
#include <sys/mman.h>
#include <unistd.h>

// Only there if the program is linked with jemalloc.
extern "C" int mallctl(const char* name, void* old_value, std::size_t* old_size, void* new_value,
                       std::size_t new_size) __attribute__((weak));

namespace rattan {

namespace {

/// How long jemalloc keeps freed pages, for arenas there are and those to come.
void set_decay(ssize_t milliseconds) {
  unsigned arenas = 0;
  std::size_t size = sizeof arenas;
  mallctl("arenas.narenas", &arenas, &size, nullptr, 0);
  mallctl("arenas.dirty_decay_ms", nullptr, nullptr, &milliseconds, sizeof milliseconds);
  for (unsigned a = 0; a < arenas; ++a) {
    const std::string name = "arena." + std::to_string(a) + ".dirty_decay_ms";
    mallctl(name.c_str(), nullptr, nullptr, &milliseconds, sizeof milliseconds);
  }
}

constexpr ssize_t kUsualDecay = 1000;

/// As jemalloc's extent_hooks_t, of which only the first is of interest here.
struct ExtentHooks {
  using Allocate = void*(ExtentHooks*, void*, std::size_t, std::size_t, bool*, bool*, unsigned);
  Allocate* allocate;
  std::array<void (*)(), 8> others;
};

ExtentHooks* usual_hooks = nullptr;
ExtentHooks large_hooks{};

void* allocate_large(ExtentHooks*, void* wanted, std::size_t size, std::size_t alignment,
                     bool* zero, bool* commit, unsigned arena) {
  void* const extent =
      usual_hooks->allocate(usual_hooks, wanted, size, alignment, zero, commit, arena);
  if (extent != nullptr) {
    ::madvise(extent, size, MADV_HUGEPAGE);
  }
  return extent;
}

}  // namespace

std::uint64_t resident_bytes() {
  static const int file = ::open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  static const auto page = static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
  char text[128];
  const ssize_t size = file >= 0 ? ::pread(file, text, sizeof text - 1, 0) : -1;
  if (size <= 0) {
    return 0;
  }
  text[size] = '\0';
  unsigned long long all = 0;
  unsigned long long resident = 0;
  return std::sscanf(text, "%llu %llu", &all, &resident) == 2 ? resident * page : 0;
}

void return_free_pages() {
  if (mallctl != nullptr) {
    // 4096 stands for every arena.
    mallctl("arena.4096.purge", nullptr, nullptr, nullptr, 0);
    return;
  }
  ::malloc_trim(0);
}

void prefer_large_pages() {
  if (mallctl == nullptr || usual_hooks != nullptr) {
    return;
  }
  std::size_t size = sizeof(void*);
  if (mallctl("arena.0.extent_hooks", &usual_hooks, &size, nullptr, 0) != 0 ||
      usual_hooks == nullptr || usual_hooks->allocate == nullptr) {
    return;
  }
  large_hooks = *usual_hooks;
  large_hooks.allocate = allocate_large;
  unsigned arenas = 0;
  size = sizeof arenas;
  mallctl("arenas.narenas", &arenas, &size, nullptr, 0);
  for (unsigned a = 0; a < arenas; ++a) {
    // Setting the hooks of an arena that is not in use yet would make it.
    const std::string arena = "arena." + std::to_string(a);
    bool in_use = false;
    size = sizeof in_use;
    mallctl((arena + ".initialized").c_str(), &in_use, &size, nullptr, 0);
    if (in_use) {
      ExtentHooks* hooks = &large_hooks;
      mallctl((arena + ".extent_hooks").c_str(), nullptr, nullptr, &hooks, sizeof(void*));
    }
  }
}

PromptReturn::PromptReturn(bool wanted) : active_(wanted && mallctl != nullptr) {
  if (active_) {
    set_decay(0);
  }
}

PromptReturn::~PromptReturn() {
  if (active_) {
    set_decay(kUsualDecay);
  }
}

}  // namespace rattan
