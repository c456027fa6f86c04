#include "runtime/camera/origin_lift.h"

#include "runtime/camera/lod_view.h"
#include "runtime/camera/tiles.h"

namespace packtrace {
namespace {

constexpr uint32_t kTilePixels = kTileSize * kTileSize;
/// Length of the upward rays, as a fraction of the allowed error. Error bounds are seldom reached, and a hit farther up
/// is more often another part of a thin object.
constexpr double kReach = 0.5;

class OriginLift {
public:
  OriginLift(const RayTracer& coarse, const PrimaryCamera& camera, double error_px, GBuffer& gbuffer)
      : coarse_(coarse), camera_(camera), error_px_(error_px), g_(gbuffer) {}

  void lift_tile(const Tile& tile) const {
    Ray rays[kTilePixels];
    size_t pixels[kTilePixels];
    uint32_t count = 0;
    for (uint32_t y = tile.y0; y < tile.y1; ++y)
      for (uint32_t x = tile.x0; x < tile.x1; ++x) {
        const size_t pixel = static_cast<size_t>(y) * g_.size.width + x;
        if (g_.instance[pixel] == kNoInstance) continue;
        pixels[count] = pixel;
        rays[count++] = upwards(pixel);
      }
    RayHit hits[kTilePixels];
    coarse_.closest_hits({rays, count}, kOcclusionRays, RayOrder::kIncoherent, {hits, count});
    for (uint32_t i = 0; i < count; ++i)
      if (hits[i].valid() && from_below(hits[i], pixels[i])) {
        float& offset = g_.offset[pixels[i]];
        offset += offset + static_cast<float>(hits[i].t * coarse_.space().inverse_scale());
      }
  }

private:
  /// Returns the ray from a pixel's point along its geometric normal; t is in unit-space lengths.
  Ray upwards(size_t pixel) const {
    const DVec3 position(g_.position[pixel]), normal(g_.geometric_normal[pixel]);
    const double reach = kReach * error_px_ * pixel_width(camera_, position) * coarse_.space().scale();
    const DVec3 origin = position + normal * static_cast<double>(g_.offset[pixel]);
    return {Vec3(coarse_.space().to_unit(origin)), 0.0f, Vec3(normal), static_cast<float>(reach)};
  }

  bool from_below(const RayHit& hit, size_t pixel) const {
    const HitSurface surface = coarse_.resolve(hit);
    const Placement& placement = *surface.placement;
    if (placement.instance != g_.instance[pixel]) return false;
    const DVec3 v0(surface.vertices[0]);
    const DVec3 cross = glm::cross(DVec3(surface.vertices[1]) - v0, DVec3(surface.vertices[2]) - v0);
    const DVec3 own_normal = placement.instanced ? placement.surface_normal * cross : cross;
    const double up = glm::dot(own_normal, DVec3(g_.geometric_normal[pixel]));
    return g_.back_face[pixel] != 0 ? up < 0.0 : up > 0.0;
  }

  const RayTracer& coarse_;
  const PrimaryCamera& camera_;
  const double error_px_;
  GBuffer& g_;
};

} // namespace

void lift_origins(const RayTracer& coarse, const PrimaryCamera& camera, double error_px, GBuffer& gbuffer,
                  Progress& progress) {
  const OriginLift lift(coarse, camera, error_px, gbuffer);
  progress.begin("origins", gbuffer.size.pixels());
  for_each_tile(gbuffer.size, progress, [&](const Tile& tile) { lift.lift_tile(tile); });
}

} // namespace packtrace
