#include "runtime/measure/nearest_surface.h"

#include <algorithm>
#include <cassert>
#include <limits>

namespace packtrace {
namespace {

/// Bound of the distance error of Embree's search in floats, for coordinates within [-1, 1].
constexpr double kPad = 64.0 * std::numeric_limits<float>::epsilon();

struct Search {
  std::span<const DVec3> positions;
  std::span<const Triangle> triangles;
  DVec3 p;
  NearestPoint best;
};

bool visit(RTCPointQueryFunctionArguments* arguments) {
  Search& search = *static_cast<Search*>(arguments->userPtr);
  const Triangle t = search.triangles[arguments->primID];
  NearestPoint found =
      nearest_on_triangle(search.p, search.positions[t.x], search.positions[t.y], search.positions[t.z]);
  found.triangle = arguments->primID;
  // The smaller number wins a tie, so that the result does not depend on the order of the tree.
  const bool nearer = found.distance < search.best.distance ||
                      (found.distance == search.best.distance && found.triangle < search.best.triangle);
  if (!nearer) return false;
  search.best = found;
  arguments->query->radius = static_cast<float>(found.distance * (1.0 + 1e-6) + kPad);
  return true;
}

NearestPoint nearest_on_segment(DVec3 p, DVec3 a, DVec3 b, Vec2 at_a, Vec2 at_b) {
  const DVec3 ab = b - a;
  const double length = glm::dot(ab, ab);
  const double t = length > 0.0 ? std::clamp(glm::dot(p - a, ab) / length, 0.0, 1.0) : 0.0;
  return {glm::length(p - (a + t * ab)), 0, at_a + static_cast<float>(t) * (at_b - at_a)};
}

} // namespace

NearestPoint nearest_on_triangle(DVec3 p, DVec3 a, DVec3 b, DVec3 c) {
  const DVec3 ab = b - a, ac = c - a, n = glm::cross(ab, ac);
  const double area = glm::dot(n, n);
  if (area > 0.0) {
    const DVec3 ap = p - a;
    const double v = glm::dot(glm::cross(ap, ac), n) / area, w = glm::dot(glm::cross(ab, ap), n) / area;
    if (v >= 0.0 && w >= 0.0 && v + w <= 1.0)
      return {glm::length(p - (a + v * ab + w * ac)), 0, Vec2(static_cast<float>(v), static_cast<float>(w))};
  }
  const Vec2 at_a(0, 0), at_b(1, 0), at_c(0, 1);
  NearestPoint best = nearest_on_segment(p, a, b, at_a, at_b);
  for (const NearestPoint& other : {nearest_on_segment(p, b, c, at_b, at_c), nearest_on_segment(p, c, a, at_c, at_a)})
    if (other.distance < best.distance) best = other;
  return best;
}

NearestSurface::NearestSurface(EmbreeDevice& device, std::span<const DVec3> positions,
                               std::span<const Triangle> triangles)
    : positions_(positions), triangles_(triangles), scene_(rtcNewScene(device.get())) {
  assert(!triangles.empty());
  const RtcPtr<RTCGeometryTy> mesh(rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_TRIANGLE));
  auto* vertices = static_cast<Vec3*>(rtcSetNewGeometryBuffer(mesh.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                              sizeof(Vec3), positions.size()));
  auto* indices = static_cast<Triangle*>(rtcSetNewGeometryBuffer(mesh.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                                 sizeof(Triangle), triangles.size()));
  device.check();
  for (size_t i = 0; i < positions.size(); ++i) vertices[i] = Vec3(positions[i]);
  std::ranges::copy(triangles, indices);
  rtcSetSceneBuildQuality(scene_.get(), RTC_BUILD_QUALITY_LOW); // there are few queries per triangle
  rtcCommitGeometry(mesh.get());
  rtcAttachGeometry(scene_.get(), mesh.get());
  rtcCommitScene(scene_.get());
  device.check();
}

NearestPoint NearestSurface::nearest(DVec3 p) const {
  Search search{positions_, triangles_, p, {std::numeric_limits<double>::infinity(), ~0u, Vec2(0)}};
  RTCPointQuery query{};
  query.x = static_cast<float>(p.x), query.y = static_cast<float>(p.y), query.z = static_cast<float>(p.z);
  query.radius = std::numeric_limits<float>::infinity();
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(scene_.get(), &query, &context, visit, &search);
  return search.best;
}

} // namespace packtrace
