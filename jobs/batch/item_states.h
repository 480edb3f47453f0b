// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "jobs/batch/batch_item.h"
#include "jobs/batch/batch_run.h"
#include "jobs/batch/journal.h"

namespace rattan {

/// How each item of a batch stands, by what the journal says of it: some tens of bytes an item.
class ItemStates final : private JournalVisitor {
 public:
  /// Reads nothing yet. `items` must outlive it.
  ItemStates(const std::vector<BatchItem>& items, const std::string& directory);

  /// Reads what was appended to the journal since the last time.
  void refresh() { reader_.refresh(*this); }
  /// What is ended from now on is settled: see standing().
  void begin();
  /// But not this attempt: it is to be made again.
  void expect_again(std::size_t item, int attempt);

  /// By journal alone. After begin(), what ended since is not to be done again, however it ended,
  /// but for interruptions.
  Standing standing(std::size_t item, const BatchRunOptions& options) const;
  /// standing(), and kOutputMissing from now on if it is done but its outputs aren't there with the
  /// bytes that were written.
  Standing look(std::size_t item, const BatchRunOptions& options);

  int attempts(std::size_t item) const { return states_[item].attempts; }
  /// The last attempt has no end, and would be made in the same way now.
  bool may_have_finished(std::size_t item) const;
  /// Of the last end; -1 if there is none.
  int exit(std::size_t item) const { return states_[item].exit; }
  /// Ended by whomever since begin().
  bool ended_since(std::size_t item) const;
  std::uint64_t records() const { return reader_.records(); }

 private:
  struct State {
    std::uint64_t key = 0;  ///< hashes
    std::uint64_t rattan = 0;
    std::uint64_t outputs = 0;
    std::uint64_t scan_bytes = 0;
    std::int64_t scan_time = 0;
    std::int32_t attempts = 0;
    std::int32_t ended = 0;     ///< number of the attempt that ended last
    std::int32_t at_begin = 0;  ///< `ended` then
    std::int16_t exit = -1;
    bool missing = false;  ///< the output, until an attempt ends
  };
  static constexpr std::uint32_t kNone = ~0U;

  std::uint32_t find(std::string_view id) const;
  bool same_work(std::size_t item) const;
  bool outputs_there(std::size_t item) const;
  void visit(const StartRecord& record) override;
  void visit(const EndRecord& record) override;

  const std::vector<BatchItem>& items_;
  std::string directory_;
  JournalReader reader_;
  std::vector<State> states_;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> by_id_;  ///< hash and item, sorted
};

/// Version and commit of this program, as journals have it.
std::string rattan_identity();

}  // namespace rattan
