// SPDX-License-Identifier: MIT
#pragma once

// One function a command: adds its options to the parser and says what to run when it is chosen.

#include <functional>

#include <CLI/CLI.hpp>

#include "tools/rattan/json_log.h"

namespace rattan {

/// Set by the chosen command; main calls it after parsing.
using Action = std::function<int()>;

/// `log`: where all is told instead of the console; may be null.
void add_remesh_command(CLI::App& app, Action& action, JsonLog* log);
void add_batch_command(CLI::App& app, Action& action, JsonLog* log);
void add_slurm_command(CLI::App& app, Action& action);
void add_layout_command(CLI::App& app, Action& action, JsonLog* log);
void add_synth_command(CLI::App& app, Action& action);
void add_compare_command(CLI::App& app, Action& action);
void add_render_command(CLI::App& app, Action& action);
void add_export_command(CLI::App& app, Action& action);
void add_info_command(CLI::App& app, Action& action);

}  // namespace rattan
