#pragma once

extern "C" void __asan_init() __attribute__((weak));

namespace packtrace::test {

/// Whether the program runs with sanitizers, under which tracing rays and comparing many values take too long. Asks the
/// linker, because objects of tests are the same with and without AddressSanitizer.
inline bool sanitized() {
#ifdef PACKTRACE_SANITIZED
  return true;
#else
  return __asan_init != nullptr;
#endif
}

/// Reason for skipping a slow test in sanitized builds.
inline constexpr const char* kOthersRunItsCode = "other tests run the same code under sanitizers in less time";

/// Number of rays, repeats and the like for a test: an eighth of `count` with sanitizers.
template <typename Number>
Number fewer(Number count) {
  return sanitized() ? count / 8 : count;
}

} // namespace packtrace::test
