#include "runtime/denoise/kernels/filter_rows.h"

namespace packtrace {

extern const FilterKernels kFilterKernelsScalar, kFilterKernelsAvx2, kFilterKernelsAvx512;

const FilterKernels& filter_kernels([[maybe_unused]] Isa isa) {
#if defined(__x86_64__)
  if (isa == Isa::kAvx512) return kFilterKernelsAvx512;
  if (isa == Isa::kAvx2) return kFilterKernelsAvx2;
#endif
  return kFilterKernelsScalar;
}

} // namespace packtrace
