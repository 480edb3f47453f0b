// SPDX-License-Identifier: MIT
#include "engine/core/memory_budget.h"

#include <algorithm>
#include <array>
#include <cstdio>

#include "engine/core/errors.h"
#include "engine/core/resident_memory.h"

namespace rattan {

namespace {

/// Covers what all threads allocate between two looks at the process's size.
std::uint64_t margin(std::uint64_t total) {
  return total / 32 + (std::uint64_t{6} << 20);
}

/// A cache without anything makes every pass read each chunk several times.
constexpr std::uint64_t kLeastCache = std::uint64_t{8} << 20;

}  // namespace

Reservation& Reservation::operator=(Reservation&& other) noexcept {
  if (this != &other) {
    release();
    budget_ = std::exchange(other.budget_, nullptr);
    bytes_ = std::exchange(other.bytes_, 0);
    purpose_ = std::move(other.purpose_);
  }
  return *this;
}

void Reservation::resize(std::uint64_t bytes) {
  ensure(budget_ != nullptr, "only a reservation that is held can be resized");
  if (bytes > bytes_) {
    if (!budget_->enter(bytes - bytes_)) {
      budget_->refuse(bytes - bytes_, purpose_);
    }
  } else {
    budget_->leave(bytes_ - bytes);
  }
  const bool grown = bytes > bytes_;
  bytes_ = bytes;
  if (grown) {
    budget_->make_room();
  }
}

void Reservation::release() noexcept {
  if (budget_ != nullptr) {
    budget_->leave(bytes_);
  }
  budget_ = nullptr;
  bytes_ = 0;
}

Reservation MemoryBudget::reserve(std::uint64_t bytes, std::string_view purpose) {
  if (!enter(bytes)) {
    refuse(bytes, purpose);
  }
  Reservation held(this, bytes, std::string(purpose));
  make_room();
  return held;
}

Reservation MemoryBudget::try_reserve(std::uint64_t bytes, std::string_view purpose) {
  if (!enter(bytes)) {
    return {};
  }
  Reservation held(this, bytes, std::string(purpose));
  make_room();
  return held;
}

std::uint64_t MemoryBudget::cache_share(std::uint64_t cached) const {
  const std::uint64_t kept_free = margin(total_);
  std::uint64_t resident = resident_bytes();
  if (resident + kept_free > total_) {
    return_free_pages();
    resident = resident_bytes();
  }
  const std::uint64_t measured = resident > cached ? resident - cached : 0;
  const std::uint64_t elsewhere = std::max(measured, used()) + kept_free;
  return std::max(total_ > elsewhere ? total_ - elsewhere : 0, kLeastCache);
}

bool MemoryBudget::tight() const {
  return resident_bytes() > total_ / 2;
}

void MemoryBudget::set_cache(std::function<void()> give_way) {
  const std::scoped_lock lock(mutex_);
  give_way_ = std::move(give_way);
}

void MemoryBudget::make_room() {
  std::function<void()> give_way;
  {
    const std::scoped_lock lock(mutex_);
    give_way = give_way_;
  }
  if (give_way) {
    give_way();
  }
}

std::uint64_t MemoryBudget::used() const {
  const std::scoped_lock lock(mutex_);
  return used_;
}

std::uint64_t MemoryBudget::available() const {
  const std::scoped_lock lock(mutex_);
  return total_ - used_;
}

std::uint64_t MemoryBudget::peak() const {
  const std::scoped_lock lock(mutex_);
  return peak_;
}

bool MemoryBudget::enter(std::uint64_t bytes) {
  const std::scoped_lock lock(mutex_);
  if (bytes > total_ - used_) {
    return false;
  }
  used_ += bytes;
  peak_ = std::max(peak_, used_);
  return true;
}

void MemoryBudget::leave(std::uint64_t bytes) noexcept {
  const std::scoped_lock lock(mutex_);
  used_ -= bytes;
}

void MemoryBudget::refuse(std::uint64_t bytes, std::string_view purpose) const {
  const std::uint64_t in_use = used();
  throw ResourceError("Not enough memory for " + std::string(purpose) + ": " + format_bytes(bytes) +
                      " more are needed, but " + format_bytes(in_use) + " of " +
                      format_bytes(total_) + " are in use. Allow at least " +
                      format_bytes(in_use + bytes) + ".");
}

std::string format_bytes(std::uint64_t bytes) {
  constexpr std::array<const char*, 4> kUnits = {"KiB", "MiB", "GiB", "TiB"};
  if (bytes < 1024) {
    return std::to_string(bytes) + " bytes";
  }
  double value = static_cast<double>(bytes) / 1024.0;
  std::size_t unit = 0;
  while (value >= 1024.0 && unit + 1 < kUnits.size()) {
    value /= 1024.0;
    ++unit;
  }
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), value < 10.0 ? "%.1f %s" : "%.0f %s", value,
                kUnits[unit]);
  return text.data();
}

}  // namespace rattan
