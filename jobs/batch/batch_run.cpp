// SPDX-License-Identifier: MIT
#include "jobs/batch/batch_run.h"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <memory>
#include <poll.h>
#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "engine/core/errors.h"
#include "engine/core/memory_budget.h"
#include "engine/core/resident_memory.h"
#include "jobs/batch/admission.h"
#include "jobs/batch/batch_files.h"
#include "jobs/batch/batch_signals.h"
#include "jobs/batch/child_log.h"
#include "jobs/batch/child_process.h"
#include "jobs/batch/claims.h"
#include "jobs/batch/item_states.h"
#include "jobs/batch/verdict.h"
#include "jobs/exit_codes.h"
#include "jobs/memory_share.h"

namespace rattan {

namespace fs = std::filesystem;

namespace {

// Seconds.
constexpr double kTick = 1.0;
constexpr double kLeastTick = 0.1;
constexpr double kLookAgain = 0.5;   ///< at scans that other processes have
constexpr double kOneRequest = 2.0;  ///< signals within this are one: Slurm sends several
constexpr double kPatience = 9.3;    ///< of the ten that are promised for stopping
constexpr double kLastPatience = 1.0;
/// Attempts of one run at a scan whose child was asked to stop by somebody else.
constexpr int kMostInterruptions = 3;
/// What a child may fill at least; it says itself that this is too little.
constexpr std::uint64_t kLeastGrant = std::uint64_t{1} << 20;
/// Claims that are kept until the journal is on the disk: each has a thread.
constexpr std::size_t kMostReleased = 16;
/// What this process grows by at most while it runs.
constexpr std::uint64_t kGrowth = std::uint64_t{12} << 20;

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

int available_processors() {
  cpu_set_t set;
  CPU_ZERO(&set);
  return ::sched_getaffinity(0, sizeof(set), &set) == 0 ? std::max(CPU_COUNT(&set), 1) : 1;
}

double cpu_seconds_of(int who) {
  struct rusage used {};
  ::getrusage(who, &used);
  return static_cast<double>(used.ru_utime.tv_sec + used.ru_stime.tv_sec) +
         1e-6 * static_cast<double>(used.ru_utime.tv_usec + used.ru_stime.tv_usec);
}

class BatchRun {
 public:
  BatchRun(const std::vector<BatchItem>& items, const BatchRunOptions& options)
      : items_(items),
        options_(options),
        states_(items_, options_.directory),
        journal_(options_.directory, JournalWriter::Sync::kByHand),
        started_(now()),
        host_(this_host()),
        slurm_(slurm_task()),
        identity_(rattan_identity()) {}

  int run() {
    make_directory();
    states_.refresh();
    states_.begin();
    choose();
    set_limits();
    begin();
    try {
      loop();
    } catch (...) {
      stop_children();
      throw;
    }
    return end();
  }

 private:
  struct Child {
    std::size_t task = 0;
    Attempt attempt;
    std::unique_ptr<Claim> claim;
    std::unique_ptr<ChildProcess> process;
    ChildLog log;
    double start = 0.0;
    bool killed_by_us = false;
  };

  const BatchItem& item_of(std::size_t task) const { return items_[todo_[task]]; }

  template <class Call>
  void tell(Call&& call) const {
    for (BatchObserver* observer : options_.observers) {
      call(*observer);
    }
  }
  void warn(const std::string& sentence) const {
    tell([&](BatchObserver& o) { o.warning(sentence); });
  }

  void make_directory() const {
    std::error_code error;
    fs::create_directories(options_.directory, error);
    if (error) {
      throw ResourceError(fmt::format("{}: the folder cannot be made ({}). Choose another with -o.",
                                      options_.directory, error.message()));
    }
  }

  void choose() {
    for (std::size_t i = 0; i < items_.size(); ++i) {
      const Standing standing = states_.look(i, options_);
      if (to_do(standing)) {
        todo_.push_back(static_cast<std::uint32_t>(i));
      } else if (standing == Standing::kDone) {
        ++state_.before;
      } else {
        ++state_.failed_before;
        exit_ = worse(exit_, states_.exit(i));
      }
    }
  }

