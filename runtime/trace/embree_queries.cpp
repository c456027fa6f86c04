// The ray queries of EmbreeTracer: rays go to Embree in chunks on the stack.

#include <algorithm>
#include <cassert>
#include <cstddef>

#include <embree3/rtcore.h>

#include "runtime/trace/embree_tracer.h"
#include "runtime/trace/flush_denormals.h"

namespace packtrace {
namespace {

constexpr size_t kPacket = 16;
constexpr size_t kStream = 1024; ///< rays a stream call, as many as a tile has

static_assert(sizeof(Ray) == 32 && offsetof(Ray, tnear) == 12 && offsetof(Ray, direction) == 16 &&
              offsetof(Ray, tfar) == 28);

struct QueryContext : RTCIntersectContext {
  explicit QueryContext(RTCIntersectContextFlags order) {
    rtcInitIntersectContext(this);
    flags = order;
  }
};

/// Four rows of x y z w to four columns, or back.
void store_columns(const float* rows, size_t stride, float* x, float* y, float* z, float* w) {
  __m128 a = _mm_loadu_ps(rows), b = _mm_loadu_ps(rows + stride), c = _mm_loadu_ps(rows + 2 * stride),
         d = _mm_loadu_ps(rows + 3 * stride);
  _MM_TRANSPOSE4_PS(a, b, c, d);
  _mm_store_ps(x, a), _mm_store_ps(y, b), _mm_store_ps(z, c), _mm_store_ps(w, d);
}

/// Sixteen rays, or what is left of them.
struct Packet {
  alignas(64) int valid[kPacket];

