#include "runtime/shade/shadow_rays.h"

#include <algorithm>

#include "runtime/shade/bsdf.h"

namespace packtrace {
namespace {

/// Fraction of light that passes a surface straight on.
Vec3 passed(const Material& material, const HitPoint& point, Vec3 direction) {
  const ShadedSurface surface(material.shading, point.albedo);
  if (!surface.transmits()) return Vec3(occludes(material.flags) ? 0.0f : 1.0f);
  const float cosine = std::clamp(-glm::dot(direction, point.normal), 0.0f, 1.0f);
  if (surface.shading.bits & kThin) return surface.transmission;
  if (surface.shading.fresnel() != kFresnelDielectric) return surface.transmission;
  // From inside, the angle is taken as that outside: light passes straight on, so that it is not reflected totally.
  return surface.transmission * (1.0f - fresnel_dielectric(cosine, surface.shading.eta));
}

} // namespace

/// Follows the rays that are not blocked yet through the surfaces that transmit light.
void ShadowRays::pass_glass(const RayTracer& tracer, const HitSurfaces& surfaces, uint32_t shadow_depth) {
  open_.clear(), open_rays_.clear();
  for (uint32_t i = 0; i < rays_.size(); ++i)
    if (occluded_[i] == 0) open_.push_back(rays_[i]), open_rays_.push_back(i);
  for (uint32_t layer = 0; !open_.empty(); ++layer) {
    hits_.resize(open_.size());
    tracer.closest_hits(open_, kCameraRays, RayOrder::kIncoherent, hits_);
    hit_rays_.clear(), valid_.clear();
    size_t kept = 0;
    for (size_t i = 0; i < open_.size(); ++i) {
      if (!hits_[i].valid()) continue;
      hit_rays_.push_back(open_[i]), valid_.push_back(hits_[i]);
      open_rays_[kept++] = open_rays_[i];
    }
    open_rays_.resize(kept);
    surfaces.look_up(hit_rays_, valid_, {}, points_);
    open_.clear();
    kept = 0;
    for (size_t i = 0; i < valid_.size(); ++i) {
      const uint32_t ray = open_rays_[i];
      const HitPoint& point = points_[i];
      const Vec3 through = passed(surfaces.material(point), point, hit_rays_[i].direction);
      carried_[ray].radiance *= through;
      const Ray& before = hit_rays_[i];
      const Ray after = surfaces.leaving(point, before.direction, before.tfar - valid_[i].t);
      if (layer >= shadow_depth || through == Vec3(0.0f))
        occluded_[ray] = 1;
      else if (after.tfar > 0.0f)
        open_.push_back(after), open_rays_[kept++] = ray;
    }
    open_rays_.resize(kept);
  }
}

} // namespace packtrace
