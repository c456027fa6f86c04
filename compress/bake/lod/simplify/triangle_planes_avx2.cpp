// Compiled for AVX2. Must not include headers with inline functions that other translation units use: the linker could
// pick the AVX2 version for them.
#if defined(__x86_64__)

#include "compress/bake/lod/simplify/triangle_planes_body.h"

namespace packtrace::avx2 {

uint64_t add_triangle_planes(const PlaneTask& task, uint64_t first, uint64_t count) {
  return add_planes(task, first, count);
}

} // namespace packtrace::avx2

#endif
