#include "runtime/denoise/kernels/filter_rows.h"

#include "pbrt_import/base/error.h"

namespace packtrace {

extern const FilterKernels kFilterKernelsScalar, kFilterKernelsAvx2, kFilterKernelsAvx512;

const FilterKernels& filter_kernels(Isa isa) {
  if (!isa_supported(isa))
    throw Error(ErrorKind::kUnsupported, "denoiser: this machine lacks the instruction set that PACKTRACE_ISA names");
#if defined(__x86_64__)
  if (isa == Isa::kAvx512) return kFilterKernelsAvx512;
  if (isa == Isa::kAvx2) return kFilterKernelsAvx2;
#endif
  return kFilterKernelsScalar;
}

} // namespace packtrace
