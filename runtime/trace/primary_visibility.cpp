#include "runtime/trace/primary_visibility.h"

#include <algorithm>
#include <limits>

#include <embree3/rtcore.h>

#include "runtime/trace/albedo_lookup.h"
#include "runtime/trace/ray_offset.h"
#include "runtime/trace/tiles.h"

namespace packtrace {
namespace {

constexpr uint32_t kPacketSize = 16; // 4 x 4 pixels

/// Pixel coordinates of a packet's rays; lanes outside the image are not valid.
struct PacketPixels {
  uint32_t x[kPacketSize];
  uint32_t y[kPacketSize];
  alignas(64) int valid[kPacketSize];
};

class PrimaryTracer {
public:
  PrimaryTracer(const SceneSource& source, const EmbreeScene& scene, const PrimaryCamera& now,
                const PrimaryCamera& previous, GBuffer& out)
      : source_(source), scene_(scene), now_(now), previous_(previous), moving_(!(now == previous)), out_(out) {}

  void trace_tile(const Tile& tile) const {
    for (uint32_t y = tile.y0; y < tile.y1; y += 4)
      for (uint32_t x = tile.x0; x < tile.x1; x += 4) trace_packet(x, y, tile);
  }

private:
  void trace_packet(uint32_t x0, uint32_t y0, const Tile& tile) const {
    PacketPixels pixels;
    CameraRay rays[kPacketSize]; // in unit space
    RTCRayHit16 packet;
    for (uint32_t lane = 0; lane < kPacketSize; ++lane) {
      const uint32_t x = x0 + lane % 4, y = y0 + lane / 4;
      const bool valid = x < tile.x1 && y < tile.y1;
      pixels.x[lane] = x, pixels.y[lane] = y;
      pixels.valid[lane] = valid ? -1 : 0;
      rays[lane] = now_.ray(std::min(x, tile.x1 - 1), std::min(y, tile.y1 - 1));
      rays[lane].origin = scene_.space().to_unit(rays[lane].origin);
      if (!approach(rays[lane]) && valid) {
        pixels.valid[lane] = 0;
        write_miss(static_cast<size_t>(y) * out_.size.width + x);
      }
      set_ray(packet, lane, rays[lane].origin, rays[lane].direction);
    }
    {
      const FlushDenormals flush;
      RTCIntersectContext context;
      rtcInitIntersectContext(&context);
      context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
      rtcIntersect16(pixels.valid, scene_.handle(), &context, &packet);
    }
    for (uint32_t lane = 0; lane < kPacketSize; ++lane) {
      if (!pixels.valid[lane]) continue;
      const size_t pixel = static_cast<size_t>(pixels.y[lane]) * out_.size.width + pixels.x[lane];
      if (packet.hit.geomID[lane] == RTC_INVALID_GEOMETRY_ID)
        write_miss(pixel);
      else
        write_hit(pixel, glm::dvec2(pixels.x[lane], pixels.y[lane]) + 0.5, rays[lane], packet.hit, lane);
    }
  }

  /// Moves the origin of a ray that starts far away along the ray to just before the scene: floats keep what is seen
  /// there sharp, and Embree takes origins up to 1.8e18 only. False, and a harmless ray, where it passes the scene by.
  static bool approach(CameraRay& ray) {
    constexpr double kNear = 4.0 * UnitSpace::kHalfSize; // the scene's box ends at sqrt(3) kHalfSize
    if (glm::length(ray.origin) <= kNear) return true;
    const double closest = -glm::dot(ray.origin, ray.direction);
    const DVec3 point = ray.origin + ray.direction * closest;
    if (closest > 0.0 && glm::length(point) <= kNear) {
      ray.origin = point - ray.direction * kNear;
      return true;
    }
    ray.origin = DVec3(0.0);
    return false;
  }

  static void set_ray(RTCRayHit16& packet, uint32_t lane, DVec3 origin, DVec3 direction) {
    RTCRay16& ray = packet.ray;
    ray.org_x[lane] = float(origin.x), ray.org_y[lane] = float(origin.y), ray.org_z[lane] = float(origin.z);
    ray.dir_x[lane] = float(direction.x), ray.dir_y[lane] = float(direction.y), ray.dir_z[lane] = float(direction.z);
    ray.tnear[lane] = 0.0f, ray.tfar[lane] = std::numeric_limits<float>::infinity(), ray.time[lane] = 0.0f;
    ray.mask[lane] = kCameraRays, ray.id[lane] = lane, ray.flags[lane] = 0;
    packet.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
    packet.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
  }

  void write_miss(size_t pixel) const {
    out_.view_z[pixel] = 0.0f;
    out_.position[pixel] = out_.geometric_normal[pixel] = out_.normal[pixel] = out_.albedo[pixel] = Vec3(0);
    out_.instance[pixel] = kNoInstance;
    out_.material[pixel] = 0;
    out_.offset[pixel] = 0.0f;
    out_.motion_px[pixel] = Vec2(0);
  }

