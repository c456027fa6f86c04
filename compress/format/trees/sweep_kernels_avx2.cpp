// Compiled for AVX2. Code here must not use inline functions of shared headers: the linker might keep the AVX2 version
// for callers on processors without AVX2.
#if defined(__x86_64__)

#include "compress/format/trees/sweep_kernels_body.h"

namespace packtrace::sweep_kernels {

const Kernels kAvx2{split_run, split_orders};

} // namespace packtrace::sweep_kernels

#endif
