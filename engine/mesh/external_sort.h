// SPDX-License-Identifier: MIT
#pragma once

// Stable sort of a sequence longer than memory: sorted runs in the store, merged on reading. One
// run that stays in memory is the case where the buffer is large enough. The result does not depend
// on the buffer: runs are in input order and ties go to the earlier run.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "engine/core/spool.h"
#include "engine/core/store.h"
#include "engine/mesh/radix_sort.h"

namespace rattan {

/// Key: const callable Record -> std::uint64_t. Push everything, call finish(), then take in order.
template <class Record, class Key>
class ExternalSort {
 public:
  /// Uses at most about `memory_bytes`, but never fewer than a few records. `expected` records
  /// avoid growing; 0 if unknown. `name` is a store name for the runs, used with a number appended.
  ExternalSort(Store& store, std::string name, Key key, std::size_t memory_bytes,
               std::uint64_t expected)
      : store_(store),
        name_(std::move(name)),
        key_(key),
        capacity_(std::max<std::size_t>(16, memory_bytes / (2 * sizeof(Record)))),
        block_bytes_(
            std::clamp<std::size_t>(memory_bytes / 16, 4 * sizeof(Record), kSpoolBlockBytes)) {
    records_.reserve(static_cast<std::size_t>(std::min<std::uint64_t>(expected, capacity_)));
  }

  void push(const Record& record) {
    if (records_.size() == capacity_) {
      spill();
    }
    records_.push_back(record);
  }
  void push(std::span<const Record> records) {
    while (!records.empty()) {
      if (records_.size() == capacity_) {
        spill();
      }
      const std::size_t take = std::min(records.size(), capacity_ - records_.size());
      records_.insert(records_.end(), records.begin(), records.begin() + take);
      records = records.subspan(take);
    }
  }

  /// Ends pushing. May be called again to read from the start again.
  void finish() {
    if (runs_.empty()) {
      if (!sorted_) {
        std::vector<Record> scratch;
        radix_sort(records_, scratch, key_);
        sorted_ = true;
      }
      at_ = 0;
      return;
    }
    if (!records_.empty()) {
      spill();
    }
    std::vector<Record>().swap(records_);
    // Each open run pins one block.
    const std::size_t fan_in =
        std::max<std::size_t>(4, 2 * capacity_ * sizeof(Record) / block_bytes_);
    while (runs_.size() > fan_in) {
      merge_groups(fan_in);
    }
    open(std::span<Spool<Record>>(runs_));
  }

  bool done() const { return runs_.empty() ? at_ == records_.size() : heads_.empty(); }
  /// Pre: !done().
  const Record& front() const {
    return runs_.empty() ? records_[at_] : readers_[heads_.front().second].front();
  }
  void pop() {
    if (runs_.empty()) {
      ++at_;
    } else {
      pop_merged();
    }
  }
  /// Appends to `out` all coming records whose key equals `key`.
  void take_key(std::uint64_t key, std::vector<Record>& out) {
    if (runs_.empty()) {
      const std::size_t begin = at_;
      while (at_ < records_.size() && key_(records_[at_]) == key) {
        ++at_;
      }
      out.insert(out.end(), records_.begin() + static_cast<std::ptrdiff_t>(begin),
                 records_.begin() + static_cast<std::ptrdiff_t>(at_));
      return;
    }
    while (!heads_.empty() && heads_.front().first == key) {
      out.push_back(front());
      pop_merged();
    }
  }

  /// Runs written so far; 0 when everything stayed in memory.
  std::size_t run_count() const { return runs_.size(); }

 private:
  using Head = std::pair<std::uint64_t, std::size_t>;  // key, run: ties go to the earlier run

  void spill() {
    radix_sort(records_, scratch_, key_);
    auto run = make_run();
    run.append(records_);
    run.finish();
    runs_.push_back(std::move(run));
    records_.clear();
  }

  Spool<Record> make_run() {
    return Spool<Record>(store_, name_ + std::to_string(next_run_++), block_bytes_);
  }

  void open(std::span<Spool<Record>> runs) {
    readers_.clear();
    heads_.clear();
    for (std::size_t r = 0; r < runs.size(); ++r) {
      readers_.emplace_back(runs[r]);
      if (!readers_.back().done()) {
        heads_.emplace_back(key_(readers_.back().front()), r);
      }
    }
    std::make_heap(heads_.begin(), heads_.end(), std::greater<>());
  }

  void pop_merged() {
    auto& reader = readers_[heads_.front().second];
    reader.pop();
    const std::size_t run = heads_.front().second;
    std::pop_heap(heads_.begin(), heads_.end(), std::greater<>());
    if (reader.done()) {
      heads_.pop_back();
    } else {
      heads_.back() = {key_(reader.front()), run};
      std::push_heap(heads_.begin(), heads_.end(), std::greater<>());
    }
  }

  void merge_groups(std::size_t fan_in) {
    std::vector<Spool<Record>> merged;
    for (std::size_t first = 0; first < runs_.size(); first += fan_in) {
      const std::size_t count = std::min(fan_in, runs_.size() - first);
      open(std::span<Spool<Record>>(runs_).subspan(first, count));
      auto run = make_run();
      while (!heads_.empty()) {
        run.push(readers_[heads_.front().second].front());
        pop_merged();
      }
      run.finish();
      readers_.clear();
      for (std::size_t r = first; r < first + count; ++r) {
        runs_[r].erase();
      }
      merged.push_back(std::move(run));
    }
    runs_.clear();
    for (auto& run : merged) {
      runs_.push_back(std::move(run));
    }
  }

  Store& store_;
  std::string name_;
  Key key_;
  std::size_t capacity_;
  std::size_t block_bytes_;
  std::vector<Record> records_;
  std::vector<Record> scratch_;
  bool sorted_ = false;
  std::size_t at_ = 0;
  std::vector<Spool<Record>> runs_;
  std::size_t next_run_ = 0;
  std::vector<SpoolReader<Record>> readers_;
  std::vector<Head> heads_;
};

}  // namespace rattan
