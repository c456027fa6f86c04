#include "runtime/ao/ao_config.h"

#include <cmath>

namespace packtrace {
namespace {

using A = AoConfig;

constexpr Setting<AoConfig> kSettings[] = {
    {{"radius", "Distance up to which surfaces occlude, in world units; 0 takes relative_radius", 0, 3e38}, &A::radius},
    {{"relative_radius", "The same as a fraction of the diagonal of the scene's bounds", 1e-6, 100},
     &A::relative_radius},
    {{"spp", "Samples per pixel and frame", 1, 65536}, &A::spp},
    {{"falloff", "Let occlusion fade with the distance of a hit", 0, 1}, &A::falloff},
    {{"lambda", "Speed of the falloff: occlusion is exp(-lambda x^2) at x radii", 0, 20}, &A::lambda},
    {{"cutoff", "Occlusion below which hits do not count; it ends rays before the radius", 0, 1}, &A::cutoff},
    {{"continuous", "Rescale the falloff so that it reaches 0 at the cutoff; off leaves a step", 0, 1}, &A::continuous},
    {{"min_visibility", "Visibility of a fully occluded sample", 0, 1}, &A::min_visibility},
    {{"interreflection", "Fraction of light that occluding surfaces reflect", 0, 1}, &A::interreflection},
    {{"offset_scale", "Factor of the distance between surfaces and the origins of their rays", 0, 1000},
     &A::offset_scale},
    {{"sampler_block", "Side in pixels of the blocks that share a set of sampler jitter", 1, 8}, &A::sampler_block},
    {{"sort_rays", "Trace rays in the order of their directions; changes no result", 0, 1}, &A::sort_rays},
};

} // namespace

std::span<const Setting<AoConfig>> ao_settings() { return kSettings; }

void validate(const AoConfig& config) { check_settings(ao_settings(), config, "ambient occlusion"); }

float ao_radius(const AoConfig& config, const Bounds& bounds) {
  if (config.radius > 0.0f) return config.radius;
  const double radius = double{config.relative_radius} * bounds.diagonal();
  return radius > 0.0 && std::isfinite(radius) ? static_cast<float>(radius) : 1.0f;
}

} // namespace packtrace
