// SPDX-License-Identifier: MIT
#include "tools/rattan/exit_code.h"

#include <cstdio>
#include <exception>
#include <new>

#include "engine/core/errors.h"

namespace rattan {

void say_error(const std::string& sentence, int /*code*/) {
  std::fprintf(stderr, "rattan: %s\n", sentence.c_str());
}

int run_guarded(const std::function<int()>& command, const ErrorSink& say_it) {
  const auto say = [&](const std::string& sentence, int code) {
    say_it(sentence, code);
    return code;
  };
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
    return say(std::string("a defect in Rattan: ") + e.what() +
                   ". Please report it with the scan and the command.",
               kExitDefect);
  }
}

}  // namespace rattan
