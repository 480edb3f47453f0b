// SPDX-License-Identifier: MIT
#include "jobs/batch/item_states.h"

#include <algorithm>
#include <sys/stat.h>

#include <fmt/format.h>

#include "jobs/exit_codes.h"
#include "jobs/version.h"

namespace rattan {

namespace {

// FNV-1a.
std::uint64_t hash_of(std::string_view text) {
  std::uint64_t h = 14695981039346656037ULL;
  for (const char c : text) {
    h = (h ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
  }
  return h;
}

std::uint64_t add_to_hash(std::uint64_t h, std::uint64_t value) {
  return (h ^ value) * 0x9E3779B97F4A7C15ULL + (h >> 29U);
}

}  // namespace

std::string rattan_identity() {
  return fmt::format("{} {}", version(), commit());
}

const char* describe(Standing standing) {
  switch (standing) {
    case Standing::kNew:
      return "new";
    case Standing::kScanChanged:
      return "scan changed";
    case Standing::kOptionsChanged:
      return "options changed";
    case Standing::kRattanChanged:
      return "failed with another version";
    case Standing::kOutputMissing:
      return "output missing or changed";
    case Standing::kUnfinished:
      return "unfinished";
    case Standing::kRetry:
      return "failed before";
    case Standing::kFresh:
      return "afresh";
    case Standing::kDone:
      return "done";
    case Standing::kFailed:
      return "failed";
  }
  return "";
}

ItemStates::ItemStates(const std::vector<BatchItem>& items, const std::string& directory)
    : items_(items), directory_(directory), reader_(directory), states_(items.size()) {
  by_id_.reserve(items.size());
  for (std::size_t i = 0; i < items.size(); ++i) {
    by_id_.emplace_back(hash_of(items[i].id), static_cast<std::uint32_t>(i));
  }
  std::sort(by_id_.begin(), by_id_.end());
}

std::uint32_t ItemStates::find(std::string_view id) const {
  const std::uint64_t h = hash_of(id);
  for (auto at = std::lower_bound(by_id_.begin(), by_id_.end(), std::pair(h, 0U));
       at != by_id_.end() && at->first == h; ++at) {
    if (items_[at->second].id == id) {
      return at->second;
    }
  }
  return kNone;
}

void ItemStates::visit(const StartRecord& r) {
  const std::uint32_t item = find(r.id);
  if (item == kNone || r.attempt < states_[item].attempts) {
    return;
  }
  State& s = states_[item];
  s.attempts = r.attempt;
  s.key = hash_of(r.key);
  s.rattan = hash_of(r.rattan);
  s.scan_bytes = r.scan_bytes;
  s.scan_time = r.scan_time;
}

void ItemStates::visit(const EndRecord& r) {
  const std::uint32_t item = find(r.id);
  if (item == kNone || r.attempt < states_[item].ended) {
    return;
  }
  State& s = states_[item];
  s.ended = r.attempt;
  s.exit = static_cast<std::int16_t>(r.exit);
  s.outputs = r.outputs.size();
  for (const OutputFile& output : r.outputs) {
    s.outputs = add_to_hash(s.outputs, output.bytes);
  }
}

void ItemStates::begin() {
  for (State& s : states_) {
    s.at_begin = s.ended;
  }
}

void ItemStates::expect_again(std::size_t item, int attempt) {
  states_[item].at_begin = attempt;
}

bool ItemStates::ended_since(std::size_t item) const {
  return states_[item].ended > states_[item].at_begin;
}

bool ItemStates::same_work(std::size_t item) const {
  const State& s = states_[item];
  const BatchItem& i = items_[item];
  return s.key == hash_of(i.what->key) && s.scan_bytes == i.scan_bytes &&
         s.scan_time == i.scan_time;
}

bool ItemStates::may_have_finished(std::size_t item) const {
  return states_[item].attempts > states_[item].ended && same_work(item);
}

Standing ItemStates::standing(std::size_t item, const BatchRunOptions& options) const {
  const State& s = states_[item];
  const BatchItem& i = items_[item];
  if (s.attempts == 0) {
    return Standing::kNew;
  }
  if (s.scan_bytes != i.scan_bytes || s.scan_time != i.scan_time) {
    return Standing::kScanChanged;
  }
  if (s.key != hash_of(i.what->key)) {
    return Standing::kOptionsChanged;
  }
  if (s.attempts > s.ended || s.exit == kExitInterrupted) {
    return Standing::kUnfinished;
  }
  if (ended_since(item)) {
    return s.exit == kExitDone ? Standing::kDone : Standing::kFailed;
  }
  if (options.fresh) {
    return Standing::kFresh;
  }
  if (s.exit == kExitDone) {
    return s.missing ? Standing::kOutputMissing : Standing::kDone;
  }
  if (s.exit == kExitResource || options.retry_failed) {
    return Standing::kRetry;
  }
  return s.rattan != hash_of(rattan_identity()) ? Standing::kRattanChanged : Standing::kFailed;
}

Standing ItemStates::look(std::size_t item, const BatchRunOptions& options) {
  const Standing by_journal = standing(item, options);
  if (by_journal == Standing::kDone && !outputs_there(item)) {
    states_[item].missing = true;
    return Standing::kOutputMissing;
  }
  return by_journal;
}

bool ItemStates::outputs_there(std::size_t item) const {
  const std::vector<std::string> names = item_outputs(items_[item]);
  std::uint64_t found = names.size();
  for (const std::string& name : names) {
    struct stat status {};
    if (::stat((directory_ + "/" + name).c_str(), &status) != 0) {
      return false;
    }
    found = add_to_hash(found, static_cast<std::uint64_t>(status.st_size));
  }
  return found == states_[item].outputs;
}

}  // namespace rattan
