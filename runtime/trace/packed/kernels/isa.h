#pragma once

#include <optional>

#include "runtime/trace/packed/kernels/kernel_types.h"

namespace packtrace {

/// Instruction sets that the packed tracer has kernels for.
enum class PackedIsa : uint8_t {
  kScalar, ///< portable C++
  kAvx2,   ///< and FMA, BMI
  kAvx512, ///< F, VL, BW, DQ, CD, VBMI, VBMI2, VPOPCNTDQ
};

/// Whether this machine has it.
bool isa_supported(PackedIsa isa);

/// Its kernels. Throws Error(kUnsupported) where this machine lacks it.
const packed::Kernels& kernels_of(PackedIsa isa);

/// The environment variable PACKTRACE_ISA (scalar, avx2, avx512), else the widest that this machine has.
/// Throws Error(kInput) for another name.
PackedIsa chosen_isa();

} // namespace packtrace
