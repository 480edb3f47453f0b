// SPDX-License-Identifier: MIT
#pragma once

// oneTBB orders the tasks it runs, but its library isn't built with ThreadSanitizer, which
// therefore can't see that order. The two places that start tasks (parallel.h, task_graph.cpp)
// spell it out.

#if defined(RATTAN_THREAD_SANITIZER)
#include <sanitizer/tsan_interface.h>
#endif

namespace rattan {

/// A point where the work before give() is seen by the work after take(), because the scheduler
/// runs them in that order. Orders nothing by itself: outside ThreadSanitizer both are empty.
class HandOver {
 public:
#if defined(RATTAN_THREAD_SANITIZER)
  void give() {
    __tsan_release(&mark_);
  }
  void take() {
    __tsan_acquire(&mark_);
  }

 private:
  char mark_ = 0;
#else
  void give() {}
  void take() {}
#endif
};

}  // namespace rattan
