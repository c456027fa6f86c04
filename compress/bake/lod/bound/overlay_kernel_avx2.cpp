// Compiled for AVX2. Must not include headers with inline functions that other translation units use: the linker could
// pick the AVX2 version for them.
#if defined(__x86_64__)

#include "compress/bake/lod/bound/overlay_kernel_body.h"

namespace packtrace::avx2 {

uint32_t overlay_kernel(const OverlayTask& task, const uint32_t* candidates, uint32_t count, OverlayPiece* pieces,
                        OverlayCover* cover) {
  return lay_over(task, candidates, count, pieces, cover);
}

} // namespace packtrace::avx2

#endif
