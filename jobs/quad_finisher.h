// SPDX-License-Identifier: MIT
#pragma once

// From the first mesh of quads to the one that is written: vertices in their places, curves as
// finely divided as they bend, bad faces mended or divided.

#include <cstdint>
#include <optional>

#include "engine/remesh/distance.h"
#include "engine/remesh/optimise.h"
#include "engine/remesh/surface_projector.h"
#include "jobs/job_context.h"

namespace rattan {

class QuadFinisher {
 public:
  explicit QuadFinisher(JobContext& job) : job_(job) {}

  /// Works on the context's remesh, in steps.
  void finish();
  double faces() const { return faces_; }
  bool met() const { return meets_target(faces_, job_.target); }
  /// By which factor the target is missed.
  double miss() const;
  const DistanceReport& distance() const { return distance_; }
  /// Frees what is kept of the scan in memory.
  void release() { projector_.reset(); }

 private:
  SurfaceProjector& projector();
  OptimiseOptions optimise_options() const;
  void place_vertices();
  void refine_curves();
  void divide_bad_quads();
  void mend_quads();

  JobContext& job_;
  std::optional<SurfaceProjector> projector_;
  double faces_ = 0.0;
  DistanceReport distance_;
};

}  // namespace rattan
