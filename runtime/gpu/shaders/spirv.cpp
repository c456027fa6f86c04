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
constexpr uint32_t kView[] = {
#include <view.inc>
};
constexpr uint32_t kCopy[] = {
#include <copy.inc>
};
constexpr uint32_t kSurfaces[] = {
#include <surfaces.inc>
};
constexpr uint32_t kPicturePoints[] = {
#include <picture_points.inc>
};
constexpr uint32_t kSurfacePoints[] = {
#include <surface_points.inc>
};
constexpr uint32_t kOcclusionRays[] = {
#include <occlusion_rays.inc>
};
constexpr uint32_t kOcclusionImage[] = {
#include <occlusion_image.inc>
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
constexpr uint32_t kNearestQueue[] = {
#include <nearest_queue.inc>
};
constexpr uint32_t kNearestQueuePartitioned[] = {
#include <nearest_queue_partitioned.inc>
};
constexpr uint32_t kDenoiseCompare[] = {
#include <denoise_compare.inc>
};
constexpr uint32_t kDenoiseHistory[] = {
#include <denoise_history.inc>
};
constexpr uint32_t kDenoiseCorrect[] = {
#include <denoise_correct.inc>
};
constexpr uint32_t kDenoiseGuides[] = {
#include <denoise_guides.inc>
};
constexpr uint32_t kDenoiseVariance[] = {
#include <denoise_variance.inc>
};
constexpr uint32_t kDenoiseFinish[] = {
#include <denoise_finish.inc>
};
constexpr uint32_t kDenoisePassFirst[] = {
#include <denoise_pass_first.inc>
};
constexpr uint32_t kDenoisePass1[] = {
#include <denoise_pass_1.inc>
};
constexpr uint32_t kDenoisePass2[] = {
#include <denoise_pass_2.inc>
};
constexpr uint32_t kDenoisePass4[] = {
#include <denoise_pass_4.inc>
};

constexpr uint32_t kTraceAnyRays[] = {
#include <trace_any_rays.inc>
};
constexpr uint32_t kTraceClosestRays[] = {
#include <trace_closest_rays.inc>
};
constexpr uint32_t kCameraRays[] = {
#include <camera_rays.inc>
};
constexpr uint32_t kViewRays[] = {
#include <view_rays.inc>
};
constexpr uint32_t kOcclusionNearestRays[] = {
#include <occlusion_nearest_rays.inc>
};
constexpr uint32_t kOcclusionCount[] = {
#include <occlusion_count.inc>
};
constexpr uint32_t kOcclusionCountRays[] = {
#include <occlusion_count_rays.inc>
};
constexpr uint32_t kClosestHit[] = {
#include <closest_hit.inc>
};
constexpr uint32_t kAnyHit[] = {
#include <any_hit.inc>
};
constexpr uint32_t kMiss[] = {
#include <miss.inc>
};
constexpr uint32_t kDecodeTriangles[] = {
#include <decode_triangles.inc>
};
} // namespace

std::span<const uint32_t> probe() { return kProbe; }
std::span<const uint32_t> trace_any() { return kTraceAny; }
std::span<const uint32_t> trace_closest() { return kTraceClosest; }
std::span<const uint32_t> prepare() { return kPrepare; }
std::span<const uint32_t> camera() { return kCamera; }
std::span<const uint32_t> view() { return kView; }
std::span<const uint32_t> copy() { return kCopy; }
std::span<const uint32_t> surfaces() { return kSurfaces; }
std::span<const uint32_t> picture_points() { return kPicturePoints; }
std::span<const uint32_t> surface_points() { return kSurfacePoints; }
std::span<const uint32_t> occlusion_rays() { return kOcclusionRays; }
std::span<const uint32_t> occlusion_image() { return kOcclusionImage; }
std::span<const uint32_t> occlusion_nearest() { return kOcclusionNearest; }
std::span<const uint32_t> occlusion_queue() { return kOcclusionQueue; }
std::span<const uint32_t> occlusion_queue_partitioned() { return kOcclusionQueuePartitioned; }
std::span<const uint32_t> nearest_queue() { return kNearestQueue; }
std::span<const uint32_t> nearest_queue_partitioned() { return kNearestQueuePartitioned; }
std::span<const uint32_t> trace_any_rays() { return kTraceAnyRays; }
std::span<const uint32_t> trace_closest_rays() { return kTraceClosestRays; }
std::span<const uint32_t> camera_rays() { return kCameraRays; }
std::span<const uint32_t> view_rays() { return kViewRays; }
std::span<const uint32_t> occlusion_nearest_rays() { return kOcclusionNearestRays; }
std::span<const uint32_t> occlusion_count() { return kOcclusionCount; }
std::span<const uint32_t> occlusion_count_rays() { return kOcclusionCountRays; }
std::span<const uint32_t> closest_hit() { return kClosestHit; }
std::span<const uint32_t> any_hit() { return kAnyHit; }
std::span<const uint32_t> miss() { return kMiss; }
std::span<const uint32_t> decode_triangles() { return kDecodeTriangles; }
std::span<const uint32_t> denoise_compare() { return kDenoiseCompare; }
std::span<const uint32_t> denoise_history() { return kDenoiseHistory; }
std::span<const uint32_t> denoise_correct() { return kDenoiseCorrect; }
std::span<const uint32_t> denoise_guides() { return kDenoiseGuides; }
std::span<const uint32_t> denoise_variance() { return kDenoiseVariance; }
std::span<const uint32_t> denoise_finish() { return kDenoiseFinish; }
std::span<const uint32_t> denoise_pass_first() { return kDenoisePassFirst; }
std::span<const uint32_t> denoise_pass_1() { return kDenoisePass1; }
std::span<const uint32_t> denoise_pass_2() { return kDenoisePass2; }
std::span<const uint32_t> denoise_pass_4() { return kDenoisePass4; }

} // namespace packtrace::gpu::spirv
