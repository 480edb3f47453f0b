// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>

#include "engine/layout/chart_mesh.h"
#include "engine/layout/transitions.h"
#include "io/remesh/remesh_metadata.h"

namespace rattan {

/// Where the transition functions of the layout at `output` go: its extension replaced by
/// ".charts.json".
std::string transitions_path(const std::string& output);

/// Writes the parts of a layout and how they meet as JSON, a record a line:
///
///   parts[]        part, chart, kind ("unfolded", "flattened", "split"), corner, length
///   transitions[]  part_a, side_a, unit_a, part_b, side_b, unit_b, turn, s, t, strand (null
///                  inside a split chart)
///   boundary[]     part, side, unit, strand
///
/// with the meaning of engine/layout/transitions.h, which the file states itself. `kinds`: one a
/// chart. Streamed; read back and compared byte by byte before the file takes its name.
/// `before_verify` is for tests: called with the temporary's path before that. Same input: same
/// bytes. Returns their number. Throws InputError (the directory), ResourceError (disk full),
/// InternalError (a file that came back different).
std::uint64_t write_transitions(const Transitions& transitions, std::span<const ChartKind> kinds,
                                const RemeshMetadata& metadata, const std::string& path,
                                const std::function<void(const std::string&)>& before_verify = {});

}  // namespace rattan
