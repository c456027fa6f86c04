#include "runtime/denoise/kernels/filter_rows.h"

#include "pbrt_import/base/error.h"
#include "runtime/denoise/kernels/history_rows.h"

namespace packtrace {

extern const FilterKernels kFilterKernelsScalar, kFilterKernelsAvx2, kFilterKernelsAvx512;

extern const HistoryKernels kHistoryKernelsScalar, kHistoryKernelsAvx2, kHistoryKernelsAvx512;

namespace {

struct KernelSet {
  const FilterKernels& filter;
  const HistoryKernels& history;
};

KernelSet kernels_for(Isa isa) {
  if (!isa_supported(isa))
    throw Error(ErrorKind::kUnsupported, "denoiser: this machine lacks the instruction set that PACKTRACE_ISA names");
#if defined(__x86_64__)
  if (isa == Isa::kAvx512) return {kFilterKernelsAvx512, kHistoryKernelsAvx512};
  if (isa == Isa::kAvx2) return {kFilterKernelsAvx2, kHistoryKernelsAvx2};
#endif
  return {kFilterKernelsScalar, kHistoryKernelsScalar};
}

} // namespace

const FilterKernels& filter_kernels(Isa isa) { return kernels_for(isa).filter; }

const HistoryKernels& history_kernels(Isa isa) { return kernels_for(isa).history; }

} // namespace packtrace