  void set_limits() {
    limits_.threads = options_.threads > 0 ? options_.threads : available_processors();
    limits_.jobs = options_.jobs;
    memory_ = options_.memory > 0 ? options_.memory : default_memory_share();
    std::vector<Admission::Task> tasks;
    tasks.reserve(todo_.size());
    for (const std::uint32_t i : todo_) {
      const RemeshOptions& asked = items_[i].what->remesh;
      tasks.push_back({forecast(items_[i]), asked.threads, asked.memory});
    }
    own_memory_ = resident_bytes() + tasks.size() * sizeof(Admission::Task) + kGrowth;
    limits_.memory = memory_ > own_memory_ ? memory_ - own_memory_ : 0;
    admission_ = std::make_unique<Admission>(limits_);
    interruptions_.assign(tasks.size(), 0);
    admission_->set_tasks(std::move(tasks));
  }

  BatchRecord batch_record(const char* action) const {
    BatchRecord r;
    r.action = action;
    r.time = unix_seconds();
    r.host = host_;
    r.pid = ::getpid();
    r.slurm = slurm_;
    r.items = items_.size();
    r.total = options_.total > 0 ? options_.total : items_.size();
    r.shard = options_.shard;
    r.shards = options_.shards;
    r.threads = limits_.threads;
    r.memory = memory_;
    r.cost = admission_->cost_waiting();
    return r;
  }

  void begin() {
    state_.items = items_.size();
    state_.threads = limits_.threads;
    state_.memory = memory_;
    journal_.append(batch_record("begin"));
    update_state();
    tell([&](BatchObserver& o) { o.begun(state_); });
  }

  int end() {
    update_state();
    const bool all = admission_->waiting() == 0 && deferred_.empty();
    int exit = exit_;
    if (stopping_since_ > 0.0 && (!all || state_.interrupted > 0)) {
      exit = kExitInterrupted;
    } else if (exit_ == kExitUsage) {
      exit = kExitInput;
    }
    BatchRecord record = batch_record("end");
    record.seconds = now() - started_;
    record.cpu_seconds = cpu_seconds_of(RUSAGE_SELF) + cpu_seconds_of(RUSAGE_CHILDREN);
    record.exit = exit;
    journal_.append(record);
    settle();
    drop_old_claims();
    tell([&](BatchObserver& o) { o.finished(state_, exit); });
    return exit;
  }

  /// A batch that was killed between a scan's last line in the journal and the end of its claim
  /// leaves one that nobody takes again. Those of the living stay.
  void drop_old_claims() {
    for (const BatchItem& item : items_) {
      if (Claim::left(options_.directory, item.id)) {
        Claim::take(options_.directory, item.id);
      }
    }
  }

  bool stopping() const { return stopping_since_ > 0.0; }

  void loop() {
    for (;;) {
      if (!stopping()) {
        start_what_fits();
      }
      settle();
      if (children_.empty() && (stopping() || (admission_->waiting() == 0 && deferred_.empty()))) {
        return;
      }
      wait();
      for (int signal = signals_.next(); signal != 0; signal = signals_.next()) {
        if (signal != SIGCHLD) {
          request_stop();
        }
      }
      for (Child& child : children_) {
        child.process->read_lines([&](std::string_view line) { take_line(child, line); });
      }
      reap();
      if (stopping() && now() > give_up_at_) {
        for (Child& child : children_) {
          child.killed_by_us = true;
          child.process->send(SIGKILL);
        }
      }
      tick(false);
    }
  }

  // Records reach the disk, and only then others may have what ended: all of this after the next
  // children were started, so that nobody waits for it.
  void settle() {
    journal_.sync();
    released_.clear();
  }

  void start_what_fits() {
    const double t = now();
    if (!deferred_.empty() && t >= look_again_at_) {
      look_at_deferred();
    }
    if (blocked_until_ > t) {
      return;
    }
    while (auto grant = admission_->next(now())) {
      if (!start(*grant)) {
        return;
      }
      if (released_.size() >= kMostReleased) {
        settle();
      }
      // A request to stop may have come while many were passed over.
      if (pending_signal()) {
        return;
      }
    }
  }

  bool pending_signal() const {
    pollfd p{signals_.descriptor(), POLLIN, 0};
    return ::poll(&p, 1, 0) > 0;
  }

