#pragma once

namespace packtrace {

/// Whether the processor has AVX2 and what always comes with it: FMA, BMI, BMI2, LZCNT and POPCNT (x86-64-v3). Kernels
/// for it are compiled in separate files, *_avx2.cpp, and are chosen at run time. They give the same results as the
/// portable ones.
inline bool cpu_has_avx2() {
#if defined(__x86_64__)
  static const bool kHas = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
                           __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2") &&
                           __builtin_cpu_supports("lzcnt") && __builtin_cpu_supports("popcnt");
  return kHas;
#else
  return false;
#endif
}

} // namespace packtrace
