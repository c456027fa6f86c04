#include "runtime/trace/packed/kernels/batch_decode_avx512.h"
#include "runtime/trace/packed/kernels/group_boxes_avx512.h"
#include "runtime/trace/packed/kernels/lanes_avx2.h"
#include "runtime/trace/packed/kernels/lanes_avx512.h"
#include "runtime/trace/packed/traversal/traversal.h"

namespace packtrace::packed {
namespace {

struct Avx512Kernel : Avx2Lanes {
  using WideLanes = Avx512Lanes;
  using Boxes = Avx512GroupBoxes;
  using Children = Avx512ChildRays;

  static uint32_t decode(const TraceCluster& cluster, uint32_t first, uint32_t count, DecodedBatch& out) {
    return decode_batch_avx512(cluster, first, count, out);
  }
};

} // namespace

const Kernels kAvx512Kernels = kernels_of<Avx512Kernel>("avx512");

} // namespace packtrace::packed
