#include "tests/benchmarks/trace_benchmark_raw.h"

#include "runtime/trace/embree/embree_device.h"
#include "runtime/trace/embree/embree_rays.h"
#include "runtime/trace/flush_denormals.h"

namespace packtrace {
namespace {

class RawEmbree final : public RayTracer {
public:
  RawEmbree(const SceneSource& source, bool robust) {
    for (const PlacedGeometry& placed : source.instances()) add(source, placed);
    positions_.resize(positions_.size() + 2, Vec3(0)); // padding: Embree reads 16 bytes at a time
    scene_.reset(rtcNewScene(device_.get()));
    rtcSetSceneFlags(scene_.get(), robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
    const RtcPtr<RTCGeometryTy> geometry(rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE));
    rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, positions_.data(), 0,
                               sizeof(Vec3), positions_.size() - 2);
    rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, triangles_.data(), 0,
                               sizeof(Triangle), triangles_.size());
    rtcSetGeometryMask(geometry.get(), ~0u);
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometry(scene_.get(), geometry.get());
    rtcCommitScene(scene_.get());
    device_.check();
  }

  std::string_view name() const override { return "raw embree"; }
  const UnitSpace& space() const override { return space_; }
  HitSurface resolve(const RayHit&) const override { return {}; }
  std::vector<ResidentPart> resident() const override { return {{"bvh", device_.bytes()}}; }

  void closest_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder, std::span<RayHit> hits) const override {
    const FlushDenormals flush;
    EmbreeQuery context(RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT);
    RTCRayHit ray;
    for (size_t i = 0; i < rays.size(); ++i) {
      hits[i] = {};
      if (!(rays[i].tnear <= rays[i].tfar)) continue;
      set_ray(rays[i], ray_class, ray);
      rtcIntersect1(scene_.get(), &context, &ray);
      if (ray.hit.geomID != RTC_INVALID_GEOMETRY_ID)
        hits[i] = {ray.ray.tfar, ray.hit.u, ray.hit.v, 0, 0, ray.hit.primID};
    }
  }
  void any_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder, std::span<uint8_t> occluded) const override {
    const FlushDenormals flush;
    EmbreeQuery context(RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT);
    RTCRay ray;
    for (size_t i = 0; i < rays.size(); ++i) {
      occluded[i] = 0;
      if (!(rays[i].tnear <= rays[i].tfar)) continue;
      set_ray(rays[i], ray_class, ray);
      rtcOccluded1(scene_.get(), &context, &ray);
      occluded[i] = ray.tfar < 0.0f;
    }
  }

private:
  void add(const SceneSource& source, const PlacedGeometry& placed) {
    const GeometryCounts counts = source.counts(placed.geometry);
    const size_t vertex = positions_.size(), triangle = triangles_.size();
    positions_.resize(vertex + counts.vertices), triangles_.resize(triangle + counts.triangles);
    const std::span positions = std::span(positions_).subspan(vertex);
    const std::span triangles = std::span(triangles_).subspan(triangle);
    source.decode(placed.geometry, positions, triangles);
    const DAffine world_from_object(placed.world_from_object);
    for (Vec3& p : positions) p = Vec3(transform_point(world_from_object, DVec3(p)));
    for (Triangle& t : triangles) t += Triangle(static_cast<uint32_t>(vertex));
  }

  UnitSpace space_; // identity: world space
  std::vector<Vec3> positions_;
  std::vector<Triangle> triangles_;
  EmbreeDevice device_;
  RtcPtr<RTCSceneTy> scene_;
};

} // namespace

std::unique_ptr<RayTracer> raw_embree(const SceneSource& source, bool robust) {
  return std::make_unique<RawEmbree>(source, robust);
}

} // namespace packtrace
