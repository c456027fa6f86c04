#pragma once

#include "pbrt_import/base/isa.h"
#include "runtime/trace/packed/kernels/kernel_types.h"

namespace packtrace {

using PackedIsa = Isa;

/// Returns the kernels of an instruction set. Throws Error(kUnsupported) if this machine lacks it.
const packed::Kernels& kernels_of(PackedIsa isa);

} // namespace packtrace
