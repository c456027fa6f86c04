#pragma once

/// Compiles a function for AVX2 and for the baseline instruction set; the loader picks one at program start. Both give
/// the same bits, because the compiler neither reassociates nor fuses multiply-adds. The loader's choice runs before
/// sanitizers are initialised and would crash them, so sanitizer builds have the baseline version only.
#if defined(__x86_64__) && !defined(PACKTRACE_SANITIZED)
#define PACKTRACE_AVX2_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define PACKTRACE_AVX2_CLONES
#endif

namespace packtrace {

/// Replacements for std::min and std::max, which take references and thereby keep GCC from vectorising loops.
inline float smaller(float a, float b) { return b < a ? b : a; }
inline float larger(float a, float b) { return a < b ? b : a; }

} // namespace packtrace
