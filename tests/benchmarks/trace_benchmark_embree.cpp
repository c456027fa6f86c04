#include "tests/benchmarks/trace_benchmark_embree.h"

#include "runtime/trace/embree/embree_rays.h"
#include "runtime/trace/flush_denormals.h"
#include "tests/benchmarks/trace_benchmark_rays.h"

namespace packtrace {
namespace {

constexpr size_t kStream = 1024;

struct Query {
  RTCScene scene;
  std::span<const Ray> rays;
  uint32_t ray_class;
  RayOrder order;

  RTCIntersectContextFlags flag() const {
    return order == RayOrder::kCoherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  }
};

/// Copies Embree's IDs without looking up the instance, which is not part of the measurement.
RayHit hit_of(float t, float u, float v, uint32_t instance, uint32_t geometry, uint32_t primitive) {
  static_assert(RTC_INVALID_GEOMETRY_ID == ~0u); // + 1 makes it 0, a valid placement
  return geometry == RTC_INVALID_GEOMETRY_ID ? RayHit{} : RayHit{t, u, v, instance + 1, geometry, primitive};
}

void closest_single(const Query& q, std::span<RayHit> hits) {
  EmbreeQuery context(q.flag());
  RTCRayHit ray;
  for (size_t i = 0; i < q.rays.size(); ++i) {
    hits[i] = {};
    if (is_gap(q.rays[i])) continue;
    set_ray(q.rays[i], q.ray_class, ray);
    rtcIntersect1(q.scene, &context, &ray);
    hits[i] = hit_of(ray.ray.tfar, ray.hit.u, ray.hit.v, ray.hit.instID[0], ray.hit.geomID, ray.hit.primID);
  }
}

void any_single(const Query& q, std::span<uint8_t> occluded) {
  EmbreeQuery context(q.flag());
  RTCRay ray;
  for (size_t i = 0; i < q.rays.size(); ++i) {
    occluded[i] = 0;
    if (is_gap(q.rays[i])) continue;
    set_ray(q.rays[i], q.ray_class, ray);
    rtcOccluded1(q.scene, &context, &ray);
    occluded[i] = ray.tfar < 0.0f;
  }
}

void closest_packets(const Query& q, std::span<RayHit> hits) {
  EmbreeQuery context(q.flag());
  RayPacket16 packet;
  RTCRayHit16 lanes;
  set_constants(q.ray_class, lanes.ray);
  for (size_t first = 0; first < q.rays.size(); first += RayPacket16::kRays) {
    const size_t count = std::min(RayPacket16::kRays, q.rays.size() - first);
    packet.load(q.rays.subspan(first, count), lanes.ray);
    clear_hits(lanes.hit);
    rtcIntersect16(packet.valid, q.scene, &context, &lanes);
    for (size_t i = 0; i < count; ++i)
      hits[first + i] = hit_of(lanes.ray.tfar[i], lanes.hit.u[i], lanes.hit.v[i], lanes.hit.instID[0][i],
                               lanes.hit.geomID[i], lanes.hit.primID[i]);
  }
}

void any_packets(const Query& q, std::span<uint8_t> occluded) {
  EmbreeQuery context(RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT); // see embree_queries.cpp
  RayPacket16 packet;
  RTCRay16 lanes;
  set_constants(q.ray_class, lanes);
  for (size_t first = 0; first < q.rays.size(); first += RayPacket16::kRays) {
    const size_t count = std::min(RayPacket16::kRays, q.rays.size() - first);
    packet.load(q.rays.subspan(first, count), lanes);
    rtcOccluded16(packet.valid, q.scene, &context, &lanes);
    for (size_t i = 0; i < count; ++i) occluded[first + i] = packet.valid[i] != 0 && lanes.tfar[i] < 0.0f;
  }
}

void closest_stream(const Query& q, std::span<RayHit> hits) {
  EmbreeQuery context(q.flag());
  alignas(64) RTCRayHit stream[kStream];
  for (size_t first = 0; first < q.rays.size(); first += kStream) {
    const size_t count = std::min(kStream, q.rays.size() - first);
    for (size_t i = 0; i < count; ++i) set_ray(q.rays[first + i], q.ray_class, stream[i]);
    rtcIntersect1M(q.scene, &context, stream, static_cast<unsigned>(count), sizeof(RTCRayHit));
    for (size_t i = 0; i < count; ++i) {
      const RTCHit& hit = stream[i].hit;
      hits[first + i] = hit_of(stream[i].ray.tfar, hit.u, hit.v, hit.instID[0], hit.geomID, hit.primID);
    }
  }
}

void any_stream(const Query& q, std::span<uint8_t> occluded) {
  EmbreeQuery context(q.flag());
  alignas(64) RTCRay stream[kStream];
  for (size_t first = 0; first < q.rays.size(); first += kStream) {
    const size_t count = std::min(kStream, q.rays.size() - first);
    for (size_t i = 0; i < count; ++i) set_ray(q.rays[first + i], q.ray_class, stream[i]);
    rtcOccluded1M(q.scene, &context, stream, static_cast<unsigned>(count), sizeof(RTCRay));
    for (size_t i = 0; i < count; ++i) occluded[first + i] = stream[i].tfar < 0.0f && !is_gap(q.rays[first + i]);
  }
}

class DirectEmbree final : public RayTracer {
public:
  DirectEmbree(const EmbreeTracer& tracer, EmbreeCall call) : tracer_(tracer), call_(call) {}
  std::string_view name() const override { return tracer_.name(); }
  std::string_view isa() const override { return tracer_.isa(); }
  const UnitSpace& space() const override { return tracer_.space(); }
  HitSurface resolve(const RayHit& hit) const override {
    return tracer_.resolve(tracer_.hit_of(hit.t, hit.u, hit.v, hit.placement - 1, hit.part, hit.triangle));
  }
  std::vector<ResidentPart> resident() const override { return tracer_.resident(); }

  void closest_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder order,
                    std::span<RayHit> hits) const override {
    const FlushDenormals flush;
    const Query query{tracer_.handle(), rays, ray_class, order};
    switch (call_) {
    case EmbreeCall::kSingle:
      return closest_single(query, hits);
    case EmbreeCall::kPacket16:
      return closest_packets(query, hits);
    case EmbreeCall::kStream:
      return closest_stream(query, hits);
    }
  }
  void any_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder order,
                std::span<uint8_t> occluded) const override {
    const FlushDenormals flush;
    const Query query{tracer_.handle(), rays, ray_class, order};
    switch (call_) {
    case EmbreeCall::kSingle:
      return any_single(query, occluded);
    case EmbreeCall::kPacket16:
      return any_packets(query, occluded);
    case EmbreeCall::kStream:
      return any_stream(query, occluded);
    }
  }

private:
  const EmbreeTracer& tracer_;
  EmbreeCall call_;
};

} // namespace

std::unique_ptr<RayTracer> direct_embree(const EmbreeTracer& tracer, EmbreeCall call) {
  return std::make_unique<DirectEmbree>(tracer, call);
}

} // namespace packtrace
