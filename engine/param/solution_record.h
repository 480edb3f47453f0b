// SPDX-License-Identifier: MIT
#pragma once

// What the solves left beside their fields, in the store like these: enough to say later what the
// fields mean. Written in the same steps as the fields.

#include <optional>
#include <string>
#include <vector>

#include "engine/core/packed_chunk.h"
#include "engine/solve/solver.h"

namespace rattan {

/// Of fields::kFrame.
struct FieldRecord {
  double quad_side = 0.0;        ///< lengths in ScanMesh::unit, like all
  double fitting_length = 0.0;   ///< over which directions blend
  double floor_curvature = 0.0;  ///< below this a surface counts as flat
  double curl_power = 0.0;       ///< 0: no scales
  int symmetry = 4;
  std::vector<SolveReport> reports;  ///< of smoothing, then of curl correction
};

/// Of fields::kPhase.
struct PhaseRecord {
  double omega = 0.0;  ///< period, a length
  int density = 1;     ///< lines a period
  SolveReport report;
};

template <class A>
void members_of(A& a, FieldRecord& r) {
  a(r.quad_side);
  a(r.fitting_length);
  a(r.floor_curvature);
  a(r.curl_power);
  a(r.symmetry);
  a(r.reports);
}

template <class A>
void members_of(A& a, PhaseRecord& r) {
  a(r.omega);
  a(r.density);
  a(r.report);
}

namespace fields {
inline constexpr std::string_view kFieldRecord = "field/record";
/// Gone as soon as the field changes that the phases were solved for.
inline constexpr std::string_view kPhaseRecord = "param/record";
/// |U| and |V| of owned vertices before they were brought to one; only where asked for.
inline constexpr Field<PartNorms> kPhaseNorms{"param/norms"};
}  // namespace fields

template <class Record>
std::optional<Record> find_record(Store& store, std::string_view name) {
  std::optional<Record> record;
  if (store.has_chunk(name, TileId(0))) {
    read_packed(store, name, record.emplace());
  }
  return record;
}

}  // namespace rattan
