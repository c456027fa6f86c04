#include "runtime/trace/packed/kernels/batch_decode_avx2.h"
#include "runtime/trace/packed/kernels/lanes_avx2.h"
#include "runtime/trace/packed/traversal/traversal.h"

namespace packtrace::packed {
namespace {

struct Avx2Kernel : Avx2Lanes {
  using WideLanes = Avx2Lanes; ///< for tests with one ray per lane
  using Boxes = GroupBoxes<Avx2Lanes>;
  using Children = ChildRays<Avx2Lanes>;

  static uint32_t decode(const TraceCluster& cluster, uint32_t first, uint32_t count, DecodedBatch& out) {
    return decode_batch_avx2(cluster, first, count, out);
  }
};

} // namespace

const Kernels kAvx2Kernels = kernels_of<Avx2Kernel>("avx2");

} // namespace packtrace::packed
