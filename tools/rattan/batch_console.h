// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "jobs/batch/batch_observer.h"
#include "tools/rattan/console.h"

namespace rattan {

/// A batch for people, on stderr. On a terminal one line is redrawn in place with counts, rate and
/// time left, and failures scroll past above it; elsewhere every scan gets a line when it ends.
class BatchConsole final : public BatchObserver {
 public:
  explicit BatchConsole(Verbosity verbosity);
  ~BatchConsole() override;
  BatchConsole(const BatchConsole&) = delete;
  BatchConsole& operator=(const BatchConsole&) = delete;

  void begun(const BatchState& state) override;
  void ended(const BatchItem& item, const Attempt& attempt) override;
  void line(const BatchItem& item, const Attempt& attempt, const nlohmann::json& event) override;
  void warning(const std::string& sentence) override;
  void tick(const BatchState& state) override;
  void finished(const BatchState& state, int exit_code) override;

 private:
  void say(const std::string& text);
  void draw(const BatchState& state);

  Verbosity verbosity_;
  bool terminal_;
  bool drawn_ = false;
};

}  // namespace rattan
