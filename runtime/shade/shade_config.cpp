#include "runtime/shade/shade_config.h"

namespace packtrace {
namespace {

constexpr Setting<ShadeConfig> kShadeSettings[] = {
    {{"depth",
      "Reflections that a path follows after the surface that the camera sees, and half of the transmissions; what "
      "lies beyond is lit by the ambient light",
      0, 8},
     &ShadeConfig::depth},
    {{"shadow_depth", "Surfaces of glass that light passes on its way to a point; with 0 glass casts shadows", 0, 8},
     &ShadeConfig::shadow_depth},
    {{"ambient", "Radiance of the constant light from everywhere, which ambient occlusion darkens", 0, 1e6},
     &ShadeConfig::ambient},
    {{"light_samples", "Samples of the lights per path at the surface that the camera sees", 1, 64},
     &ShadeConfig::light_samples},
    {{"samples", "Paths per pixel and frame", 1, 64}, &ShadeConfig::samples},
    {{"light_turn",
      "Degrees by which all lights are turned about the vertical through the middle of the scene; surfaces that emit "
      "light stay",
      0, 360},
     &ShadeConfig::light_turn},
};

} // namespace

std::span<const Setting<ShadeConfig>> shade_settings() { return kShadeSettings; }

void validate(const ShadeConfig& config) { check_settings(shade_settings(), config, "shading"); }

} // namespace packtrace
