#include "runtime/trace/packed/kernels/isa.h"

#include "pbrt_import/base/error.h"

namespace packtrace {

const packed::Kernels& kernels_of(PackedIsa isa) {
  if (!isa_supported(isa)) throw Error(ErrorKind::kUnsupported, "this machine lacks the instruction set to trace with");
#if defined(__x86_64__)
  if (isa == PackedIsa::kAvx512) return packed::kAvx512Kernels;
  if (isa == PackedIsa::kAvx2) return packed::kAvx2Kernels;
#endif
  return packed::kScalarKernels;
}

} // namespace packtrace
