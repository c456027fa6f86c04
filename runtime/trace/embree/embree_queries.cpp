// The ray queries of EmbreeTracer. Rays are copied to Embree in chunks on the stack.

#include <algorithm>
#include <cassert>

#include "runtime/trace/embree/embree_rays.h"
#include "runtime/trace/embree/embree_tracer.h"
#include "runtime/trace/flush_denormals.h"

namespace packtrace {
namespace {

constexpr size_t kPacket = RayPacket16::kRays;
constexpr size_t kStream = 1024; ///< rays per stream call: the pixels of a tile

/// Also used for coherent rays: rtcOccluded16 with the coherent flag was observed not to return in Debian's Embree
/// 3.13.5.
void occluded_streams(RTCScene scene, std::span<const Ray> rays, uint32_t ray_class, std::span<uint8_t> occluded) {
  EmbreeQuery context(RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT);
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

RayHit EmbreeTracer::hit_of(float t, float u, float v, uint32_t instance, uint32_t geometry, uint32_t primitive) const {
  if (geometry == RTC_INVALID_GEOMETRY_ID) return {};
  const Attachment& attachment = attachment_of(instance, geometry);
  const uint32_t part = attachment.part + (instance != RTC_INVALID_GEOMETRY_ID ? geometry : 0u);
  return {t, u, v, attachment.placement, part, primitive};
}

void EmbreeTracer::closest_packets(std::span<const Ray> rays, uint32_t ray_class, std::span<RayHit> hits) const {
  EmbreeQuery context(RTC_INTERSECT_CONTEXT_FLAG_COHERENT);
  RayPacket16 packet;
  RTCRayHit16 lanes;
  set_constants(ray_class, lanes.ray);
  for (size_t first = 0; first < rays.size(); first += kPacket) {
    const size_t count = std::min(kPacket, rays.size() - first);
    packet.load(rays.subspan(first, count), lanes.ray);
    clear_hits(lanes.hit);
    rtcIntersect16(packet.valid, handle(), &context, &lanes);
    for (size_t i = 0; i < count; ++i)
      hits[first + i] = hit_of(lanes.ray.tfar[i], lanes.hit.u[i], lanes.hit.v[i], lanes.hit.instID[0][i],
                               lanes.hit.geomID[i], lanes.hit.primID[i]);
  }
}

void EmbreeTracer::closest_streams(std::span<const Ray> rays, uint32_t ray_class, std::span<RayHit> hits) const {
  EmbreeQuery context(RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT);
  alignas(64) RTCRayHit stream[kStream];
  for (size_t first = 0; first < rays.size(); first += kStream) {
    const size_t count = std::min(kStream, rays.size() - first);
    for (size_t i = 0; i < count; ++i) {
      set_ray(rays[first + i], ray_class, stream[i]);
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

void EmbreeTracer::any_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder,
                            std::span<uint8_t> occluded) const {
  assert(occluded.size() == rays.size());
  const FlushDenormals flush;
  occluded_streams(handle(), rays, ray_class, occluded);
}

} // namespace packtrace
