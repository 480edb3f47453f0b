// SPDX-License-Identifier: MIT
//
// The field and the phases as steps: taken up after any of them, with nothing of the run before but
// the store and the steps' results, they end the same.
#include "engine/core/steps.h"

#include <limits>
#include <map>

#include <gtest/gtest.h>

#include "engine/param/parameterize.h"
#include "engine/param/phase_fields.h"
#include "tests/engine/mesh/test_surfaces.h"

namespace rattan {
namespace {

using testing::bytes_of;
using testing::Surface;
using testing::TiledScan;

/// Remembers results; stops after so many steps.
class RecordedSteps final : public Steps {
 public:
  std::vector<std::pair<std::string, std::string>> log;
  std::map<std::string, std::uint64_t> passes;  ///< over the scan, by step
  std::size_t most = std::numeric_limits<std::size_t>::max();
  const TaskGraph* tasks = nullptr;

  /// The same job from its start.
  void restart() { next_ = 0; }

 protected:
  const std::string* begin(std::string_view name) override {
    if (next_ < log.size()) {
      EXPECT_EQ(log[next_].first, name);
      return &log[next_++].second;
    }
    before_ = tasks->passes();
    return nullptr;
  }
  void end(std::string_view name, std::string result) override {
    passes[std::string(name)] = tasks->passes() - before_;
    log.emplace_back(name, std::move(result));
    next_ = log.size();
    if (log.size() >= most) {
      throw Cancelled("Enough steps.");
    }
  }

 private:
  std::size_t next_ = 0;
  std::uint64_t before_ = 0;
};

struct Result {
  std::string phases;
  std::string board;
  std::vector<double> energies;
  bool operator==(const Result&) const = default;
};

Result run(TiledScan& scan, RecordedSteps& steps) {
  TaskGraph tasks({.threads = 2}, nullptr, {}, &steps);
  steps.tasks = &tasks;
  FieldOptions options;
  options.quad_side = 0.2;
  SurfaceField field = compute_field(scan.store, scan.mesh, options, tasks);
  field.reports.push_back(parameterize(scan.store, scan.mesh, field, {.omega = 0.4}, tasks));
  Result result;
  result.phases = bytes_of(scan.all(fields::kPhase));
  const auto board = read(scan.store, fields::kPhase, kBoardTile);
  result.board = bytes_of(std::vector<PairValue>(board.begin(), board.end()));
  for (const SolveReport& r : field.reports) {
    result.energies.push_back(r.energy);
    result.energies.push_back(static_cast<double>(r.passes + r.setup_passes));
  }
  return result;
}

TEST(FieldSteps, EndTheSameFromAnyOfThem) {
  const Surface s = testing::torus(60, 30, 2.0, 0.8);
  RecordedSteps whole;
  TiledScan undisturbed(s, 300);
  const Result expected = run(undisturbed, whole);
  ASSERT_GT(whole.log.size(), 10U);
  for (std::size_t most = 1; most < whole.log.size(); ++most) {
    TiledScan scan(s, 300);
    RecordedSteps steps;
    steps.most = most;
    EXPECT_THROW(run(scan, steps), Cancelled);
    steps.most = std::numeric_limits<std::size_t>::max();
    steps.restart();
    EXPECT_EQ(run(scan, steps), expected) << "after " << steps.log[most - 1].first;
    EXPECT_EQ(steps.log, whole.log);
  }
}

// What a kill costs at most: the sweeps of the finest level are a step of their own.
TEST(FieldSteps, PartTheFinestLevelFromTheRest) {
  TiledScan scan(testing::torus(60, 30, 2.0, 0.8), 300);
  RecordedSteps steps;
  run(scan, steps);
  for (const char* solve : {"smoothing", "phase"}) {
    EXPECT_EQ(steps.passes.at(std::string(solve) + " system"), 1U);
    EXPECT_EQ(steps.passes.at(std::string("coarse ") + solve), 1U);
    EXPECT_EQ(steps.passes.at(solve), 1U);
  }
  EXPECT_LE(steps.passes.at("hierarchy"), 1U);
  EXPECT_LE(steps.passes.at("curl"), 4U);
}

}  // namespace
}  // namespace rattan
