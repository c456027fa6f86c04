#pragma once

namespace packtrace::test {

/// Whether the tests are built with sanitizers, under which tracing rays and comparing many values take too long.
#ifdef PACKTRACE_SANITIZED
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

} // namespace packtrace::test
