#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>

/// Entry point of each target, called by libFuzzer or replay_driver.cpp. Accepts any input and returns 0. Ends the
/// process if the input makes the program misbehave.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

namespace packtrace::fuzz {

/// If `holds` is false, prints the violated requirement and ends the process.
inline void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "finding: %s\n", what);
  std::abort();
}

} // namespace packtrace::fuzz