  void load(std::span<const Ray> rays, RTCRay16& out) {
    constexpr size_t kRow = sizeof(Ray) / sizeof(float);
    alignas(64) Ray padded[kPacket];
    const Ray* from = rays.data();
    if (rays.size() < kPacket) {
      std::copy(rays.begin(), rays.end(), padded);
      from = padded;
    }
    for (size_t i = 0; i < kPacket; i += 4) {
      store_columns(&from[i].origin.x, kRow, out.org_x + i, out.org_y + i, out.org_z + i, out.tnear + i);
      store_columns(&from[i].direction.x, kRow, out.dir_x + i, out.dir_y + i, out.dir_z + i, out.tfar + i);
    }
    for (size_t i = 0; i < kPacket; ++i) valid[i] = i < rays.size() && out.tnear[i] <= out.tfar[i] ? -1 : 0;
  }
};

/// What does not differ from ray to ray and what Embree leaves alone.
void set_constants(RTCRay16& ray, uint32_t ray_class) {
  std::fill_n(ray.time, kPacket, 0.0f);
  std::fill_n(ray.mask, kPacket, ray_class);
  std::fill_n(ray.id, kPacket, 0u);
  std::fill_n(ray.flags, kPacket, 0u);
}

void set_ray(const Ray& in, uint32_t ray_class, RTCRay& out) {
  out.org_x = in.origin.x, out.org_y = in.origin.y, out.org_z = in.origin.z, out.tnear = in.tnear;
  out.dir_x = in.direction.x, out.dir_y = in.direction.y, out.dir_z = in.direction.z, out.time = 0.0f;
  out.tfar = in.tfar, out.mask = ray_class, out.id = 0, out.flags = 0;
}

void occluded_packets(RTCScene scene, std::span<const Ray> rays, uint32_t ray_class, std::span<uint8_t> occluded) {
  QueryContext context(RTC_INTERSECT_CONTEXT_FLAG_COHERENT);
  Packet packet;
  RTCRay16 lanes;
  set_constants(lanes, ray_class);
  for (size_t first = 0; first < rays.size(); first += kPacket) {
    const size_t count = std::min(kPacket, rays.size() - first);
    packet.load(rays.subspan(first, count), lanes);
    rtcOccluded16(packet.valid, scene, &context, &lanes);
    // Embree sets tfar to -inf; the rays that were not traced have any value there.
    for (size_t i = 0; i < count; ++i) occluded[first + i] = packet.valid[i] != 0 && lanes.tfar[i] < 0.0f;
  }
}

void occluded_streams(RTCScene scene, std::span<const Ray> rays, uint32_t ray_class, std::span<uint8_t> occluded) {
  QueryContext context(RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT);
  alignas(64) RTCRay stream[kStream];
  for (size_t first = 0; first < rays.size(); first += kStream) {
    const size_t count = std::min(kStream, rays.size() - first);
    for (size_t i = 0; i < count; ++i) set_ray(rays[first + i], ray_class, stream[i]);
    rtcOccluded1M(scene, &context, stream, static_cast<unsigned>(count), sizeof(RTCRay));
    for (size_t i = 0; i < count; ++i)
      occluded[first + i] = stream[i].tfar < 0.0f && rays[first + i].tnear <= rays[first + i].tfar;
  }
}

} // namespace

const EmbreeTracer::Attachment& EmbreeTracer::attachment_of(uint32_t instance, uint32_t geometry) const {
  return attachments_[instance != RTC_INVALID_GEOMETRY_ID ? instance : geometry];
}

/// @param geometry RTC_INVALID_GEOMETRY_ID where there is no hit
/// @param instance RTC_INVALID_GEOMETRY_ID for hits outside Embree instances
RayHit EmbreeTracer::hit_of(float t, float u, float v, uint32_t instance, uint32_t geometry, uint32_t primitive) const {
  if (geometry == RTC_INVALID_GEOMETRY_ID) return {};
  const Attachment& attachment = attachment_of(instance, geometry);
  const uint32_t part = attachment.part + (instance != RTC_INVALID_GEOMETRY_ID ? geometry : 0u);
  return {t, u, v, attachment.placement, part, primitive};
}

void EmbreeTracer::closest_packets(std::span<const Ray> rays, uint32_t ray_class, std::span<RayHit> hits) const {
  QueryContext context(RTC_INTERSECT_CONTEXT_FLAG_COHERENT);
  Packet packet;
  RTCRayHit16 lanes;
  set_constants(lanes.ray, ray_class);
  for (size_t first = 0; first < rays.size(); first += kPacket) {
    const size_t count = std::min(kPacket, rays.size() - first);
    packet.load(rays.subspan(first, count), lanes.ray);
    std::fill_n(lanes.hit.geomID, kPacket, RTC_INVALID_GEOMETRY_ID);
    std::fill_n(lanes.hit.instID[0], kPacket, RTC_INVALID_GEOMETRY_ID);
    rtcIntersect16(packet.valid, handle(), &context, &lanes);
    for (size_t i = 0; i < count; ++i)
      hits[first + i] = hit_of(lanes.ray.tfar[i], lanes.hit.u[i], lanes.hit.v[i], lanes.hit.instID[0][i],
                               lanes.hit.geomID[i], lanes.hit.primID[i]);
  }
}

void EmbreeTracer::closest_streams(std::span<const Ray> rays, uint32_t ray_class, std::span<RayHit> hits) const {
  QueryContext context(RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT);
  alignas(64) RTCRayHit stream[kStream];
  for (size_t first = 0; first < rays.size(); first += kStream) {
    const size_t count = std::min(kStream, rays.size() - first);
    for (size_t i = 0; i < count; ++i) {
      set_ray(rays[first + i], ray_class, stream[i].ray);
      stream[i].hit.geomID = stream[i].hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    }
    rtcIntersect1M(handle(), &context, stream, static_cast<unsigned>(count), sizeof(RTCRayHit));
    for (size_t i = 0; i < count; ++i) {
      const RTCHit& hit = stream[i].hit;
      hits[first + i] = hit_of(stream[i].ray.tfar, hit.u, hit.v, hit.instID[0], hit.geomID, hit.primID);
    }
  }
}

void EmbreeTracer::closest_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder order,
                                std::span<RayHit> hits) const {
  assert(hits.size() == rays.size());
  const FlushDenormals flush;
  order == RayOrder::kCoherent ? closest_packets(rays, ray_class, hits) : closest_streams(rays, ray_class, hits);
}

void EmbreeTracer::any_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder order,
                            std::span<uint8_t> occluded) const {
  assert(occluded.size() == rays.size());
  const FlushDenormals flush;
  order == RayOrder::kCoherent ? occluded_packets(handle(), rays, ray_class, occluded)
                               : occluded_streams(handle(), rays, ray_class, occluded);
}

} // namespace packtrace
