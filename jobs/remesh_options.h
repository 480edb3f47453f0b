// SPDX-License-Identifier: MIT
#pragma once

// Everything `rattan remesh` can be asked for. The command line, and later a batch manifest, fill
// the same struct.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace rattan {

enum class SizeKind { kFaces, kEdgeLength, kRatio };
enum class Energy { kEdge, kTriangle };
enum class SolverKind { kNested, kReference };

struct RemeshOptions {
  std::string scan;
  /// With several sizes a template, see output_names.h.
  std::string output;

  /// Vertices at exactly equal positions become one, also where triangles share vertices already.
  bool merge_vertices = false;
  /// Components of fewer triangles are dropped; 0: none.
  std::uint64_t drop_components = 0;
  /// Boundary loops of at most so many edges are filled; 0: none.
  std::uint64_t fill_holes = 0;

  SizeKind size_kind = SizeKind::kRatio;
  /// Faces of the remesh; edge length in file units; or faces per triangle of the repaired scan.
  /// One remesh for each.
  std::vector<double> sizes = {0.05};
  /// Iso-lines per period of the parameterization; 0 takes 1, or 4 for pure quads. More lines
  /// leave fewer irregular vertices and make sizes less even.
  int density = 0;

  /// File of directions to follow instead of the curvature, see field_reader.h; empty: none.
  std::string field;
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

  /// Quads only, no triangle.
  bool pure_quads = false;

  /// Bits per coordinate in a .drc; 0 chooses them from the quad size.
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
  std::string report;     ///< empty: none
  std::string preview;    ///< empty: none
  std::string thumbnail;  ///< small PNG of the remesh; empty: none
  std::string viewer;     ///< script with the remesh, for a page; empty: none

  /// With every choice made that is left to Rattan.
  RemeshOptions resolved() const;
  /// The options that decide the bytes of the output of this size, as one line of text (also kept
  /// in a .drc).
  std::string canonical(double size) const;
};

}  // namespace rattan