  void write_hit(size_t pixel, glm::dvec2 centre_px, const CameraRay& ray, const RTCHit16& hits, uint32_t lane) const {
    const EmbreeScene::Hit hit = scene_.resolve(hits.instID[0][lane], hits.geomID[lane], hits.primID[lane]);
    const EmbreeScene::Placement& placement = *hit.placement;
    const Vec2 barycentrics(hits.u[lane], hits.v[lane]);
    const DVec3 v0(*hit.vertices[0]), e1 = DVec3(*hit.vertices[1]) - v0, e2 = DVec3(*hit.vertices[2]) - v0;
    const DVec3 cross = glm::cross(e1, e2);

    const bool placed = placement.instanced;
    const DVec3 facing = facing_normal(placed ? placement.surface_normal * cross : cross, ray.direction);
    const DVec3 interpolated = v0 + e1 * double(barycentrics.x) + e2 * double(barycentrics.y);
    const DVec3 from_barycentrics = placed ? transform_point(placement.unit_from_surface, interpolated) : interpolated;
    const DVec3 unit_position = on_ray(ray, from_barycentrics, facing);
    const DVec3 position = scene_.space().from_unit(unit_position);
    const uint32_t material = source_.material_of(placement.instance, hit.triangle);

    out_.view_z[pixel] = std::max(static_cast<float>(now_.view_z(position)), std::numeric_limits<float>::denorm_min());
    out_.position[pixel] = Vec3(position);
    out_.geometric_normal[pixel] = Vec3(facing);
    out_.normal[pixel] = shading_normal(hit, barycentrics, facing);
    out_.albedo[pixel] = surface_albedo(source_, hit.geometry, hit.triangle, material, barycentrics);
    out_.instance[pixel] = placement.instance;
    out_.material[pixel] = material;
    out_.offset[pixel] =
        static_cast<float>(ray_offset(hit, scene_.space(), unit_position, facing) / scene_.space().scale());
    out_.motion_px[pixel] = motion(position, centre_px);
  }

  /// The point of the surface's plane on the ray. Barycentrics are floats: on a large triangle they stay on the plane
  /// but stray from the pixel. Where the ray grazes the plane or leaves the triangle they are the better choice.
  static DVec3 on_ray(const CameraRay& ray, DVec3 from_barycentrics, DVec3 normal) {
    constexpr double kMinCosine = 1e-3, kMaxMove = 0x1p-20 * UnitSpace::kHalfSize;
    const double cosine = glm::dot(normal, ray.direction);
    if (!(cosine < -kMinCosine)) return from_barycentrics;
    const double t = glm::dot(normal, from_barycentrics - ray.origin) / cosine;
    const DVec3 point = ray.origin + ray.direction * t;
    return glm::distance(point, from_barycentrics) <= kMaxMove ? point : from_barycentrics;
  }

  /// Unit normal against the ray; the ray's own direction where the triangle has no area.
  static DVec3 facing_normal(DVec3 normal, DVec3 direction) {
    const double length = glm::length(normal);
    if (!(length > 0.0)) return -direction;
    return normal * ((glm::dot(normal, direction) > 0.0 ? -1.0 : 1.0) / length);
  }

  Vec3 shading_normal(const EmbreeScene::Hit& hit, Vec2 barycentrics, DVec3 geometric) const {
    const std::optional<Vec3> object_normal = source_.shading_normal(hit.geometry, hit.triangle, barycentrics);
    if (!object_normal) return Vec3(geometric);
    const DVec3 normal = hit.placement->object_normal * DVec3(*object_normal);
    const double length = glm::length(normal);
    if (!(length > 0.0)) return Vec3(geometric);
    return Vec3(normal * ((glm::dot(normal, geometric) < 0.0 ? -1.0 : 1.0) / length));
  }

  Vec2 motion(DVec3 position, glm::dvec2 centre_px) const {
    if (!moving_) return Vec2(0);
    const std::optional<ProjectedPoint> before = previous_.project(position);
    if (!before) return Vec2(kNoMotionPx);
    return Vec2(glm::clamp(centre_px - before->pixel, -double(kNoMotionPx), double(kNoMotionPx)));
  }

  const SceneSource& source_;
  const EmbreeScene& scene_;
  const PrimaryCamera& now_;
  const PrimaryCamera& previous_;
  const bool moving_;
  GBuffer& out_;
};

} // namespace

void trace_primary(const SceneSource& source, const EmbreeScene& scene, const PrimaryCamera& now,
                   const PrimaryCamera& previous, GBuffer& gbuffer, Progress& progress) {
  if (gbuffer.size != now.size() || gbuffer.view_z.size() != now.size().pixels()) gbuffer.resize(now.size());
  const PrimaryTracer tracer(source, scene, now, previous, gbuffer);
  progress.begin("primary rays", now.size().pixels());
  for_each_tile(now.size(), progress, [&](const Tile& tile) { tracer.trace_tile(tile); });
}

} // namespace packtrace
