// SPDX-License-Identifier: MIT
#pragma once

// The steps of a job, as engine/core/steps.h wants them, with checkpoints of the store in between.

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "engine/core/steps.h"
#include "io/store/hdf5_store.h"
#include "jobs/stage_clock.h"

namespace rattan {

/// When work is saved. A run of a few seconds never is. A kill costs at most the longest wait, the
/// step in which it falls, and reading back: a tenth of the run and 5 s.
class CheckpointPolicy {
 public:
  /// Wait so many seconds instead; 0: save after every step.
  void force(double seconds) { forced_ = seconds; }
  /// `last_cost`: what the checkpoint before took, in seconds; where the disk is slow they come
  /// less often, within the promise.
  bool due(double since_last, double elapsed, double last_cost) const;
  /// Whether to save already because a long step follows, in which nothing can be.
  bool due_before_long_step(double since_last, double elapsed) const;

 private:
  std::optional<double> forced_;
};

/// The work in the store doesn't fit what the job now asks for: start again with the first `steps`
/// of them.
struct Rewind {
  std::size_t steps = 0;
};

/// Keeps a log: of each step its name, what it depends on, its result, its cost, and the state of
/// the store's fields after it. A step counts as done if its name and what it depends on are as in
/// the log, and so were those of all steps before. Saved work can be taken up after any step whose
/// fields are all still as that step left them; usually the last.
class JobSteps final : public Steps {
 public:
  /// Takes up what the store holds, but at most so many steps.
  JobSteps(Hdf5Store& store, std::stop_token stop,
           std::size_t most = std::numeric_limits<std::size_t>::max());

  /// Steps from now on give their costs to its stages.
  void attach(StageClock& clock) { clock_ = &clock; }
  CheckpointPolicy& policy() { return policy_; }
  /// `ours` is asked before anything is saved: whether the work directory is still this process's.
  void save_only_if(std::function<bool()> ours, std::string directory) {
    ours_ = std::move(ours);
    directory_ = std::move(directory);
  }
  /// Throws ResourceError if it isn't.
  void check_ours() const;

  /// What the result of the steps from now on depends on, besides the steps before: options and
  /// inputs as text.
  void depend_on(std::string inputs) { inputs_ = std::move(inputs); }
  /// The next step makes this file: done only as long as that is as it was.
  void next_makes(std::string path) { makes_ = std::move(path); }

  void before_long_step() override;

  /// Steps that an earlier run did and this one passed over.
  std::size_t resumed() const { return resumed_; }
  /// Saves all and waits until that is on disk.
  void save();

 protected:
  const std::string* begin(std::string_view name) override;
  void end(std::string_view name, std::string result) override;

 private:
  struct Entry {
    std::string name;
    std::string inputs;
    std::string result;
    std::string made;           ///< path of a file
    std::string made_identity;  ///< of that file
    StageRecord cost;
    std::vector<Hdf5Store::FieldState> fields;
  };
  template <class A>
  friend void members_of(A& a, Entry& e) {
    a(e.name);
    a(e.inputs);
    a(e.result);
    a(e.made);
    a(e.made_identity);
    a(e.cost);
    a(e.fields);
  }

  bool usable(std::size_t steps) const;
  void keep_first(std::size_t steps);
  void checkpoint();
  void save_now();

  Hdf5Store& store_;
  std::stop_token stop_;
  StageClock* clock_ = nullptr;
  CheckpointPolicy policy_;
  std::function<bool()> ours_;
  std::string directory_;
  std::vector<Entry> log_;
  std::size_t next_ = 0;
  std::size_t resumed_ = 0;
  std::string inputs_;
  std::string makes_;
  double start_;
  double last_saved_;
  double last_cost_ = 0.0;
  double resumed_seconds_ = 0.0;
};

/// Size, times and place of a file, which change whenever its content does; empty if there is none.
std::string file_identity(const std::string& path);

}  // namespace rattan
