// SPDX-License-Identifier: MIT
#include <memory>

#include "io/synth/synth.h"
#include "tools/rattan/commands.h"
#include "tools/rattan/console.h"

namespace rattan {

void add_synth_command(CLI::App& app, Action& action) {
  struct Arguments {
    std::string output;
    SynthOptions options;
    bool quiet = false;
  };
  auto args = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand(
      "synth", "Write a scan-like surface of any size, reproducibly (binary PLY).");
  command->add_option("-o,--output", args->output, "PLY file to write")
      ->type_name("FILE")
      ->required();
  command->add_option("--triangles", args->options.triangles, "triangles wanted, met within 1 %")
      ->required()
      ->check(CLI::Range(std::uint64_t{12}, std::uint64_t{4000000000}));
  command->add_option("--seed", args->options.seed, "another seed, another surface")
      ->capture_default_str();
  command->add_option("--genus", args->options.genus, "handles, 0 to 1000")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  command->add_option("--noise", args->options.noise, "scanner noise, in mean edge lengths, 0 to 1")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command->add_option("--holes", args->options.holes, "boundary loops, 0 to 10000")
      ->check(CLI::Range(0, 10000))
      ->capture_default_str();
  command->add_flag("--quiet", args->quiet, "no progress");
  command->callback([args, &action] {
    action = [args] {
      Console console(args->quiet ? Verbosity::kQuiet : Verbosity::kNormal);
      synthesise(args->options, args->output, console);
      return 0;
    };
  });
}

}  // namespace rattan
