#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>

/// What each target defines and libFuzzer, or replay_driver.cpp, calls: does its work with any input whatever, returns
/// 0, and ends the process, by whatever means, where the input makes the program misbehave.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

namespace packtrace::fuzz {

/// Ends the process, naming what does not hold.
inline void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "finding: %s\n", what);
  std::abort();
}

} // namespace packtrace::fuzz
