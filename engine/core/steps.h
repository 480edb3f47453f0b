// SPDX-License-Identifier: MIT
#pragma once

// How a long computation tells its caller where it may be stopped and taken up again.

#include <string>
#include <string_view>
#include <type_traits>

#include "engine/core/archive.h"

namespace rattan {

/// A job is a sequence of steps in one order that depends on nothing but its inputs and the results
/// of the steps before. What a step leaves is in the store, and in its result, which is small. A
/// run that is resumed goes through the same code: steps that were done before are passed over, and
/// their results handed out again. So between two steps, code may look at results, and must neither
/// work nor read the store: it shows what the last of the steps left that were done, not the one
/// before.
class Steps {
 public:
  Steps() = default;
  Steps(const Steps&) = delete;
  Steps& operator=(const Steps&) = delete;
  virtual ~Steps() = default;

  /// Does `work()`, unless an earlier run did; returns its result (anything that archive.h packs).
  template <class Work>
  auto run(std::string_view name, const Work& work) {
    using Result = std::invoke_result_t<Work>;
    const std::string* kept = begin(name);
    if constexpr (std::is_void_v<Result>) {
      if (kept == nullptr) {
        work();
        end(name, {});
      }
    } else {
      Result result{};
      if (kept != nullptr) {
        unpack(*kept, result);
      } else {
        result = work();
        end(name, pack(result));
      }
      return result;
    }
  }

  /// The next step takes long: a good moment to save what there is.
  virtual void before_long_step() {}

 protected:
  /// The packed result if the step was done before, else null: it is done now. Valid until the next
  /// call.
  virtual const std::string* begin(std::string_view name) = 0;
  /// The step is done: all it leaves is in the store. May save that, and may throw Cancelled.
  virtual void end(std::string_view name, std::string result) = 0;
};

/// Does everything and remembers nothing.
class PlainSteps final : public Steps {
 protected:
  const std::string* begin(std::string_view /*name*/) override { return nullptr; }
  void end(std::string_view /*name*/, std::string /*result*/) override {}
};

}  // namespace rattan
