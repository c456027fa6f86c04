#include "compress/format/trees/bin_kernels_body.h"
#include "pbrt_import/base/cpu.h"

namespace packtrace::bin_kernels {

const Kernels kPortable{measure, split};

const Kernels& kernels() {
#if defined(__x86_64__)
  if (cpu_has_avx2()) return kAvx2;
#endif
  return kPortable;
}

} // namespace packtrace::bin_kernels
