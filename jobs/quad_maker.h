// SPDX-License-Identifier: MIT
#pragma once

// From the field to a mesh of about as many quads as asked for: tries at one period after the
// other.

#include <optional>

#include "engine/core/memory_budget.h"
#include "engine/layout/arrangement.h"
#include "jobs/job_context.h"

namespace rattan {

class QuadMaker {
 public:
  explicit QuadMaker(JobContext& job) : job_(job) {}

  /// Searches for the side that gives the face count, from the area of the low-passed surface.
  void make_to_size();
  /// Solves for the phases at this side of a quad, and draws. False if more than `most` faces are
  /// to be expected; then there is no mesh.
  bool make_at(double side, double most);
  /// Draws more or fewer lines with the phases of the last solve; false if that doesn't meet the
  /// target.
  bool make_from_last(int density);

  double side() const { return omega_ / density_; }
  double omega() const { return omega_; }
  int density() const { return density_; }  ///< lines a period
  /// Before the curves were divided, all looked as if the target would be met.
  bool expected_to_meet() const;
  const SolveReport& phase_report() const { return phase_report_; }
  const SingularityCounts& singularities() const { return extracted_.report.singularities; }

 private:
  struct Extracted {
    double expected_faces = 0.0;  ///< infinite if lines cross too often
    ArrangementReport report;
  };

  bool draw(double most);
  Extracted extract(double most, std::optional<CellComplex>& cells);
  double quadrangulate_cells(std::optional<CellComplex>& cells);
  double refined_faces();
  double most_faces() const;
  double first_side() const;

  JobContext& job_;
  Reservation output_memory_;
  double omega_ = 0.0;
  int density_ = 1;
  SolveReport phase_report_;
  Extracted extracted_;
  double refined_faces_ = 0.0;  ///< once the curves are divided, about
};

}  // namespace rattan
