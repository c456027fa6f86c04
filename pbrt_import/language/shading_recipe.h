#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "pbrt_import/language/spectrum.h"
#include "pbrt_import/language/texture_parameters.h"
#include "pbrt_import/scene/shading.h"

namespace packtrace {

/// A pbrt material reduced to its shading, with textures still as graph nodes; SurfaceShading has their
/// averages.
struct ShadingRecipe {
  using Node = TextureGraph::Node;

  ShadingBits bits = 0;
  Node diffuse = 0; ///< factor of the albedo
  Node specular = 0, transmission = 0;
  Node roughness_u = 0, roughness_v = 0, sigma = 0, eta = 0;
  bool remap = false; ///< roughness is pbrt's value for users, not the alpha of a distribution
  MetalIndices metal{Vec3(1.0f), Vec3(0.0f)};
};

/// Reads the parameters of a material that is not a mix.
/// @param kind a kind of pbrt-v3's materials
/// @param metal indices of refraction of a metal
/// @param reduced receives what shading leaves out or approximates, one sentence part each
/// Source: pbrt-v3's materials, for parameters and their defaults.
ShadingRecipe shading_recipe(std::string_view kind, const TextureParameters& parameters, const MetalIndices& metal,
                             std::vector<std::string>& reduced);

/// The mix of two materials: colours, roughness and indices are interpolated; the rest is that of the heavier one.
/// @param amount weight of `a`
ShadingRecipe mixed_shading(const ShadingRecipe& a, const ShadingRecipe& b, TextureGraph::Node amount,
                            TextureGraph& graph);

/// A Lambert surface.
ShadingRecipe matte_shading(TextureGraph& graph);

/// Averages the recipe's textures, after the images were read.
/// @param outside receives the names of values that leave their range and are moved into it
SurfaceShading resolved(const ShadingRecipe& recipe, TextureGraph& graph, std::vector<std::string>& outside);

/// Calls visit(node) for the recipe's nodes.
template <class Visit>
void for_each_node(const ShadingRecipe& recipe, const Visit& visit) {
  for (const TextureGraph::Node node : {recipe.diffuse, recipe.specular, recipe.transmission, recipe.roughness_u,
                                        recipe.roughness_v, recipe.sigma, recipe.eta})
    visit(node);
}

/// The alpha of pbrt's distributions for a roughness in [0, 1] with "remaproughness".
/// Source: pbrt-v3, TrowbridgeReitzDistribution::RoughnessToAlpha.
float alpha_of_roughness(float roughness);

} // namespace packtrace
