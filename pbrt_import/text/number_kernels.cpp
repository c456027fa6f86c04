#include "pbrt_import/text/number_kernels.h"
#include "pbrt_import/base/cpu.h"

namespace packtrace {

const NumberKernels* number_kernels() {
#if defined(__x86_64__)
  static constexpr NumberKernels kAvx2{avx2::convert_integers, avx2::convert_floats, avx2::convert_doubles};
  if (cpu_has_avx2()) return &kAvx2;
#endif
  return nullptr;
}

} // namespace packtrace
