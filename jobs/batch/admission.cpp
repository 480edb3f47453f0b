// SPDX-License-Identifier: MIT
#include "jobs/batch/admission.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace rattan {

namespace {

/// By how much of its share a scan may be too large before it gets another thread: beside others
/// it uses one thread better than two alone.
constexpr double kTolerance = 0.25;
/// Candidates that are looked at to fill a gap.
constexpr std::size_t kMostLookedAt = 2000;
constexpr std::uint64_t kMiB = std::uint64_t{1} << 20;

/// What a scan can use, with room for a forecast that is a little off.
std::uint64_t useful(const Forecast& f) {
  return f.good_memory + f.good_memory / 4 + 32 * kMiB;
}

}  // namespace

void Admission::set_tasks(std::vector<Task> tasks) {
  tasks_ = std::move(tasks);
  queue_.resize(tasks_.size());
  std::iota(queue_.begin(), queue_.end(), 0U);
  std::stable_sort(queue_.begin(), queue_.end(), [&](std::uint32_t a, std::uint32_t b) {
    return tasks_[a].forecast.cpu_seconds > tasks_[b].forecast.cpu_seconds;
  });
  head_ = 0;
  again_.clear();
  state_.assign(tasks_.size(), State::kWaiting);
  alone_.assign(tasks_.size(), false);
  waiting_ = tasks_.size();
  cost_waiting_ = 0.0;
  for (const Task& task : tasks_) {
    cost_waiting_ += task.forecast.cpu_seconds;
  }
}

void Admission::put_back(std::size_t task, bool alone) {
  ended(task);
  state_[task] = State::kAgain;
  alone_[task] = alone;
  again_.push_back(static_cast<std::uint32_t>(task));
  ++waiting_;
  cost_waiting_ += tasks_[task].forecast.cpu_seconds;
}

std::uint64_t Admission::need(std::size_t task) const {
  const Task& t = tasks_[task];
  return t.memory > 0 ? t.memory : t.forecast.least_memory;
}

double Admission::duration(std::size_t task, int threads) const {
  return pace_ * forecast_seconds(tasks_[task].forecast, threads);
}

Admission::Wish Admission::wish(std::size_t task, double now) const {
  const int all = limits_.threads;
  if (alone_[task]) {
    return {all, limits_.memory};
  }
  const std::uint64_t least = std::min(need(task), limits_.memory);
  if (tasks_[task].threads > 0) {
    return {std::min(tasks_[task].threads, all), least};
  }
  double left = cost_waiting_ * pace_;
  for (const Running& r : running_) {
    left += std::max(r.end - now, 0.0) * r.threads;
  }
  const double share = pace_ * tasks_[task].forecast.cpu_seconds / std::max(left, 1e-9);
  const int by_share = static_cast<int>(std::ceil(share * all - kTolerance));
  // However many wait, no more than these can run at once.
  std::size_t at_once = waiting_ + running_.size();
  if (limits_.jobs > 0) {
    at_once = std::min(at_once, static_cast<std::size_t>(limits_.jobs));
  }
  if (least > 0) {
    at_once = std::min(at_once, static_cast<std::size_t>(limits_.memory / least));
  }
  const int even = all / static_cast<int>(std::clamp<std::size_t>(at_once, 1, 1U << 20U));
  return {std::clamp(std::max(by_share, even), 1, all), least};
}

bool Admission::fits(const Wish& wish) const {
  return wish.threads <= limits_.threads - threads_used_ &&
         wish.least <= limits_.memory - memory_used_;
}

Admission::Opening Admission::opening(const Wish& wish, double now) const {
  std::vector<Running> by_end = running_;
  std::sort(by_end.begin(), by_end.end(),
            [](const Running& a, const Running& b) { return a.end < b.end; });
  Opening open{now, limits_.threads - threads_used_, limits_.memory - memory_used_};
  for (const Running& r : by_end) {
    if (wish.threads <= open.threads && wish.least <= open.memory) {
      break;
    }
    open.time = std::max(r.end, now);
    open.threads += r.threads;
    open.memory += r.memory;
  }
  open.threads -= wish.threads;
  open.memory -= std::min(wish.least, open.memory);
  return open;
}

