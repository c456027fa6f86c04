#include "tests/compress/lod/surface_distance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <tbb/parallel_for.h>

namespace packtrace {
namespace {

struct Query {
  std::span<const DVec3> positions;
  std::span<const Triangle> triangles;
  DVec3 point;
  double rounding; ///< of coordinates to float
  double best2 = std::numeric_limits<double>::infinity();
};

double squared(DVec3 v) { return glm::dot(v, v); }

double segment_distance2(DVec3 p, DVec3 a, DVec3 b) {
  const double length2 = squared(b - a);
  const double t = length2 > 0.0 ? std::clamp(glm::dot(p - a, b - a) / length2, 0.0, 1.0) : 0.0;
  return squared(p - a - t * (b - a));
}

/// By planes through the sides instead of products of dot products, which are inexact for long needles.
double triangle_distance2(DVec3 p, const std::array<DVec3, 3>& corners) {
  const DVec3 normal = glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
  double to_sides = std::numeric_limits<double>::infinity();
  bool is_over = squared(normal) > 0.0;
  for (size_t i = 0; i < 3; ++i) {
    const DVec3 &a = corners[i], &b = corners[(i + 1) % 3];
    is_over = is_over && glm::dot(glm::cross(normal, b - a), p - a) >= 0.0;
    to_sides = std::min(to_sides, segment_distance2(p, a, b));
  }
  if (!is_over) return to_sides;
  const double height = glm::dot(normal, p - corners[0]);
  return std::min(to_sides, height * height / squared(normal));
}

bool visit(RTCPointQueryFunctionArguments* args) {
  auto& query = *static_cast<Query*>(args->userPtr);
  const Triangle& t = query.triangles[args->primID];
  const double distance2 =
      triangle_distance2(query.point, {query.positions[t.x], query.positions[t.y], query.positions[t.z]});
  if (!(distance2 < query.best2)) return false;
  query.best2 = distance2;
  // Slightly larger, as boxes and queries are rounded to float.
  args->query->radius = static_cast<float>(std::sqrt(distance2) * 1.000001 + query.rounding);
  return true;
}

} // namespace

SurfaceDistance::SurfaceDistance(std::span<const DVec3> positions, std::span<const Triangle> triangles)
    : positions_(positions), triangles_(triangles), device_(rtcNewDevice(nullptr)), scene_(rtcNewScene(device_)) {
  RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, positions.size()));
  for (size_t i = 0; i < positions.size(); ++i)
    for (int axis = 0; axis < 3; ++axis)
      vertices[3 * i + static_cast<size_t>(axis)] = static_cast<float>(positions[i][axis]);
  auto* indices = static_cast<uint32_t*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, triangles.size()));
  for (size_t i = 0; i < triangles.size(); ++i)
    for (int corner = 0; corner < 3; ++corner) indices[3 * i + static_cast<size_t>(corner)] = triangles[i][corner];
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene_, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene_);
}

SurfaceDistance::~SurfaceDistance() {
  rtcReleaseScene(scene_);
  rtcReleaseDevice(device_);
}

double SurfaceDistance::operator()(DVec3 point) const {
  const double size = std::max({std::abs(point.x), std::abs(point.y), std::abs(point.z)});
  Query query{positions_, triangles_, point, 4.0 * std::numeric_limits<float>::epsilon() * size};
  RTCPointQuery rtc_query{static_cast<float>(point.x), static_cast<float>(point.y), static_cast<float>(point.z), 0.0f,
                          std::numeric_limits<float>::infinity()};
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(scene_, &rtc_query, &context, visit, &query);
  return std::sqrt(query.best2);
}

DistanceStats surface_distance(std::span<const DVec3> from_positions, std::span<const Triangle> from_triangles,
                               const SurfaceDistance& to, size_t samples) {
  double total = 0.0;
  std::vector<double> areas(from_triangles.size());
  for (size_t i = 0; i < areas.size(); ++i) {
    const Triangle& t = from_triangles[i];
    areas[i] =
        glm::length(glm::cross(from_positions[t.y] - from_positions[t.x], from_positions[t.z] - from_positions[t.x]));
    total += areas[i];
  }
  std::vector<uint8_t> is_corner(from_positions.size());
  for (const Triangle& t : from_triangles) is_corner[t.x] = is_corner[t.y] = is_corner[t.z] = 1;
  std::vector<double> corner_distances(from_positions.size());
  tbb::parallel_for(size_t{0}, from_positions.size(), [&](size_t i) {
    if (is_corner[i] != 0) corner_distances[i] = to(from_positions[i]);
  });
  std::vector<double> max(areas.size()), weighted(areas.size());
  tbb::parallel_for(size_t{0}, areas.size(), [&](size_t i) {
    const Triangle& t = from_triangles[i];
    const DVec3 &a = from_positions[t.x], &b = from_positions[t.y], &c = from_positions[t.z];
    double largest = std::max({corner_distances[t.x], corner_distances[t.y], corner_distances[t.z]});
    const auto count = 1 + static_cast<size_t>(total > 0.0 ? areas[i] / total * static_cast<double>(samples) : 0.0);
    double sum2 = 0.0;
    for (size_t k = 0; k < count; ++k) { // a planar lattice folded into the triangle
      double u = std::fmod(0.5 + static_cast<double>(k) * 0.7548776662466927, 1.0);
      double v = std::fmod(0.25 + static_cast<double>(k) * 0.5698402909980532, 1.0);
      if (u + v > 1.0) u = 1.0 - u, v = 1.0 - v;
      const double d = to(a + u * (b - a) + v * (c - a));
      largest = std::max(largest, d), sum2 += d * d;
    }
    max[i] = largest, weighted[i] = sum2 / static_cast<double>(count) * areas[i];
  });
  DistanceStats stats;
  double sum = 0.0;
  for (size_t i = 0; i < areas.size(); ++i) stats.max = std::max(stats.max, max[i]), sum += weighted[i];
  stats.rms = total > 0.0 ? std::sqrt(sum / total) : 0.0;
  return stats;
}

} // namespace packtrace