  // Scans that another process had when their turn came.
  void look_at_deferred() {
    states_.refresh();
    look_again_at_ = now() + kLookAgain;
    std::vector<std::uint32_t> still;
    for (const std::uint32_t task : deferred_) {
      const std::size_t i = todo_[task];
      if (!to_do(states_.standing(i, options_))) {
        settle_elsewhere(i);
      } else if (!Claim::holder(options_.directory, items_[i].id) &&
                 !work_in_use(ItemFiles(items_[i], options_).work)) {
        admission_->put_back(task, false);
      } else {
        still.push_back(task);
      }
    }
    deferred_ = std::move(still);
  }

  void settle_elsewhere(std::size_t item) {
    const int exit = states_.exit(item);
    if (exit == kExitDone) {
      ++state_.before;
    } else {
      ++state_.failed_before;
      exit_ = worse(exit_, exit);
    }
  }

  void defer(std::size_t task) {
    admission_->drop(task);
    deferred_.push_back(static_cast<std::uint32_t>(task));
    if (deferred_.size() == 1) {
      look_again_at_ = now() + kLookAgain;
    }
  }

  // False if nothing more is to be started for now.
  bool start(const Admission::Grant& grant) {
    const std::size_t i = todo_[grant.task];
    const BatchItem& item = items_[i];
    if (!to_do(states_.standing(i, options_))) {  // somebody else was quicker
      admission_->drop(grant.task);
      settle_elsewhere(i);
      return true;
    }
    const ItemFiles files(item, options_);
    Child child;
    child.task = grant.task;
    try {
      child.claim = Claim::take(options_.directory, item.id);
      if (!child.claim && !released_.empty()) {  // it may be our own
        settle();
        child.claim = Claim::take(options_.directory, item.id);
      }
    } catch (const ResourceError& e) {  // as for a name that is too long
      child.attempt.sentence = e.what();
    }
    if (child.attempt.sentence.empty() && (!child.claim || work_in_use(files.work))) {
      defer(grant.task);
      return true;
    }
    states_.refresh();
    if (!to_do(states_.standing(i, options_))) {
      admission_->drop(grant.task);
      settle_elsewhere(i);
      return true;
    }
    Attempt& attempt = child.attempt;
    attempt.started = unix_seconds();
    attempt.threads = grant.threads;
    attempt.memory = std::max(grant.memory, kLeastGrant);
    const Forecast& f = admission_->task(grant.task).forecast;
    attempt.cost = f.cpu_seconds;
    attempt.triangles = f.triangles;
    if (adopt(i, files, child)) {
      return true;
    }
    attempt.number = states_.attempts(i) + 1;
    // Whatever lies there from now on is of this attempt.
    ::unlink(files.report.c_str());
    record_start(item, attempt);
    child.start = now();
    if (!admission_->possible(grant.task) && f.counted) {
      refuse(child, files);
      return true;
    }
    try {
      if (!attempt.sentence.empty()) {
        throw ResourceError(attempt.sentence);
      }
      files.make_folders();
      attempt.command = child_command(item, options_, attempt.threads, attempt.memory,
                                      options_.fresh && interruptions_[grant.task] == 0);
      child.process = std::make_unique<ChildProcess>(attempt.command, options_.program.empty());
    } catch (const NoProcess& e) {
      // There may be room for one when others have ended.
      attempt.exit = children_.empty() ? kExitResource : kExitInterrupted;
      attempt.sentence = e.what();
      blocked_until_ = now() + kTick;
      finish(child, files);
      return false;
    } catch (const ResourceError& e) {
      attempt.exit = kExitResource;
      attempt.sentence = e.what();
      finish(child, files);
      return true;
    }
    attempt.pid = child.process->pid();
    tell([&](BatchObserver& o) { o.started(item, attempt); });
    children_.push_back(std::move(child));
    return true;
  }

  void record_start(const BatchItem& item, const Attempt& attempt) {
    StartRecord r;
    r.time = attempt.started;
    r.id = item.id;
    r.scan = item.scan;
    r.scan_bytes = item.scan_bytes;
    r.scan_time = item.scan_time;
    r.key = item.what->key;
    r.options = item.what->words;
    r.attempt = attempt.number;
    r.host = host_;
    r.pid = ::getpid();
    r.slurm = slurm_;
    r.threads = attempt.threads;
    r.memory = attempt.memory;
    r.cost = attempt.cost;
    r.triangles = attempt.triangles;
    r.rattan = identity_;
    journal_.append(r);
  }

