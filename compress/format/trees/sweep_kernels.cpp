#include "compress/format/trees/sweep_kernels_body.h"
#include "pbrt_import/base/cpu.h"

namespace packtrace::sweep_kernels {

const Kernels kPortable{split_run, split_orders};

const Kernels& kernels() {
#if defined(__x86_64__)
  if (cpu_has_avx2()) return kAvx2;
#endif
  return kPortable;
}

} // namespace packtrace::sweep_kernels
