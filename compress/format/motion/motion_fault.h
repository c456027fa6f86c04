#pragma once

#include <cstdint>

namespace packtrace {

/// Fault in a motion section, and its place.
struct MotionFault {
  uint64_t record;
  const char* what;
};

} // namespace packtrace
