#include "runtime/camera/primary_visibility.h"

#include <algorithm>
#include <limits>
#include <tuple>

#include "runtime/camera/surface_motion.h"
#include "runtime/camera/tiles.h"
#include "runtime/trace/ray_offset.h"
#include "runtime/trace/source/albedo_lookup.h"

namespace packtrace {
namespace {

constexpr uint32_t kBlock = 4;                  ///< pixels per axis of a block of coherent rays
constexpr uint32_t kBatch = kTileSize * kBlock; ///< rays per query: a row of blocks, small enough for the level-1 cache
static_assert(kTileSize % kBlock == 0);

/// The rays of a row of blocks. Pixels of a block outside the image get rays that hit nothing (tfar < tnear).
struct RayBatch {
  uint32_t count = 0;
  Ray rays[kBatch];
  CameraRay exact[kBatch]; ///< the same rays in unit space, in double
  uint32_t x[kBatch], y[kBatch];
  RayHit hits[kBatch];
  uint32_t hit_count = 0;
  uint32_t hit_rays[kBatch];   ///< by hit: index of its ray
  HitSurface surfaces[kBatch]; ///< by hit, as the arrays below
  SurfaceQuery places[kBatch];
  SurfaceAttributes attributes[kBatch];
};

class PrimaryTracer {
public:
  PrimaryTracer(const SceneSource& source, const RayTracer& tracer, const PrimaryCamera& now,
                const PreviousFrame& previous, GBuffer& out)
      : source_(source), tracer_(tracer), space_(tracer.space()), now_(now), motion_(source, tracer, now, previous),
        out_(out) {}

  bool sees_motion() const { return motion_.any(); }

  void trace_tile(const Tile& tile) const {
    RayBatch batch;
    for (uint32_t y = tile.y0; y < tile.y1; y += kBlock) trace_row(y, tile, batch);
  }

private:
  void trace_row(uint32_t y0, const Tile& tile, RayBatch& batch) const {
    batch.count = batch.hit_count = 0;
    for (uint32_t x = tile.x0; x < tile.x1; x += kBlock)
      for (uint32_t i = 0; i < kBlock * kBlock; ++i) add_ray(x + i % kBlock, y0 + i / kBlock, tile, batch);
    tracer_.closest_hits({batch.rays, batch.count}, kCameraRays, RayOrder::kCoherent, {batch.hits, batch.count});
    for (uint32_t i = 0; i < batch.count; ++i) {
      if (batch.x[i] >= tile.x1 || batch.y[i] >= tile.y1) continue;
      batch.hits[i].valid() ? add_hit(i, batch) : write_miss(pixel_of(i, batch));
    }
    source_.look_up({batch.places, batch.hit_count}, {batch.attributes, batch.hit_count});
    for (uint32_t h = 0; h < batch.hit_count; ++h) write_hit(h, batch);
  }

  /// @param x, y pixel; may lie outside the tile
  void add_ray(uint32_t x, uint32_t y, const Tile& tile, RayBatch& batch) const {
    const uint32_t i = batch.count++;
    batch.x[i] = x, batch.y[i] = y;
    CameraRay& ray = batch.exact[i] = now_.ray(std::min(x, tile.x1 - 1), std::min(y, tile.y1 - 1));
    ray.origin = space_.to_unit(ray.origin);
    const bool traced = approach(ray) && x < tile.x1 && y < tile.y1;
    batch.rays[i] = {Vec3(ray.origin), 0.0f, Vec3(ray.direction),
                     traced ? std::numeric_limits<float>::infinity() : -1.0f};
  }

  size_t pixel_of(uint32_t i, const RayBatch& batch) const {
    return static_cast<size_t>(batch.y[i]) * out_.size.width + batch.x[i];
  }

  void add_hit(uint32_t i, RayBatch& batch) const {
    const uint32_t h = batch.hit_count++;
    batch.hit_rays[h] = i;
    batch.surfaces[h] = tracer_.resolve(batch.hits[i]);
    batch.places[h] = {batch.surfaces[h].placement->instance, batch.surfaces[h].triangle,
                       Vec2(batch.hits[i].u, batch.hits[i].v)};
  }

  /// Moves the origin of a ray that starts far away to just before the scene: floats resolve the scene there, and
  /// Embree accepts origins up to 1.8e18 only. Returns false, with a harmless ray, if the ray misses the scene.
  static bool approach(CameraRay& ray) {
    constexpr double kNear = 4.0 * UnitSpace::kHalfSize; // the corners of the scene's box lie within sqrt(3) kHalfSize
    if (glm::dot(ray.origin, ray.origin) <= kNear * kNear) return true;
    const double closest = -glm::dot(ray.origin, ray.direction);
    const DVec3 point = ray.origin + ray.direction * closest;
    if (closest > 0.0 && glm::dot(point, point) <= kNear * kNear) {
      ray.origin = point - ray.direction * kNear;
      return true;
    }
    ray.origin = DVec3(0.0);
    return false;
  }

  void write_miss(size_t pixel) const {
    out_.view_z[pixel] = 0.0f;
    out_.position[pixel] = out_.geometric_normal[pixel] = out_.normal[pixel] = out_.albedo[pixel] = Vec3(0);
    out_.instance[pixel] = kNoInstance;
    out_.triangle[pixel] = out_.material[pixel] = 0;
    out_.back_face[pixel] = 0;
    out_.offset[pixel] = 0.0f;
    out_.motion_px[pixel] = Vec2(0);
    if (motion_.any()) out_.previous_z[pixel] = 0.0f;
  }

