#include "compress/format/trees/node_kernels_body.h"
#include "pbrt_import/base/cpu.h"

namespace packtrace::node_kernels {

const Kernels kPortable{place_vertices, number_corners, box_leaves, pack_children};

const Kernels& kernels() {
#if defined(__x86_64__)
  if (cpu_has_avx2()) return kAvx2;
#endif
  return kPortable;
}

} // namespace packtrace::node_kernels
