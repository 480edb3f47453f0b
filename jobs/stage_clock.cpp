// SPDX-License-Identifier: MIT
#include "jobs/stage_clock.h"

#include <chrono>
#include <exception>
#include <sys/resource.h>
#include <utility>

namespace rattan {

double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double cpu_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

std::uint64_t peak_rss_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024U;
}

namespace {

StageRecord difference(const StageRecord& now, const StageRecord& before) {
  return {.name = {},
          .seconds = now.seconds - before.seconds,
          .cpu_seconds = now.cpu_seconds - before.cpu_seconds,
          .passes = now.passes - before.passes,
          .bytes_read = now.bytes_read - before.bytes_read,
          .bytes_written = now.bytes_written - before.bytes_written,
          .bytes_moved = now.bytes_moved - before.bytes_moved,
          .resumed = false};
}

}  // namespace

StageRecord StageClock::totals() const {
  const StoreTraffic traffic = traffic_();
  return {.name = {},
          .seconds = wall_seconds(),
          .cpu_seconds = cpu_seconds(),
          .passes = tasks_.passes(),
          .bytes_read = traffic.bytes_read,
          .bytes_written = traffic.bytes_written,
          .bytes_moved = traffic.bytes_moved,
          .resumed = false};
}

StageRecord StageClock::lap() {
  any_done_ = true;
  const StageRecord now = totals();
  return difference(now, std::exchange(last_, now));
}

void StageClock::pass_over(const StageRecord& cost) {
  any_passed_over_ = true;
  passed_over_.seconds += cost.seconds;
  passed_over_.cpu_seconds += cost.cpu_seconds;
  passed_over_.passes += cost.passes;
  passed_over_.bytes_read += cost.bytes_read;
  passed_over_.bytes_written += cost.bytes_written;
  passed_over_.bytes_moved += cost.bytes_moved;
}

StageClock::Running::Running(StageClock& clock, std::string name)
    : clock_(clock),
      name_(std::move(name)),
      begun_(clock.totals()),
      exceptions_(std::uncaught_exceptions()) {
  clock_.last_ = begun_;
  clock_.passed_over_ = {};
  clock_.any_passed_over_ = false;
  clock_.any_done_ = false;
}

StageClock::Running::~Running() {
  const std::size_t before = clock_.records_.size();
  if (clock_.any_passed_over_) {
    StageRecord& earlier = clock_.records_.emplace_back(clock_.passed_over_);
    earlier.name = name_;
    earlier.resumed = true;
  }
  if (clock_.any_done_ || !clock_.any_passed_over_) {
    clock_.records_.push_back(difference(clock_.totals(), begun_));
    clock_.records_.back().name = name_;
  }
  if (clock_.ended_ && std::uncaught_exceptions() == exceptions_) {
    for (std::size_t i = before; i < clock_.records_.size(); ++i) {
      clock_.ended_(clock_.records_[i]);
    }
  }
}

}  // namespace rattan
