// Compiled for AVX2: nothing here may be inline in a header that others use, or they could end up calling it.
#if defined(__x86_64__)

#include "compress/bake/lod/bound/overlay_kernel_body.h"

namespace packtrace::avx2 {

uint32_t overlay_kernel(const OverlayTask& task, const uint32_t* candidates, uint32_t count, OverlayPiece* pieces,
                        double* covered) {
  return lay_over(task, candidates, count, pieces, covered);
}

} // namespace packtrace::avx2

#endif
