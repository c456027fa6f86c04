#include "runtime/trace/embree/embree_parts.h"

#include <algorithm>
#include <string>

#include "pbrt_import/base/error.h"
#include "pbrt_import/base/progress.h"
#include "runtime/trace/source/alpha_filter.h"

namespace packtrace {

bool EmbreeTracer::Part::is_hit_ahead(const RTCFilterFunctionNArguments* args, uint32_t i) const {
  const std::vector<Vec3>& positions = tracer->surfaces_[surface].positions;
  const Triangle& t = triangles[RTCHitN_primID(args->hit, args->N, i)];
  const DVec3 a(positions[t.x]), b(positions[t.y]), c(positions[t.z]);
  const DVec3 origin(RTCRayN_org_x(args->ray, args->N, i), RTCRayN_org_y(args->ray, args->N, i),
                     RTCRayN_org_z(args->ray, args->N, i));
  const DVec3 direction(RTCRayN_dir_x(args->ray, args->N, i), RTCRayN_dir_y(args->ray, args->N, i),
                        RTCRayN_dir_z(args->ray, args->N, i));
  const DVec3 to_a = a - origin, to_b = b - origin, to_c = c - origin;
  const DVec3 normal = glm::cross(b - a, c - a);
  const double distance = glm::dot(normal, to_a) / glm::dot(normal, direction); // NaN for a ray in the plane
  if (!(distance >= static_cast<double>(RTCRayN_tnear(args->ray, args->N, i)))) return false;
  if ((RTCRayN_mask(args->ray, args->N, i) & kOcclusionRays) == 0) return true;
  const double u = glm::dot(direction, glm::cross(to_b, to_c)), v = glm::dot(direction, glm::cross(to_c, to_a)),
               w = glm::dot(direction, glm::cross(to_a, to_b));
  return (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
}

void EmbreeTracer::Part::filter(const RTCFilterFunctionNArguments* args) {
  const auto& part = *static_cast<const Part*>(args->geometryUserPtr);
  for (uint32_t i = 0; i < args->N; ++i) {
    if (args->valid[i] != -1) continue;
    if ((part.material_class & kSliverClass) != 0 && !part.is_hit_ahead(args, i)) args->valid[i] = 0;
    if ((part.material_class & kMaskedClass) == 0 || args->valid[i] != -1) continue;
    const uint32_t triangle = part.source_triangle(RTCHitN_primID(args->hit, args->N, i));
    const Vec2 barycentrics(RTCHitN_u(args->hit, args->N, i), RTCHitN_v(args->hit, args->N, i));
    const bool occlusion = (RTCRayN_mask(args->ray, args->N, i) & kOcclusionRays) != 0;
    const Attachment& attachment =
        part.tracer->attachment_of(RTCHitN_instID(args->hit, args->N, i, 0), RTCHitN_geomID(args->hit, args->N, i));
    const uint32_t instance = part.tracer->placements_[attachment.placement].instance;
    if (!surface_present(part.tracer->source_, instance, triangle, barycentrics, occlusion)) args->valid[i] = 0;
  }
}

RtcPtr<RTCSceneTy> EmbreeTracer::Device::new_scene(const EmbreeConfig& config) {
  RtcPtr<RTCSceneTy> scene(rtcNewScene(embree.get()));
  embree.check();
  const bool high = config.quality == BvhQuality::kHigh;
  rtcSetSceneBuildQuality(scene.get(), high ? RTC_BUILD_QUALITY_HIGH : RTC_BUILD_QUALITY_MEDIUM);
  const int flags =
      (config.robust ? RTC_SCENE_FLAG_ROBUST : 0) | (config.compact ? RTC_SCENE_FLAG_COMPACT : RTC_SCENE_FLAG_NONE);
  rtcSetSceneFlags(scene.get(), static_cast<RTCSceneFlags>(flags));
  rtcSetSceneProgressMonitorFunction(scene.get(), [](void*, double) { return !Progress::cancelled(); }, nullptr);
  return scene;
}

uint32_t EmbreeTracer::Device::attach(RTCScene scene, RtcPtr<RTCGeometryTy> geometry) {
  rtcCommitGeometry(geometry.get());
  const uint32_t id = rtcAttachGeometry(scene, geometry.get());
  embree.check();
  return id;
}

uint32_t EmbreeTracer::Device::attach_part(RTCScene scene, Part& part, const Surface& surface) {
  RtcPtr<RTCGeometryTy> geometry(rtcNewGeometry(embree.get(), RTC_GEOMETRY_TYPE_TRIANGLE));
  embree.check();
  rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, surface.positions.data(), 0,
                             sizeof(Vec3), surface.positions.size() - kPaddingVertices);
  rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, part.triangles.data(), 0,
                             sizeof(Triangle), part.triangles.size());
  rtcSetGeometryMask(geometry.get(), part.material_class & (kCameraRays | kOcclusionRays));
  rtcSetGeometryUserData(geometry.get(), &part);
  if ((part.material_class & (kMaskedClass | kSliverClass)) != 0) {
    rtcSetGeometryIntersectFilterFunction(geometry.get(), Part::filter);
    rtcSetGeometryOccludedFilterFunction(geometry.get(), Part::filter);
  }
  return attach(scene, std::move(geometry));
}

uint32_t EmbreeTracer::Device::attach_instance(RTCScene instanced, const Affine& unit_from_surface, uint32_t ray_mask) {
  RtcPtr<RTCGeometryTy> geometry(rtcNewGeometry(embree.get(), RTC_GEOMETRY_TYPE_INSTANCE));
  embree.check();
  rtcSetGeometryInstancedScene(geometry.get(), instanced);
  rtcSetGeometryTransform(geometry.get(), 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, &unit_from_surface[0][0]);
  rtcSetGeometryMask(geometry.get(), ray_mask);
  return attach(top.get(), std::move(geometry));
}

void EmbreeTracer::Decoded::read(const SceneSource& source, uint32_t geometry) {
  const std::string label = "geometry " + std::to_string(geometry);
  const GeometryCounts counts = source.counts(geometry);
  positions.resize(counts.vertices);
  triangles.resize(counts.triangles);
  source.decode(geometry, positions, triangles);
  bounds = bounds_of(positions);
  if (!positions.empty() && !std::all_of(positions.begin(), positions.end(), [](Vec3 p) { return is_finite(p); }))
    throw Error(ErrorKind::kInput, label + " has positions beyond the range of float");
  const auto in_range = [&](const Triangle& t) { return std::max({t.x, t.y, t.z}) < counts.vertices; };
  if (!std::all_of(triangles.begin(), triangles.end(), in_range))
    throw Error(ErrorKind::kInput, label + " has a triangle with a vertex out of range");
}

} // namespace packtrace
