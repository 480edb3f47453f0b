// SPDX-License-Identifier: MIT
#include "engine/core/memory_budget.h"

#include <algorithm>
#include <array>
#include <cstdio>

#include "engine/core/errors.h"

namespace rattan {

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
  bytes_ = bytes;
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
  return {this, bytes, std::string(purpose)};
}

Reservation MemoryBudget::try_reserve(std::uint64_t bytes, std::string_view purpose) {
  if (!enter(bytes)) {
    return {};
  }
  return {this, bytes, std::string(purpose)};
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
