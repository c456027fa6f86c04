#pragma once

#include <cstdint>
#include <vector>

#include "runtime/shade/hit_surfaces.h"

namespace packtrace {

/// Kinds of surfaces that light may pass in a scene.
enum class Glass : uint8_t {
  kNone,    ///< nothing
  kClear,   ///< surfaces that occlusion rays do not meet (kTransmissive)
  kPartial, ///< also surfaces that occlude, such as those with an opacity between 0 and 1
};

/// Shadow rays from the surfaces of a tile to lights, with the radiance that they carry.
class ShadowRays {
public:
  void clear() { rays_.clear(), carried_.clear(); }
  size_t size() const { return rays_.size(); }

  /// @param ray in the tracer's space, with a direction of unit length
  /// @param pixel in the tile's list
  void add(const Ray& ray, uint32_t pixel, Vec3 radiance) {
    rays_.push_back(ray);
    carried_.push_back({pixel, radiance});
  }

  /// Traces the rays and calls arrive(pixel, radiance) for those that nothing opaque blocks, in their order. Surfaces
  /// that transmit light colour it.
  /// @param shadow_depth number of them that light passes
  template <class Arrive>
  void trace(const RayTracer& tracer, const HitSurfaces& surfaces, Glass glass, uint32_t shadow_depth,
             const Arrive& arrive) {
    occluded_.assign(rays_.size(), 0);
    if (glass != Glass::kPartial) tracer.any_hits(rays_, kOcclusionRays, RayOrder::kIncoherent, occluded_);
    if (glass != Glass::kNone) pass_glass(tracer, surfaces, shadow_depth);
    for (size_t i = 0; i < rays_.size(); ++i)
      if (occluded_[i] == 0) arrive(carried_[i].pixel, carried_[i].radiance);
  }

private:
  struct Carried {
    uint32_t pixel;
    Vec3 radiance;
  };
  void pass_glass(const RayTracer& tracer, const HitSurfaces& surfaces, uint32_t shadow_depth);

  std::vector<Ray> rays_, open_;
  std::vector<Carried> carried_;
  std::vector<uint8_t> occluded_;
  std::vector<uint32_t> open_rays_; ///< numbers of open_
  std::vector<RayHit> hits_, valid_;
  std::vector<Ray> hit_rays_;
  std::vector<HitPoint> points_;
};

} // namespace packtrace
