// SPDX-License-Identifier: MIT
#pragma once

// Options that all commands on one scan share, in their groups.

#include <CLI/CLI.hpp>

#include "jobs/scan_options.h"

namespace rattan {

/// Group Scan.
void add_repair_options(CLI::App& app, ScanOptions& o);
/// Group Method: the direction field. `smoothing`: rho, 0 if not given.
void add_field_options(CLI::App& app, ScanOptions& o, double& smoothing);
/// Group Method: the solve.
void add_solver_options(CLI::App& app, ScanOptions& o);
/// Group Output.
void add_position_bits_option(CLI::App& app, ScanOptions& o);
/// Group Run: memory, threads, work directory.
void add_resource_options(CLI::App& app, ScanOptions& o);

}  // namespace rattan
