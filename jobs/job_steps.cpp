// SPDX-License-Identifier: MIT
#include "jobs/job_steps.h"

#include <algorithm>
#include <sys/stat.h>
#include <utility>

#include <fmt/format.h>

#include "engine/core/errors.h"

namespace rattan {

template <class A>
void members_of(A& a, Hdf5Store::FieldState& f) {
  a(f.name);
  a(f.changed);
}

template <class A>
void members_of(A& a, StageRecord& r) {
  a(r.name);
  a(r.seconds);
  a(r.cpu_seconds);
  a(r.passes);
  a(r.bytes_read);
  a(r.bytes_written);
  a(r.bytes_moved);
  a(r.resumed);
}

namespace {

constexpr const char* kLog = "steps";

}  // namespace

bool CheckpointPolicy::due(double since_last, double elapsed, double last_cost) const {
  if (forced_) {
    return since_last >= *forced_;
  }
  constexpr double kCostShare = 0.04;
  const double soonest = 4.0 + 0.04 * elapsed;
  const double latest = 4.5 + 0.07 * elapsed;
  return since_last >= std::clamp(last_cost / kCostShare, soonest, latest);
}

bool CheckpointPolicy::due_before_long_step(double since_last, double elapsed) const {
  // A run of a few seconds isn't worth a file.
  return !forced_ && elapsed > 4.0 && since_last >= 1.0 + 0.01 * elapsed;
}

JobSteps::JobSteps(Hdf5Store& store, std::stop_token stop, std::size_t most)
    : store_(store), stop_(std::move(stop)), start_(wall_seconds()), last_saved_(start_) {
  if (const auto saved = store_.note(kLog)) {
    unpack(*saved, log_);
  }
  std::size_t steps = std::min(most, log_.size());
  while (!usable(steps)) {
    --steps;
  }
  keep_first(steps);
}

/// Whether all that the first steps left is still in the store as it was then.
bool JobSteps::usable(std::size_t steps) const {
  if (steps == 0) {
    return true;
  }
  const auto now = store_.fields();
  const auto& then = log_[steps - 1].fields;
  return std::includes(now.begin(), now.end(), then.begin(), then.end());
}

void JobSteps::keep_first(std::size_t steps) {
  log_.resize(steps);
  const std::vector<Hdf5Store::FieldState> none;
  const auto& wanted = steps == 0 ? none : log_.back().fields;
  for (const Hdf5Store::FieldState& f : store_.fields()) {
    if (!std::binary_search(wanted.begin(), wanted.end(), f)) {
      store_.erase(f.name);
    }
  }
}

const std::string* JobSteps::begin(std::string_view name) {
  if (next_ < log_.size()) {
    const Entry& e = log_[next_];
    const bool same = e.name == name && e.inputs == inputs_ && e.made == makes_ &&
                      (makes_.empty() || file_identity(makes_) == e.made_identity);
    if (same) {
      makes_.clear();
      ++next_;
      ++resumed_;
      resumed_seconds_ += e.cost.seconds;
      if (clock_ != nullptr) {
        clock_->pass_over(e.cost);
      }
      return &e.result;
    }
    if (!usable(next_)) {
      throw Rewind{next_};
    }
    keep_first(next_);
  }
  return nullptr;
}

void JobSteps::end(std::string_view name, std::string result) {
  Entry& e = log_.emplace_back();
  e.name = name;
  e.inputs = inputs_;
  e.result = std::move(result);
  e.made = std::exchange(makes_, {});
  e.made_identity = file_identity(e.made);
  e.fields = store_.fields();
  if (clock_ != nullptr) {
    e.cost = clock_->lap();
  }
  next_ = log_.size();
  // With a file just written, little may be left to do.
  if (stop_.stop_requested() && e.made.empty()) {
    save();
    throw Cancelled("Interrupted after the step \"" + std::string(name) + "\"");
  }
  const double now = wall_seconds();
  if (policy_.due(now - last_saved_, resumed_seconds_ + now - start_, last_cost_)) {
    save_now();
  }
}

void JobSteps::before_long_step() {
  const double now = wall_seconds();
  // With steps of the log left, this one was done before.
  if (next_ == log_.size() && !log_.empty() &&
      policy_.due_before_long_step(now - last_saved_, resumed_seconds_ + now - start_)) {
    save_now();
  }
}

void JobSteps::save_now() {
  const double now = wall_seconds();
  checkpoint();
  last_saved_ = wall_seconds();
  last_cost_ = last_saved_ - now;
}

void JobSteps::check_ours() const {
  if (ours_ && !ours_()) {
    throw ResourceError(
        directory_ +
        ": another process took this work directory over while this one was suspended. Let that "
        "one finish, or give another directory with --work-dir.");
  }
}

void JobSteps::checkpoint() {
  check_ours();
  store_.set_note(kLog, pack(log_));
  store_.checkpoint();
}

void JobSteps::save() {
  checkpoint();
  store_.settle();
}

std::string file_identity(const std::string& path) {
  struct stat s {};
  if (path.empty() || ::stat(path.c_str(), &s) != 0) {
    return {};
  }
  return fmt::format("{} bytes, changed {}.{:09} {}.{:09}, file {}:{}", s.st_size, s.st_mtim.tv_sec,
                     s.st_mtim.tv_nsec, s.st_ctim.tv_sec, s.st_ctim.tv_nsec, s.st_dev, s.st_ino);
}

}  // namespace rattan
