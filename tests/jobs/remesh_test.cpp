// SPDX-License-Identifier: MIT
#include "jobs/remesh.h"

#include <filesystem>
#include <functional>
#include <limits>
#include <string>

#include <gtest/gtest.h>

namespace rattan {
namespace {

// The scan doesn't exist, which is noticed only after the options are found to be right.
RemeshOptions right_options() {
  RemeshOptions options;
  options.scan = testing::TempDir() + "rattan-no-such-scan.ply";
  options.output = testing::TempDir() + "rattan-remesh-test.drc";
  return options;
}

TEST(Remesh, RefusesOptionsOutOfRange) {
  const std::function<void(RemeshOptions&)> wrong[] = {
      [](RemeshOptions& o) { o.scan.clear(); },
      [](RemeshOptions& o) { o.output.clear(); },
      [](RemeshOptions& o) { o.output = "remesh.xyz"; },
      [](RemeshOptions& o) { o.sizes.clear(); },
      [](RemeshOptions& o) {
        o.sizes = {1000.0, -1.0};
      },
      [](RemeshOptions& o) { o.sizes = {std::numeric_limits<double>::quiet_NaN()}; },
      [](RemeshOptions& o) { o.density = 17; },
      [](RemeshOptions& o) { o.symmetry = 3; },
      [](RemeshOptions& o) { o.smoothing = 1.0; },
      [](RemeshOptions& o) { o.crease = 2.0; },
      [](RemeshOptions& o) { o.newton_steps = -1; },
      [](RemeshOptions& o) { o.position_bits = 31; },
      [](RemeshOptions& o) { o.tile_size = 0; },
      [](RemeshOptions& o) { o.threads = -1; },
  };
  NullProgress progress;
  for (std::size_t i = 0; i < std::size(wrong); ++i) {
    RemeshOptions options = right_options();
    wrong[i](options);
    EXPECT_THROW(remesh(options, progress), UsageError) << i;
  }
}

TEST(Remesh, AMissingScanIsAnInputError) {
  NullProgress progress;
  const RemeshOptions options = right_options();
  EXPECT_THROW(remesh(options, progress), InputError);
  EXPECT_FALSE(std::filesystem::exists(options.output));
}

}  // namespace
}  // namespace rattan
