#include "compress/bake/lod/bound/overlay_kernel_body.h"

namespace packtrace {

uint32_t overlay_kernel(const OverlayTask& task, const uint32_t* candidates, uint32_t count, OverlayPiece* pieces,
                        OverlayCover* cover) {
  return lay_over(task, candidates, count, pieces, cover);
}

} // namespace packtrace
