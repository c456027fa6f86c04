#pragma once

#include <cstdint>

namespace packtrace {

/// Instruction sets that the program has kernels for. All give the same results.
enum class Isa : uint8_t {
  kScalar, ///< portable C++
  kAvx2,   ///< AVX2, FMA, BMI, BMI2, POPCNT
  kAvx512, ///< those of kAvx2, and AVX-512 F, VL, BW, DQ, CD, VBMI, VBMI2, VPOPCNTDQ
};

/// Whether this machine supports the instruction set.
bool isa_supported(Isa isa);

/// Returns the instruction set that the environment variable PACKTRACE_ISA names (scalar, avx2 or avx512), or, if it is
/// not set, the widest that this machine supports. Throws Error(kUsage) for any other name.
Isa chosen_isa();

} // namespace packtrace
