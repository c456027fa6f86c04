#include "runtime/trace/packed/kernels/lanes_scalar.h"
#include "runtime/trace/packed/traversal/traversal.h"

namespace packtrace::packed {
namespace {

struct ScalarKernel : ScalarLanes {
  using WideLanes = ScalarLanes;
  using Boxes = GroupBoxes<ScalarLanes>;
  using Children = ChildRays<ScalarLanes>;

  static uint32_t decode(const TraceCluster& cluster, uint32_t first, uint32_t count, DecodedBatch& out) {
    return decode_batch_scalar(cluster, first, count, out);
  }
};

} // namespace

const Kernels kScalarKernels = kernels_of<ScalarKernel>("scalar");

} // namespace packtrace::packed
