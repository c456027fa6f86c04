#include "runtime/gpu/shaders/spirv.h"

namespace packtrace::gpu::spirv {
namespace {

constexpr uint32_t kProbe[] = {
#include <probe.inc>
};
constexpr uint32_t kTraceAny[] = {
#include <trace_any.inc>
};
constexpr uint32_t kTraceClosest[] = {
#include <trace_closest.inc>
};
constexpr uint32_t kPrepare[] = {
#include <prepare.inc>
};
constexpr uint32_t kCamera[] = {
#include <camera.inc>
};
constexpr uint32_t kSurfacePoints[] = {
#include <surface_points.inc>
};
constexpr uint32_t kOcclusionRays[] = {
#include <occlusion_rays.inc>
};
constexpr uint32_t kOcclusionNearest[] = {
#include <occlusion_nearest.inc>
};
constexpr uint32_t kOcclusionQueue[] = {
#include <occlusion_queue.inc>
};
constexpr uint32_t kOcclusionQueuePartitioned[] = {
#include <occlusion_queue_partitioned.inc>
};

} // namespace

std::span<const uint32_t> probe() { return kProbe; }
std::span<const uint32_t> trace_any() { return kTraceAny; }
std::span<const uint32_t> trace_closest() { return kTraceClosest; }
std::span<const uint32_t> prepare() { return kPrepare; }
std::span<const uint32_t> camera() { return kCamera; }
std::span<const uint32_t> surface_points() { return kSurfacePoints; }
std::span<const uint32_t> occlusion_rays() { return kOcclusionRays; }
std::span<const uint32_t> occlusion_nearest() { return kOcclusionNearest; }
std::span<const uint32_t> occlusion_queue() { return kOcclusionQueue; }
std::span<const uint32_t> occlusion_queue_partitioned() { return kOcclusionQueuePartitioned; }

} // namespace packtrace::gpu::spirv
