#include "runtime/denoise/kernels/filter_rows.h"

#include "pbrt_import/base/error.h"
#include "runtime/denoise/kernels/history_rows.h"

namespace packtrace {

extern const FilterKernels kFilterKernelsScalar, kFilterKernelsAvx2, kFilterKernelsAvx512;

extern const HistoryKernels kHistoryKernelsScalar, kHistoryKernelsAvx2, kHistoryKernelsAvx512;

namespace {

void require_isa(Isa isa) {
  if (!isa_supported(isa))
    throw Error(ErrorKind::kUnsupported, "denoiser: this machine lacks the instruction set that PACKTRACE_ISA names");
}

} // namespace

const HistoryKernels& history_kernels(Isa isa) {
  require_isa(isa);
#if defined(__x86_64__)
  if (isa == Isa::kAvx512) return kHistoryKernelsAvx512;
  if (isa == Isa::kAvx2) return kHistoryKernelsAvx2;
#endif
  return kHistoryKernelsScalar;
}

const FilterKernels& filter_kernels(Isa isa) {
  require_isa(isa);
#if defined(__x86_64__)
  if (isa == Isa::kAvx512) return kFilterKernelsAvx512;
  if (isa == Isa::kAvx2) return kFilterKernelsAvx2;
#endif
  return kFilterKernelsScalar;
}

} // namespace packtrace