  // The child outlived the process that had started it, and finished.
  bool adopt(std::size_t i, const ItemFiles& files, Child& child) {
    FoundReport found;
    if (!states_.may_have_finished(i) || !finished_unseen(items_[i], options_, found)) {
      return false;
    }
    child.attempt.number = states_.attempts(i);
    child.attempt.adopted = true;
    child.attempt.seconds = found.seconds;
    child.attempt.peak_rss_bytes = found.peak_rss_bytes;
    child.attempt.warnings = found.warnings;
    child.attempt.outputs = written_outputs(items_[i], options_);
    // It may have been killed just before it would have done so itself.
    if (!items_[i].what->remesh.keep_work) {
      std::error_code ignored;
      fs::remove_all(files.work, ignored);
    }
    finish(child, files);
    return true;
  }

  void refuse(Child& child, const ItemFiles& files) {
    const Admission::Task& task = admission_->task(child.task);
    const std::uint64_t least = task.memory > 0 ? task.memory : task.forecast.least_memory;
    child.attempt.exit = kExitResource;
    child.attempt.sentence = fmt::format(
        "{}: this scan needs at least {} of memory, and {} are left for scans of the batch's {}. "
        "Allow --memory {}MiB, or ask for fewer faces.",
        item_of(child.task).scan, format_bytes(least), format_bytes(limits_.memory),
        format_bytes(memory_), ((least + own_memory_) >> 20) + 1);
    finish(child, files);
  }

  void take_line(Child& child, std::string_view line) {
    nlohmann::json event;
    if (child.log.take(line, event)) {
      tell([&](BatchObserver& o) { o.line(item_of(child.task), child.attempt, event); });
    }
  }

  void wait() {
    std::vector<pollfd> files = {{signals_.descriptor(), POLLIN, 0}};
    for (const Child& child : children_) {
      if (child.process->errors() >= 0) {
        files.push_back({child.process->errors(), POLLIN, 0});
      }
    }
    const double t = now();
    double until = next_tick_;
    if (!deferred_.empty() && !stopping()) {
      until = std::min(until, look_again_at_);
    }
    if (stopping()) {
      until = std::min(until, std::max(give_up_at_, t + 0.05));
    }
    const double wait = std::clamp(until - t, 0.0, kTick);
    ::poll(files.data(), files.size(), static_cast<int>(1e3 * wait) + 1);
  }

  void reap() {
    for (std::size_t c = 0; c < children_.size();) {
      Child& child = children_[c];
      if (!child.process->reap([&](std::string_view line) { take_line(child, line); })) {
        ++c;
        continue;
      }
      Child ended = std::move(child);
      children_.erase(children_.begin() + static_cast<std::ptrdiff_t>(c));
      judge(ended);
    }
  }

  // What became of a child that ended, and whether it gets another chance in this run.
  void judge(Child& child) {
    const BatchItem& item = item_of(child.task);
    const ItemFiles files(item, options_);
    const ChildProcess& process = *child.process;
    Attempt& a = child.attempt;
    a.seconds = now() - child.start;
    a.cpu_seconds = process.cpu_seconds();
    a.peak_rss_bytes =
        child.log.peak_rss_bytes() > 0 ? child.log.peak_rss_bytes() : process.peak_rss_bytes();
    a.warnings = child.log.warnings();
    a.sentence = child.log.sentence();
    if (process.was_signalled()) {
      a.signal = process.signal();
      judge_signal(
          a, item.scan,
          child.killed_by_us || (stopping() && (a.signal == SIGTERM || a.signal == SIGKILL)));
    } else {
      a.exit = process.exit_code();
      if (a.exit != kExitDone && a.exit != kExitUsage && a.exit != kExitInput &&
          a.exit != kExitResource && a.exit != kExitInterrupted) {
        a.exit = kExitDefect;
      }
    }
    if (a.exit == kExitDone) {
      a.sentence.clear();
      a.outputs = written_outputs(item, options_);
      if (a.outputs.size() != item_outputs(item).size()) {
        a.exit = kExitDefect;
        a.sentence = "the run said that it was done, but not all outputs are there";
      }
    } else if (a.sentence.empty()) {
      a.sentence =
          fmt::format("{}: the run ended with exit code {} and said nothing.", item.scan, a.exit);
    }
    finish(child, files);
  }

