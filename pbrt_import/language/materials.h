#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <unordered_map>
#include <vector>

#include "pbrt_import/language/graphics_state.h"
#include "pbrt_import/language/parser.h"
#include "pbrt_import/language/shading_recipe.h"
#include "pbrt_import/language/texture_parameters.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// A pbrt material reduced to the properties of a scene's Material, with textures still as graph nodes.
struct MaterialRecipe {
  std::string name; ///< the MakeNamedMaterial name, or the material's kind
  MaterialFlags flags = 0;
  TextureGraph::Node albedo = 0;
  ShadingRecipe shading;
  MetalIndices metal; ///< only set for metals
};

/// A recipe together with a shape's alpha textures and area light.
struct MaterialUse {
  uint32_t recipe = 0;
  uint32_t alpha = kNone;        ///< texture node; kNone: opaque
  uint32_t shadow_alpha = kNone; ///< texture node
  uint32_t area_light = kNone;   ///< like Attributes::area_light
  uint32_t emission = kNone;     ///< like Attributes::emission; kNone if area_light is
  auto operator<=>(const MaterialUse&) const = default;
};

/// All materials of a scene, addressed by number.
class MaterialLibrary {
public:
  explicit MaterialLibrary(TextureGraph& graph);

  /// Also reads what shading needs (Material::shading). Call before the first material.
  void keep_shading() { shading_ = true; }
  /// Number of an area light's radiance, for MaterialUse::emission. Equal ones get the same number.
  uint32_t emission(Vec3 radiance);

  /// Number of pbrt's default material, for shapes before any Material directive.
  static constexpr uint32_t kDefault = 0;

  /// Defines a material from a Material or MakeNamedMaterial directive and returns its number. Reports problems;
  /// unknown kinds become matte.
  uint32_t define(const Directive& directive, const TextureContext& context);

  /// Number of the material of a shape: `base`, or a new material if the shape's parameters override some of base's.
  /// Marks the parameters that it uses as used.
  uint32_t with_shape_parameters(uint32_t base, const ParameterList& shape, const TextureContext& context);

  /// Registers a use and returns its number, which the shape holds until resolve(). Equal uses get the same number.
  uint32_t use(const MaterialUse& use);

  /// Marks the images that the used materials depend on as needed.
  /// @param colours whether resolve() is to make textures
  void require_images(bool colours);

  /// Makes the scene's materials from all uses, merging equal ones, with their alpha masks, and their textures if
  /// require_images() was called with colours. Call once, after the images are read.
  /// @param memory grows by the size of the textures
  /// @return for each use, its index in scene.materials
  /// Throws MemoryError.
  std::vector<uint32_t> resolve(Scene& scene, MemoryReservation& memory, Reporter& reporter);

private:
  struct Definition {
    std::string kind;
    /// Shared by the materials that shapes derive from this one; null: none.
    std::shared_ptr<const ParameterList> parameters;
    MaterialRecipe recipe;
    Place place; ///< of the Material directive, or of the Shape that overrides parameters
  };
  uint32_t add(std::string kind, std::string name, const TextureParameters& parameters,
               std::vector<std::string>& reduced);
  SurfaceShading shading_of(const Definition& definition, const MaterialUse& use, Reporter& reporter);
  uint32_t number_of(const SurfaceShading& shading);
  Vec3 albedo_of(const Definition& definition, Reporter& reporter);
  uint32_t texture_of(const Definition& definition, Scene& scene, MemoryReservation& memory, Reporter& reporter);
  uint32_t add_texture(std::vector<AlbedoTexture>& textures, AlbedoTexture texture);

  TextureGraph& graph_;
  bool colours_ = false, shading_ = false;
  std::map<std::array<float, 3>, uint32_t> emission_numbers_;
  std::vector<Vec3> emissions_;
  using Floats = std::array<float, 3>;
  using ShadingKey = std::tuple<ShadingBits, std::array<float, 4>, Floats, Floats, Floats, Floats, Floats>;
  std::map<ShadingKey, uint32_t> shading_numbers_;
  std::map<TextureGraph::Node, uint32_t> texture_of_node_; ///< kNoTexture: none
  std::unordered_multimap<size_t, uint32_t> textures_by_hash_;
  std::vector<Definition> definitions_;
  /// Number of the use without alpha and light, indexed by recipe; kNone: not used yet.
  std::vector<uint32_t> plain_uses_;
  std::map<MaterialUse, uint32_t> use_numbers_; ///< numbers of all other uses
  std::vector<MaterialUse> uses_;
};

} // namespace packtrace
