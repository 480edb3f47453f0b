// SPDX-License-Identifier: MIT
#pragma once

// Everything `rattan remesh` can be asked for. The command line, and a batch manifest, fill the
// same struct.

#include <string>
#include <vector>

#include "jobs/scan_options.h"

namespace rattan {

enum class SizeKind { kFaces, kEdgeLength, kRatio };

struct RemeshOptions : ScanOptions {
  SizeKind size_kind = SizeKind::kRatio;
  /// Faces of the remesh; edge length in file units; or faces per triangle of the repaired scan.
  /// One remesh for each.
  std::vector<double> sizes = {0.05};
  /// Iso-lines per period of the parameterization; 0 takes 1, or 4 for pure quads. More lines
  /// leave fewer irregular vertices and make sizes less even.
  int density = 0;

  /// Sharp edges by the turn of the normals across them, in degrees; 0: boundaries are the only
  /// features.
  double crease = 35.0;

  /// Quads only, no triangle.
  bool pure_quads = false;

  std::string thumbnail;  ///< small PNG of the remesh; empty: none
  std::string viewer;     ///< script with the remesh, for a page; empty: none

  /// With every choice made that is left to Rattan.
  RemeshOptions resolved() const;
  /// The options that decide the bytes of the output of this size, as one line of text (also kept
  /// in a .drc).
  std::string canonical(double size) const;
};

}  // namespace rattan
