#pragma once

#include <optional>

#include "runtime/trace/packed/kernels/kernel_types.h"

namespace packtrace {

/// Instruction sets that the packed tracer has kernels for.
enum class PackedIsa : uint8_t {
  kScalar, ///< portable C++
  kAvx2,   ///< AVX2, FMA, BMI, BMI2, POPCNT
  kAvx512, ///< those of kAvx2, and AVX-512 F, VL, BW, DQ, CD, VBMI, VBMI2, VPOPCNTDQ
};

/// Whether this machine supports the instruction set.
bool isa_supported(PackedIsa isa);

/// Returns the kernels of an instruction set. Throws Error(kUnsupported) if this machine lacks it.
const packed::Kernels& kernels_of(PackedIsa isa);

/// Returns the instruction set that the environment variable PACKTRACE_ISA names (scalar, avx2 or avx512), or, if it is
/// not set, the widest that this machine supports. Throws Error(kInput) for any other name.
PackedIsa chosen_isa();

} // namespace packtrace
