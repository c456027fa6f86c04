#include "compress/bake/lod/simplify/triangle_planes_body.h"

namespace packtrace {

uint64_t add_triangle_planes(const PlaneTask& task, uint64_t first, uint64_t count) {
  return add_planes(task, first, count);
}

} // namespace packtrace