  void write_hit(uint32_t h, const RayBatch& batch) const {
    const uint32_t i = batch.hit_rays[h];
    const CameraRay& ray = batch.exact[i];
    const HitSurface& hit = batch.surfaces[h];
    const SurfaceAttributes& attributes = batch.attributes[h];
    const Placement& placement = *hit.placement;
    const Vec2 barycentrics(batch.hits[i].u, batch.hits[i].v);
    const size_t pixel = pixel_of(i, batch);
    const DVec3 v0(hit.vertices[0]), e1 = DVec3(hit.vertices[1]) - v0, e2 = DVec3(hit.vertices[2]) - v0;
    const DVec3 cross = glm::cross(e1, e2);

    const bool placed = placement.instanced;
    const DVec3 own_normal = placed ? placement.surface_normal * cross : cross;
    const DVec3 facing = facing_normal(own_normal, ray.direction);
    const DVec3 interpolated = v0 + e1 * double(barycentrics.x) + e2 * double(barycentrics.y);
    const DVec3 from_barycentrics = placed ? transform_point(placement.unit_from_surface, interpolated) : interpolated;
    const DVec3 unit_position = on_ray(ray, from_barycentrics, facing);
    const DVec3 position = space_.from_unit(unit_position);

    out_.view_z[pixel] = std::max(static_cast<float>(now_.view_z(position)), std::numeric_limits<float>::denorm_min());
    out_.position[pixel] = Vec3(position);
    out_.geometric_normal[pixel] = Vec3(facing);
    out_.normal[pixel] = shading_normal(attributes, placement, facing);
    out_.albedo[pixel] = surface_albedo(source_, hit.geometry, hit.triangle, attributes.material, barycentrics);
    out_.instance[pixel] = placement.instance;
    out_.triangle[pixel] = hit.triangle;
    out_.material[pixel] = attributes.material;
    out_.back_face[pixel] = glm::dot(own_normal, facing) < 0.0;
    // Positions are rounded to multiples of the least denormal float, and so are sums of position and offset.
    constexpr double kMinOffset = 4.0 * double{std::numeric_limits<float>::denorm_min()};
    out_.offset[pixel] = static_cast<float>(
        std::max(ray_offset(hit, space_, unit_position, facing) * space_.inverse_scale(), kMinOffset));
    if (!motion_.any()) {
      out_.motion_px[pixel] = Vec2(0);
      return;
    }
    const SurfacePoint point{
        batch.hits[i],     hit, position, unit_position - from_barycentrics, glm::dvec2(batch.x[i], batch.y[i]) + 0.5,
        out_.view_z[pixel]};
    std::tie(out_.motion_px[pixel], out_.previous_z[pixel]) = motion_.of(point);
  }

  /// Returns the intersection of the ray with the surface's plane. Barycentrics are floats: on a large triangle the
  /// point that they yield is on the plane but off the pixel's ray. Where the ray grazes the plane, or the intersection
  /// is far from that point, that point is used.
  static DVec3 on_ray(const CameraRay& ray, DVec3 from_barycentrics, DVec3 normal) {
    constexpr double kMinCosine = 1e-3, kMaxMove = 0x1p-20 * UnitSpace::kHalfSize;
    const double cosine = glm::dot(normal, ray.direction);
    if (!(cosine < -kMinCosine)) return from_barycentrics;
    const double t = glm::dot(normal, from_barycentrics - ray.origin) / cosine;
    const DVec3 point = ray.origin + ray.direction * t;
    const DVec3 move = point - from_barycentrics;
    return glm::dot(move, move) <= kMaxMove * kMaxMove ? point : from_barycentrics;
  }

  /// Returns the unit normal that faces the ray's origin; the reversed ray direction if the triangle has no area.
  static DVec3 facing_normal(DVec3 normal, DVec3 direction) {
    const double length = glm::length(normal);
    if (!(length > 0.0)) return -direction;
    return normal * ((glm::dot(normal, direction) > 0.0 ? -1.0 : 1.0) / length);
  }

  static Vec3 shading_normal(const SurfaceAttributes& attributes, const Placement& placement, DVec3 geometric) {
    if (!attributes.has_normal) return Vec3(geometric);
    const DVec3 normal = placement.object_normal * DVec3(attributes.normal);
    const double length = glm::length(normal);
    if (!(length > 0.0)) return Vec3(geometric);
    return Vec3(normal * ((glm::dot(normal, geometric) < 0.0 ? -1.0 : 1.0) / length));
  }

  const SceneSource& source_;
  const RayTracer& tracer_;
  const UnitSpace space_;
  const PrimaryCamera& now_;
  const SurfaceMotion motion_;
  GBuffer& out_;
};

} // namespace

void trace_primary(const SceneSource& source, const RayTracer& tracer, const PrimaryCamera& now,
                   const PreviousFrame& previous, GBuffer& gbuffer, Progress& progress) {
  if (gbuffer.size != now.size() || gbuffer.view_z.size() != now.size().pixels()) gbuffer.resize(now.size());
  gbuffer.pixel_spread = static_cast<float>(now.pixel_spread());
  const PrimaryTracer primary(source, tracer, now, previous, gbuffer);
  gbuffer.previous_z.resize(primary.sees_motion() ? now.size().pixels() : 0);
  progress.begin("primary rays", now.size().pixels());
  for_each_tile(now.size(), progress, [&](const Tile& tile) { primary.trace_tile(tile); });
}

void trace_primary(const SceneSource& source, const RayTracer& tracer, const PrimaryCamera& now,
                   const PrimaryCamera& previous, GBuffer& gbuffer, Progress& progress) {
  trace_primary(source, tracer, now, PreviousFrame{previous}, gbuffer, progress);
}

} // namespace packtrace
