#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <unordered_map>
#include <vector>

#include "pbrt_import/language/graphics_state.h"
#include "pbrt_import/language/parser.h"
#include "pbrt_import/scene/scene.h"
#include "pbrt_import/language/texture_parameters.h"

namespace packtrace {

/// A pbrt material reduced to what the Material of a scene says, textures still as nodes.
struct MaterialRecipe {
  std::string name; ///< the MakeNamedMaterial name, or the material's kind
  MaterialFlags flags = 0;
  TextureGraph::Node albedo = 0;
};

/// A recipe as one shape uses it.
struct MaterialUse {
  uint32_t recipe = 0;
  uint32_t alpha = kNone;        ///< texture node; kNone: opaque
  uint32_t shadow_alpha = kNone; ///< texture node
  uint32_t area_light = kNone;   ///< as Attributes::area_light
  auto operator<=>(const MaterialUse&) const = default;
};

/// All materials of a scene by number.
class MaterialLibrary {
public:
  explicit MaterialLibrary(TextureGraph& graph);

  /// pbrt's material for shapes before any Material directive.
  static constexpr uint32_t kDefault = 0;

  /// Reads a Material or MakeNamedMaterial directive, as far as its name is known. Reports problems.
  uint32_t define(const Directive& directive, const TextureContext& context);

  /// The material that a shape with those parameters has: base, or a new one where the shape sets some of base's
  /// parameters. Marks the parameters it takes as used.
  uint32_t with_shape_parameters(uint32_t base, const ParameterList& shape, const TextureContext& context);

  /// Number for a shape to hold until resolve().
  uint32_t use(const MaterialUse& use);

  /// Marks the images that used materials depend on as needed.
  /// @param colours whether resolve() is to make textures
  void require_images(bool colours);

  /// Makes a scene material of each use(), equal ones once, with the masks they need, and the textures if their images
  /// were required with colours. Call once images are read.
  /// @param memory grows by the textures
  /// Throws MemoryError.
  /// @return for each use its index in scene.materials
  std::vector<uint32_t> resolve(Scene& scene, MemoryReservation& memory, Reporter& reporter);

private:
  struct Definition {
    std::string kind;
    std::shared_ptr<const ParameterList> parameters; ///< also of those that shapes make of it; null: none
    MaterialRecipe recipe;
    Place place; ///< of the directive that made it: a material's, or a shape's that overrides parameters
  };
  uint32_t add(std::string kind, std::string name, const TextureParameters& parameters);
  Vec3 albedo_of(const Definition& definition, Reporter& reporter);
  uint32_t texture_of(const Definition& definition, Scene& scene, MemoryReservation& memory, Reporter& reporter);
  uint32_t add_texture(std::vector<AlbedoTexture>& textures, AlbedoTexture texture);

  TextureGraph& graph_;
  bool colours_ = false;
  std::map<TextureGraph::Node, uint32_t> texture_of_node_; ///< kNoTexture: none
  std::unordered_multimap<size_t, uint32_t> textures_by_hash_;
  std::vector<Definition> definitions_;
  std::vector<uint32_t> plain_uses_;            ///< by recipe, without alpha and light; kNone: not used yet
  std::map<MaterialUse, uint32_t> use_numbers_; ///< of the others
  std::vector<MaterialUse> uses_;
};

} // namespace packtrace
