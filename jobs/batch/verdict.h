// SPDX-License-Identifier: MIT
#pragma once

// What the end of an attempt means.

#include <string>

#include "jobs/batch/batch_observer.h"

namespace rattan {

/// The worst of two exit codes of scans, as a batch tells them.
int worse(int a, int b);

/// Exit code and sentence of an attempt whose process was ended by `attempt.signal`; `by_us`: this
/// batch had asked it to stop. The sentence so far is what the process said last.
void judge_signal(Attempt& attempt, const std::string& scan, bool by_us);

}  // namespace rattan
