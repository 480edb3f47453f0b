// SPDX-License-Identifier: MIT
#pragma once

// The search for the side of the quads that gives the number of faces asked for.

#include <algorithm>
#include <cmath>
#include <limits>

namespace rattan {

/// try side(), tell() how many faces it gave, until done(); then best_side() is what to take.
///
/// The count follows from the density of lines up to what singularities, boundaries and small
/// components take away, so one try usually lands within the promise. Where a surface is thinner
/// than a quad the count goes with the side instead of its square. Where components or boundaries
/// need more faces than were asked for, it does not change any more, and the search ends.
class SizeSearch {
 public:
  SizeSearch(double faces, double first_side) : target_(faces), side_(first_side) {}

  double side() const { return side_; }
  bool done() const { return done_; }
  double best_side() const { return best_side_; }

  void tell(double faces) {
    ++tries_;
    const double miss = std::max(faces / target_, target_ / faces);
    if (miss < best_miss_) {
      best_miss_ = miss;
      best_side_ = side_;
    }
    bool thin = false;
    bool stuck = false;
    if (last_side_ > 0.0) {
      const double sides = std::max(side_ / last_side_, last_side_ / side_);
      const double counts = std::max(faces / last_faces_, last_faces_ / faces);
      thin = counts * counts < sides * sides * sides;
      stuck = sides > 1.1 && counts < 1.02;
    }
    const int most = best_miss_ < kFar ? kTries : kTriesWhenFar;
    done_ = best_miss_ < kGoodEnough || stuck || tries_ == most;
    if (!done_) {
      last_side_ = side_;
      last_faces_ = faces;
      side_ *= thin ? faces / target_ : std::sqrt(faces / target_);
    }
  }

  /// side() gave more faces than this, and they weren't counted: a much larger side is next.
  void tell_more_than(double faces) {
    side_ *= std::max(2.0, std::sqrt(faces / target_));
    last_side_ = 0.0;
  }

 private:
  static constexpr double kGoodEnough = 1.083;
  static constexpr double kFar = 1.15;
  static constexpr int kTries = 3;
  static constexpr int kTriesWhenFar = 6;

  double target_;
  double side_;
  double last_side_ = 0.0;
  double last_faces_ = 0.0;
  double best_side_ = 0.0;
  double best_miss_ = std::numeric_limits<double>::infinity();
  int tries_ = 0;
  bool done_ = false;
};

}  // namespace rattan
