#include "compress/format/trees/node_kernels_body.h"

namespace packtrace::node_kernels {

const Kernels kPortable{place_vertices, number_corners, box_leaves, pack_children};

const Kernels& kernels() {
#if defined(__x86_64__)
  static const bool has_avx2 = __builtin_cpu_supports("avx2");
  if (has_avx2) return kAvx2;
#endif
  return kPortable;
}

} // namespace packtrace::node_kernels
