// Compiled for AVX2. Code here must not use inline functions of shared headers: the linker might keep the AVX2 version
// for callers on processors without AVX2.
#if defined(__x86_64__)

#include "compress/format/trees/node_kernels_body.h"

namespace packtrace::node_kernels {

const Kernels kAvx2{place_vertices, number_corners, box_leaves, pack_children};

} // namespace packtrace::node_kernels

#endif
