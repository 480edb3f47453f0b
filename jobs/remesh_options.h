// SPDX-License-Identifier: MIT
#pragma once

// Everything `rattan remesh` can be asked for. The command line, and later a batch manifest, fill
// the same struct.

#include <cstdint>
#include <optional>
#include <string>

namespace rattan {

enum class SizeKind { kFaces, kEdgeLength, kRatio };
enum class Energy { kEdge, kTriangle };
enum class SolverKind { kNested, kReference };

struct RemeshOptions {
  std::string scan;
  std::string output;

  SizeKind size_kind = SizeKind::kRatio;
  /// Faces of the remesh; edge length in file units; or faces per triangle of the repaired scan.
  double size = 0.05;
  /// Iso-lines per period of the parameterization.
  int density = 2;

  /// The direction field is smoothed modulo 2 pi / symmetry: 1, 2 or 4.
  int symmetry = 4;
  /// rho of PGP 4.2, in (0, 1); by default tied to the quad size.
  std::optional<double> smoothing;
  /// Rescale the control vectors by PGP 4.1 in full (otherwise gently, by its 0.2th power).
  bool curl_correction = false;

  /// Sharp edges by the turn of the normals across them, in degrees; 0: boundaries are the only
  /// features.
  double crease = 35.0;

  Energy energy = Energy::kTriangle;
  SolverKind solver = SolverKind::kNested;
  /// Newton-CG steps that finish the nested solve.
  int newton_steps = 0;

  /// Bits per coordinate in a .drc; 0 chooses them from the quad size.
  int position_bits = 0;

  /// Vertices a tile: part of what decides the result.
  std::uint32_t tile_size = 8192;
  /// Bytes; 0 takes half of the memory that the machine has available.
  std::uint64_t memory = 0;
  /// 0 uses every processor that the process may run on.
  int threads = 0;

  std::string work_dir;  ///< empty: output + ".work"
  bool keep_work = false;
  std::string report;   ///< empty: none
  std::string preview;  ///< empty: none

  /// The options that decide the output's bytes, as one line of text (also kept in a .drc).
  std::string canonical() const;
};

}  // namespace rattan
