// SPDX-License-Identifier: MIT
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>

#include <fmt/format.h>

#include "engine/core/resident_memory.h"
#include "jobs/memory_share.h"
#include "jobs/remesh_job.h"
#include "jobs/remesh_plan.h"
#include "tools/rattan/commands.h"
#include "tools/rattan/remesh_arguments.h"
#include "tools/rattan/scan_run.h"

namespace rattan {

namespace {

struct Arguments {
  RemeshArguments remesh;
  RunFlags flags;
};

/// Whether the scan, from the bytes of its file, takes at most half of the memory it may, and a
/// second or so: later the allocator gives pages back, which large ones suffer from. Files that are
/// compressed don't tell.
bool small(const RemeshOptions& options) {
  constexpr std::uint64_t kProgramBytes = 32U << 20;
  constexpr std::uint64_t kBytesPerFileByte = 12;
  constexpr std::uint64_t kMostBytes = 8U << 20;
  const std::filesystem::path scan(options.scan);
  const std::string format = scan.extension().string();
  if (format != ".ply" && format != ".obj" && format != ".stl" && format != ".off") {
    return false;
  }
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(scan, error);
  const std::uint64_t memory = options.memory > 0 ? options.memory : default_memory_share();
  return !error && bytes <= kMostBytes && 2 * (kProgramBytes + kBytesPerFileByte * bytes) <= memory;
}

void say(const RemeshReport& report) {
  for (const auto& [output, singularities, distance, shared_with] : report.outputs) {
    fmt::print("{}: {} faces, {:.1f} % quads, {} bytes, {:.1f} s\n", output.path, output.faces,
               output.faces == 0
                   ? 0.0
                   : 100.0 * static_cast<double>(output.quads) / static_cast<double>(output.faces),
               output.bytes, report.seconds);
  }
}

int run(const Arguments& args, JsonLog* log) {
  if (log != nullptr) {
    log->set_scan(args.remesh.options.scan);
  }
  const RemeshOptions o = args.remesh.resolve();
  if (!args.flags.dry_run && small(o)) {
    prefer_large_pages();
  }
  return run_scan(o, args.flags, log, plan_remesh, remesh_scan, say);
}

}  // namespace

void add_remesh_command(CLI::App& app, Action& action, JsonLog* log) {
  auto args = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("remesh", "Convert one scan into a curvature-aligned quad-dominant mesh.");
  command
      ->add_option("scan", args->remesh.options.scan,
                   "PLY, OBJ, STL, OFF or Draco file, as it is or with .gz or .zst")
      ->required();
  command
      ->add_option("-o,--output", args->remesh.options.output,
                   "remesh to write: .drc, .obj, .ply or .off; for several sizes {faces}, {size} "
                   "or {n} in it "
                   "stand for the size and its place in the list")
      ->type_name("OUT")
      ->required();
  add_scan_options(*command, args->remesh);
  add_run_options(*command, args->remesh);
  // For the report of a batch, so not on the help screen.
  command
      ->add_option("--thumbnail", args->remesh.options.thumbnail, "write a small PNG of the remesh")
      ->group("");
  command
      ->add_option("--viewer", args->remesh.options.viewer,
                   "write the remesh as a script, for a 3D view")
      ->group("");
  add_process_options(*command, args->remesh.options, args->flags);
  command->callback([args, &action, log] { action = [args, log] { return run(*args, log); }; });
}

}  // namespace rattan