  // The attempt ended one way or the other: says so to everyone.
  void finish(Child& child, const ItemFiles& files) {
    const BatchItem& item = item_of(child.task);
    Attempt& a = child.attempt;
    if (a.exit == kExitDone) {
      ::unlink(files.log.c_str());
    } else if (a.exit != kExitInterrupted) {
      write_log(child, files);
    }
    EndRecord r;
    r.time = unix_seconds();
    r.id = item.id;
    r.attempt = a.number;
    r.host = host_;
    r.pid = ::getpid();
    r.exit = a.exit;
    r.sentence = a.sentence;
    r.seconds = a.seconds;
    r.cpu_seconds = a.cpu_seconds;
    r.peak_rss_bytes = a.peak_rss_bytes;
    r.outputs = a.outputs;
    r.warnings = a.warnings;
    r.adopted = a.adopted;
    journal_.append(r);
    const bool again = retry(child);
    released_.push_back(std::move(child.claim));
    if (!again) {
      count(child);
    }
    tell([&](BatchObserver& o) { o.ended(item, a); });
    tick(true);
  }

  // A run that was stopped by somebody else, or whose memory was too little because the forecast
  // was wrong, is made again; a work directory in use is waited for.
  bool retry(const Child& child) {
    const Attempt& a = child.attempt;
    if (stopping()) {
      return false;
    }
    states_.expect_again(todo_[child.task], a.number);
    if (a.exit == kExitInterrupted && ++interruptions_[child.task] < kMostInterruptions) {
      admission_->put_back(child.task, false);
      return true;
    }
    if (a.exit != kExitResource || a.signal != 0 || a.pid == 0) {
      return false;
    }
    if (a.sentence.find("the work directory is in use") != std::string::npos) {
      defer(child.task);
      return true;
    }
    const bool too_little = a.sentence.find("--memory") != std::string::npos;
    if (too_little && a.memory < limits_.memory && admission_->task(child.task).memory == 0) {
      admission_->put_back(child.task, true);
      return true;
    }
    return false;
  }

  void count(const Child& child) {
    const Attempt& a = child.attempt;
    admission_->ended(child.task);
    state_.cpu_seconds += a.cpu_seconds;
    switch (a.exit) {
      case kExitDone:
        ++state_.done;
        state_.cost_done += a.cost;
        state_.triangles_done += a.triangles;
        if (!a.adopted) {
          foreseen_ += a.cost;
          taken_ += a.cpu_seconds;
          admission_->set_pace(std::clamp(taken_ / std::max(foreseen_, 1e-9), 0.1, 20.0));
        }
        break;
      case kExitUsage:
      case kExitInput:
        ++state_.unusable;
        break;
      case kExitResource:
        ++state_.resource;
        break;
      case kExitInterrupted:
        ++state_.interrupted;
        break;
      default:
        ++state_.defect;
    }
    // Stopped by somebody else again and again: left to the next run.
    exit_ = worse(exit_, a.exit != kExitInterrupted ? a.exit
                         : stopping()               ? kExitDone
                                                    : kExitResource);
  }

  void write_log(Child& child, const ItemFiles& files) const {
    Attempt& a = child.attempt;
    const BatchItem& item = item_of(child.task);
    std::string text = fmt::format("{}\n{}\n\n{}\n", item.scan, identity_,
                                   a.command.empty() ? "" : shell_command(a.command));
    text += child.log.text();
    text += fmt::format(
        "\nattempt {} on {}, {} threads, {} of memory: exit {} after {:.1f} s\n{}\n", a.number,
        host_, a.threads, format_bytes(a.memory), a.exit, a.seconds, a.sentence);
    std::error_code ignored;
    fs::create_directories(fs::path(files.log).parent_path(), ignored);
    if (write_text(files.log, text)) {
      a.log = files.log;
    }
  }

