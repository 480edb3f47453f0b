// SPDX-License-Identifier: MIT
#pragma once

// What every job on one scan can be asked for, whatever it makes of the scan.

#include <cstdint>
#include <optional>
#include <string>

namespace rattan {

enum class Energy { kEdge, kTriangle };
enum class SolverKind { kNested, kReference };

struct ScanOptions {
  std::string scan;
  /// With several sizes a template, see output_names.h.
  std::string output;

  /// Vertices at exactly equal positions become one, also where triangles share vertices already.
  bool merge_vertices = false;
  /// Components of fewer triangles are dropped; 0: none.
  std::uint64_t drop_components = 0;
  /// Boundary loops of at most so many edges are filled; 0: none.
  std::uint64_t fill_holes = 0;

  /// File of directions to follow instead of the curvature, see field_reader.h; empty: none.
  std::string field;
  /// The direction field is smoothed modulo 2 pi / symmetry: 1, 2 or 4.
  int symmetry = 4;
  /// rho of PGP 4.2, in (0, 1); by default tied to the size of what is made.
  std::optional<double> smoothing;
  /// Rescale the control vectors by PGP 4.1 in full.
  bool curl_correction = false;

  Energy energy = Energy::kTriangle;
  SolverKind solver = SolverKind::kNested;
  /// Newton-CG steps that finish the nested solve.
  int newton_steps = 0;

  /// Bits per coordinate in a .drc; 0 chooses them from the size.
  int position_bits = 0;

  /// Vertices a tile: part of what decides the result.
  std::uint32_t tile_size = 8192;
  /// Bytes; 0 takes half of the memory that the machine has available.
  std::uint64_t memory = 0;
  /// 0 uses every processor that the process may run on.
  int threads = 0;

  std::string work_dir;  ///< empty: output + ".work"
  /// Delete what an earlier run left in the work directory instead of taking it up.
  bool fresh = false;
  /// For tests: seconds between checkpoints, 0 for one after every step.
  std::optional<double> checkpoint_seconds;
  bool keep_work = false;
  std::string report;   ///< empty: none
  std::string preview;  ///< empty: none
};

}  // namespace rattan
