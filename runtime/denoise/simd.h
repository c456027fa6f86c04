#pragma once

/// Compiles a function twice, for AVX2 and for the baseline, chosen when the program starts. Both give the same bits:
/// nothing is reassociated and no multiply-add is fused. Sanitizers do not survive the choice (it runs before they are
/// set up), so their builds have the baseline only.
#if defined(__x86_64__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define PACKTRACE_AVX2_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define PACKTRACE_AVX2_CLONES
#endif

namespace packtrace {

/// std::min and std::max take references, which keeps GCC from vectorising loops around them.
inline float smaller(float a, float b) { return b < a ? b : a; }
inline float larger(float a, float b) { return a < b ? b : a; }

} // namespace packtrace
