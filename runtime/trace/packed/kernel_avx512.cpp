#include "runtime/trace/packed/lanes_avx512.h"
#include "runtime/trace/packed/traversal.h"

namespace packtrace::packed {
namespace {

struct Avx512Kernel : Avx2Lanes {
  using NodeRay = Avx512NodeRay;

  static uint32_t test_node(const baked::PackedNode& node, const NodeRay& node_ray, const GridRay& ray,
                            float (&entry)[8]) {
    return test_boxes(node, node_ray, ray.tmax, entry);
  }
  static uint32_t decode(const TraceCluster& cluster, uint32_t first, uint32_t count, DecodedBatch& out) {
    return decode_batch_avx512(cluster, first, count, out);
  }
};

} // namespace

const Kernels kAvx512Kernels = kernels_of<Avx512Kernel>("avx512");

} // namespace packtrace::packed
