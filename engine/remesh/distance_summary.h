// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

namespace rattan {

/// Largest, mean, root mean square and quantiles of distances that arrive one by one. Memory: 1
/// MiB, however many they are; so quantiles are exact to a relative 1/1024, the rest to rounding.
/// The order of arrival decides rounding alone.
class DistanceSummary {
 public:
  void add(double distance2) {
    const double d = std::sqrt(distance2);
    max_ = std::max(max_, d);
    sum_ += d;
    squares_ += distance2;
    ++count_;
    ++bins_[bin(d)];
  }

  std::uint64_t count() const { return count_; }
  double max() const { return max_; }
  double mean() const { return count_ > 0 ? sum_ / static_cast<double>(count_) : 0.0; }
  double rms() const {
    return count_ > 0 ? std::sqrt(squares_ / static_cast<double>(count_)) : 0.0;
  }

  /// The least value that at least `share` of the distances do not exceed, rounded up to the end of
  /// its bin but not beyond max(). Pre: 0 < share <= 1. 0 if there are none.
  double quantile(double share) const {
    const double wanted = share * static_cast<double>(count_);
    std::uint64_t seen = 0;
    for (std::size_t b = 0; b <= kBins; ++b) {
      seen += bins_[b];
      if (static_cast<double>(seen) >= wanted) {
        return b == 0 ? 0.0 : std::min(max_, bin_end(b));
      }
    }
    return max_;  // in the last bin
  }

 private:
  // A bin holds the numbers that share exponent and first ten bits of the fraction. The first one
  // is for everything below 2^-kBelow of the unit, which counts as zero; the last for what is too
  // long.
  static constexpr int kFractionBits = 10;
  static constexpr std::uint64_t kBelow = 64;
  static constexpr std::uint64_t kOctaves = 128;
  static constexpr std::uint64_t kFirst = (1023 - kBelow) << kFractionBits;
  static constexpr std::uint64_t kBins = kOctaves << kFractionBits;

  static std::size_t bin(double d) {
    const std::uint64_t key = std::bit_cast<std::uint64_t>(d) >> (52 - kFractionBits);
    return key < kFirst ? 0 : std::min(key - kFirst + 1, kBins + 1);
  }
  static double bin_end(std::size_t b) {
    return std::bit_cast<double>((kFirst + b) << (52 - kFractionBits));
  }

  double max_ = 0.0;
  double sum_ = 0.0;
  double squares_ = 0.0;
  std::uint64_t count_ = 0;
  std::vector<std::uint64_t> bins_ = std::vector<std::uint64_t>(kBins + 2);
};

}  // namespace rattan