Admission::Grant Admission::grant(std::size_t task, const Wish& wish, double now) {
  const std::uint64_t memory_left = limits_.memory - memory_used_;
  const int threads_left = limits_.threads - threads_used_;
  Grant g{task, wish.threads, memory_left};
  const bool everything = wish.threads == limits_.threads && running_.empty();
  if (tasks_[task].memory > 0 && !alone_[task]) {
    g.memory = std::min(tasks_[task].memory, memory_left);
  } else if (!everything) {
    // As many as can start beside it shall find as much.
    std::size_t sharers =
        static_cast<std::size_t>((threads_left + wish.threads - 1) / std::max(wish.threads, 1));
    sharers = std::min(sharers, waiting_);
    if (limits_.jobs > 0) {
      sharers = std::min(sharers, static_cast<std::size_t>(limits_.jobs) - running_.size());
    }
    const std::uint64_t even = memory_left / std::max<std::size_t>(sharers, 1);
    g.memory = std::clamp(even, std::min(wish.least, memory_left),
                          std::max(useful(tasks_[task].forecast), wish.least));
    g.memory = std::min(g.memory, memory_left);
  }
  state_[task] = State::kTaken;
  --waiting_;
  cost_waiting_ = waiting_ == 0 ? 0.0 : cost_waiting_ - tasks_[task].forecast.cpu_seconds;
  running_.push_back({task, g.threads, g.memory, now + duration(task, g.threads)});
  threads_used_ += g.threads;
  memory_used_ += g.memory;
  return g;
}

std::optional<Admission::Grant> Admission::next(double now) {
  if (waiting_ == 0 || threads_used_ >= limits_.threads ||
      (limits_.jobs > 0 && running_.size() >= static_cast<std::size_t>(limits_.jobs))) {
    return std::nullopt;
  }
  while (head_ < queue_.size() && !is_waiting(queue_[head_])) {
    ++head_;
  }
  std::erase_if(again_, [&](std::uint32_t task) { return state_[task] != State::kAgain; });
  const bool from_queue = head_ < queue_.size();
  const std::size_t first = from_queue ? queue_[head_] : again_.front();
  Wish wanted = wish(first, now);
  if (fits(wanted)) {
    return grant(first, wanted, now);
  }
  const int threads_left = limits_.threads - threads_used_;
  Opening open = opening(wanted, now);
  // Fewer threads now may be sooner done than more of them later.
  if (wanted.threads > threads_left && !alone_[first] && tasks_[first].threads == 0) {
    const Wish fewer{threads_left, wanted.least};
    if (fits(fewer) &&
        now + duration(first, threads_left) <= open.time + duration(first, wanted.threads)) {
      return grant(first, fewer, now);
    }
  }
  const auto may_go_first = [&](std::size_t task) -> std::optional<Wish> {
    if (task == first || alone_[task]) {
      return std::nullopt;
    }
    Wish w = wish(task, now);
    w.threads = std::min(w.threads, threads_left);
    if (!fits(w)) {
      return std::nullopt;
    }
    const bool beside = w.threads <= open.threads && w.least <= open.memory;
    const bool before = now + duration(task, w.threads) <= open.time;
    return beside || before ? std::optional(w) : std::nullopt;
  };
  // What runs beside the largest later takes no more than is left over then.
  const auto go = [&](std::size_t task, const Wish& w) {
    const bool before = now + duration(task, w.threads) <= open.time;
    Task& t = tasks_[task];
    const std::uint64_t stated = t.memory;
    if (!before && stated == 0) {
      t.memory = std::max(w.least, std::min(open.memory, useful(t.forecast)));
    }
    const Grant g = grant(task, w, now);
    t.memory = stated;
    return g;
  };
  std::size_t looked_at = 0;
  for (std::size_t at = head_ + 1; at < queue_.size() && looked_at < kMostLookedAt; ++at) {
    if (!is_waiting(queue_[at])) {
      continue;
    }
    ++looked_at;
    if (const auto w = may_go_first(queue_[at])) {
      return go(queue_[at], *w);
    }
  }
  for (const std::uint32_t task : again_) {
    if (const auto w = may_go_first(task)) {
      return go(task, *w);
    }
  }
  return std::nullopt;
}

void Admission::ended(std::size_t task) {
  const auto at = std::find_if(running_.begin(), running_.end(),
                               [&](const Running& r) { return r.task == task; });
  if (at != running_.end()) {
    threads_used_ -= at->threads;
    memory_used_ -= at->memory;
    running_.erase(at);
  }
}

}  // namespace rattan
