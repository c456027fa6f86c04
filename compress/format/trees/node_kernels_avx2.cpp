// Compiled for AVX2: nothing here may be inline in a header that others use, or they could end up calling it.
#if defined(__x86_64__)

#include "compress/format/trees/node_kernels_body.h"

namespace packtrace::node_kernels {

const Kernels kAvx2{place_vertices, number_corners, box_leaves, pack_children};

} // namespace packtrace::node_kernels

#endif
