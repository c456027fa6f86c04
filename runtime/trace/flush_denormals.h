#pragma once

#include <xmmintrin.h>

namespace packtrace {

/// Sets flush-to-zero and denormals-are-zero on the current thread during its lifetime; Embree recommends both for ray
/// queries.
class FlushDenormals {
public:
  FlushDenormals() : saved_(_mm_getcsr()) { _mm_setcsr(saved_ | kFlushToZero | kDenormalsAreZero); }
  ~FlushDenormals() { _mm_setcsr(saved_); }
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;

private:
  static constexpr unsigned int kFlushToZero = 0x8000, kDenormalsAreZero = 0x0040; // bits of MXCSR
  unsigned int saved_;
};

} // namespace packtrace
