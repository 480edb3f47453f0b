// SPDX-License-Identifier: MIT
#pragma once

// The one ledger of memory: every large buffer is entered before it is allocated. Caches aren't:
// they hold whatever is left, and give way to entries.

#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>

namespace rattan {

class MemoryBudget;

/// Bytes held in the ledger; given back on destruction. Movable; empty after release or move.
class Reservation {
 public:
  Reservation() = default;
  Reservation(const Reservation&) = delete;
  Reservation& operator=(const Reservation&) = delete;
  Reservation(Reservation&& other) noexcept { *this = std::move(other); }
  Reservation& operator=(Reservation&& other) noexcept;
  ~Reservation() { release(); }

  std::uint64_t bytes() const { return bytes_; }
  /// Changes the size of this entry; keeps the old one if growing throws.
  void resize(std::uint64_t bytes);
  void release() noexcept;

 private:
  friend class MemoryBudget;
  Reservation(MemoryBudget* budget, std::uint64_t bytes, std::string purpose)
      : budget_(budget), bytes_(bytes), purpose_(std::move(purpose)) {}

  MemoryBudget* budget_ = nullptr;
  std::uint64_t bytes_ = 0;
  std::string purpose_;
};

/// Thread safe. Must outlive its reservations.
class MemoryBudget {
 public:
  explicit MemoryBudget(std::uint64_t total_bytes) : total_(total_bytes) {}
  MemoryBudget(const MemoryBudget&) = delete;
  MemoryBudget& operator=(const MemoryBudget&) = delete;

  /// `purpose` completes "Not enough memory for ...". Throws ResourceError that says what total
  /// would do.
  Reservation reserve(std::uint64_t bytes, std::string_view purpose);
  /// Empty reservation where reserve would throw.
  Reservation try_reserve(std::uint64_t bytes, std::string_view purpose);

  /// What the one cache may hold that holds `cached` bytes now: the total without what the process
  /// has in memory besides the cache (measured, so that the allocator's slack and buffers too small
  /// to be entered count), without entries that are not yet filled, and without a margin for what
  /// may be allocated until the next call.
  std::uint64_t cache_share(std::uint64_t cached) const;
  /// `give_way` shrinks the cache to its share; reserve calls it for what doesn't fit beside the
  /// cache. It must stay callable until it is replaced (by an empty function at last).
  void set_cache(std::function<void()> give_way);

  /// Whether the process fills more than half of the total.
  bool tight() const;

  std::uint64_t total() const { return total_; }
  std::uint64_t used() const;
  std::uint64_t available() const;
  /// Highest use so far.
  std::uint64_t peak() const;

 private:
  friend class Reservation;
  bool enter(std::uint64_t bytes);
  void leave(std::uint64_t bytes) noexcept;
  [[noreturn]] void refuse(std::uint64_t bytes, std::string_view purpose) const;

  void make_room();

  const std::uint64_t total_;
  std::function<void()> give_way_;
  mutable std::mutex mutex_;
  std::uint64_t used_ = 0;
  std::uint64_t peak_ = 0;
};

/// "1.5 GiB", "320 MiB", "17 bytes".
std::string format_bytes(std::uint64_t bytes);

}  // namespace rattan
