// SPDX-License-Identifier: MIT
#include "tools/rattan/exit_code.h"

#include <cstdio>
#include <exception>
#include <new>

#include "engine/core/errors.h"

namespace rattan {

namespace {

int say(const char* what, int code) {
  std::fprintf(stderr, "rattan: %s\n", what);
  return code;
}

}  // namespace

int run_guarded(const std::function<int()>& command) {
  try {
    return command();
  } catch (const UsageError& e) {
    return say(e.what(), kExitUsage);
  } catch (const InputError& e) {
    return say(e.what(), kExitInput);
  } catch (const ResourceError& e) {
    return say(e.what(), kExitResource);
  } catch (const Cancelled& e) {
    return say(e.what(), kExitInterrupted);
  } catch (const std::bad_alloc&) {
    return say("The system refused more memory. Free some, or lower --memory.", kExitResource);
  } catch (const std::exception& e) {
    std::fprintf(
        stderr, "rattan: a defect in Rattan: %s. Please report it with the scan and the command.\n",
        e.what());
    return kExitDefect;
  }
}

}  // namespace rattan