  void request_stop() {
    const double t = now();
    if (!stopping()) {
      stopping_since_ = t;
      give_up_at_ = t + kPatience;
      state_.stopping = true;
      warn("stopping, and saving the work. Another signal stops at once.");
    } else if (t - stopping_since_ < kOneRequest) {
      return;
    } else {
      give_up_at_ = std::min(give_up_at_, t + kLastPatience);
    }
    for (const Child& child : children_) {
      child.process->send(SIGTERM);
    }
  }

  // After an error of the batch itself: their work is saved, and nobody writes the journal.
  void stop_children() {
    for (const Child& child : children_) {
      child.process->send(SIGTERM);
    }
    const double until = now() + kPatience;
    const auto ignore = [](std::string_view) {};
    while (!children_.empty() && now() < until) {
      std::erase_if(children_, [&](Child& child) { return child.process->reap(ignore); });
      ::usleep(20000);
    }
  }

  void update_state() {
    const double t = now();
    state_.running = children_.size();
    state_.elsewhere = deferred_.size();
    state_.pending = admission_->waiting();
    state_.threads_used = admission_->threads_used();
    state_.memory_used = admission_->memory_used();
    state_.seconds = t - started_;
    double left = admission_->cost_waiting();
    double begun = 0.0;
    for (const Child& child : children_) {
      const double foreseen = std::max(
          forecast_seconds(admission_->task(child.task).forecast, child.attempt.threads) * pace(),
          1e-3);
      const double part = std::min((t - child.start) / foreseen, 0.95);
      left += child.attempt.cost * (1.0 - part);
      begun += child.attempt.cost * part;
    }
    state_.cost_left = left;
    const double made = state_.cost_done + begun;
    state_.seconds_left =
        left <= 0.0 ? 0.0
                    : (state_.seconds > 1.0 && made > 0.0 ? left * state_.seconds / made : -1.0);
  }

  double pace() const { return foreseen_ > 0.0 ? taken_ / foreseen_ : 1.0; }

  void tick(bool news) {
    const double t = now();
    if (t < next_tick_ && !(news && t > last_tick_ + kLeastTick)) {
      return;
    }
    last_tick_ = t;
    next_tick_ = t + kTick;
    update_state();
    tell([&](BatchObserver& o) { o.tick(state_); });
  }

  const std::vector<BatchItem>& items_;
  BatchRunOptions options_;
  ItemStates states_;
  JournalWriter journal_;
  BatchSignals signals_;
  double started_;
  std::string host_;
  std::string slurm_;
  std::string identity_;

  std::vector<std::uint32_t> todo_;  ///< items; the admission's tasks are positions in it
  std::vector<std::uint8_t> interruptions_;
  std::unique_ptr<Admission> admission_;
  Admission::Limits limits_;
  std::uint64_t memory_ = 0;
  std::uint64_t own_memory_ = 0;
  std::vector<Child> children_;
  std::vector<std::unique_ptr<Claim>> released_;  ///< of what ended, until that is on the disk
  std::vector<std::uint32_t> deferred_;           ///< tasks that other processes have
  BatchState state_;
  int exit_ = kExitDone;
  double foreseen_ = 0.0;
  double taken_ = 0.0;
  double look_again_at_ = 0.0;
  double blocked_until_ = 0.0;
  double next_tick_ = 0.0;
  double last_tick_ = 0.0;
  double stopping_since_ = 0.0;
  double give_up_at_ = 0.0;
};

BatchRunOptions with_absolute_folders(BatchRunOptions options) {
  options.directory = fs::absolute(options.directory).lexically_normal().string();
  while (options.directory.size() > 1 && options.directory.back() == '/') {
    options.directory.pop_back();
  }
  if (!options.work_directory.empty()) {
    options.work_directory = fs::absolute(options.work_directory).lexically_normal().string();
  }
  return options;
}

}  // namespace

std::vector<Standing> plan_batch(const std::vector<BatchItem>& items,
                                 const BatchRunOptions& options) {
  ItemStates states(items, options.directory);
  states.refresh();
  states.begin();
  std::vector<Standing> plan;
  plan.reserve(items.size());
  for (std::size_t i = 0; i < items.size(); ++i) {
    plan.push_back(states.look(i, options));
  }
  return plan;
}

int run_batch(const std::vector<BatchItem>& items, const BatchRunOptions& options) {
  return BatchRun(items, with_absolute_folders(options)).run();
}

}  // namespace rattan
