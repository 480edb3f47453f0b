// SPDX-License-Identifier: MIT

// One libFuzzer program a reader: RATTAN_FUZZ_TARGET names it.

#include "tests/fuzz/scan_targets.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  rattan::fuzz::read_bytes_as(RATTAN_FUZZ_TARGET, data, size);
  return 0;
}
