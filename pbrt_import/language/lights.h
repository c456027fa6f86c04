#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "pbrt_import/language/parser.h"
#include "pbrt_import/language/texture_parameters.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// Collects the LightSource directives of a scene.
class LightCollector {
public:
  /// Reads a LightSource and reports its problems. A light that cannot be placed, of an unknown kind or without
  /// brightness is left out.
  /// @param world_from_light the current transform
  void add(const Directive& directive, const TextureContext& context, const DAffine& world_from_light);

  /// The lights and their maps, once the images were read.
  void finish(TextureGraph& graph, Scene& scene);

private:
  bool read_infinite(const Directive& directive, const TextureContext& context, const DAffine& world_from_light,
                     Light& light);
  std::optional<uint32_t> read_map(const Directive& directive, const TextureContext& context);

  std::vector<Light> lights_;
  std::vector<uint32_t> maps_; ///< image requests, by Light::map
};

/// A light's brightness: its spectrum `name`, 1 by default, times its "scale". Reports negative components, which
/// become 0. nullopt, reported, if it leaves the range of numbers.
std::optional<Vec3> light_brightness(const TextureParameters& parameters, std::string_view name);

} // namespace packtrace
