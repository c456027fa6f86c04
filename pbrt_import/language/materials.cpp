#include "pbrt_import/language/materials.h"

#include <algorithm>
#include <array>
#include <functional>
#include <span>
#include <string_view>

#include "pbrt_import/language/material_parameters.h"
#include "pbrt_import/language/spectrum.h"
#include "pbrt_import/text/tokenizer.h"

namespace packtrace {
namespace {

using Node = TextureGraph::Node;

constexpr std::string_view kKinds[] = {"matte", "plastic", "uber", "translucent", "substrate",    "mirror",  "glass",
                                       "metal", "disney",  "hair", "subsurface",  "kdsubsurface", "fourier", "mix",
                                       "none",  ""};

/// Whether a float parameter is a constant of at least bound.
bool is_at_least(const TextureParameters& parameters, std::string_view name, float bound) {
  const std::optional<Node> node = parameters.find_float(name);
  const Vec3* const value = node ? parameters.context().graph.constant_value(*node) : nullptr;
  return value && value->x >= bound;
}

MetalIndices metal_indices(const TextureParameters& parameters) {
  MetalIndices indices = *metal_by_name("Cu"); // pbrt's default
  for (const std::string_view name : {"eta", "k"}) {
    const auto by_name = metal_by_name(parameters.spectrum_file(name));
    Vec3& value = name == "eta" ? indices.eta : indices.k;
    if (by_name) value = name == "eta" ? by_name->eta : by_name->k;
    if (const std::optional<Node> node = parameters.find_spectrum(name)) {
      if (const Vec3* const constant = parameters.context().graph.constant_value(*node))
        value = *constant;
      else
        parameters.context().reporter.note(parameters.context().place, "metal: a texture for \"" + std::string(name) +
                                                                           "\" is not supported; copper's is used");
    }
  }
  return {glm::max(indices.eta, Vec3(0.0f)), glm::max(indices.k, Vec3(0.0f))};
}

Vec3 metal_albedo(const MetalIndices& indices) {
  Vec3 albedo;
  for (int c = 0; c < 3; ++c) albedo[c] = conductor_albedo(indices.eta[c], indices.k[c]);
  return albedo;
}

/// Sets the albedo and the flags of a material that is not a mix. The albedo is the diffuse colour or an approximation.
void fill_recipe(MaterialRecipe& recipe, std::string_view kind, const TextureParameters& parameters) {
  TextureGraph& graph = parameters.context().graph;
  const auto spectrum = [&](std::string_view name, float fallback) {
    return parameters.spectrum(name, Vec3(fallback));
  };
  if (kind == "plastic" || kind == "translucent") {
    recipe.albedo = spectrum("Kd", 0.25f);
  } else if (kind == "uber") {
    recipe.albedo = spectrum("Kd", 0.25f);
    const std::optional<Node> opacity = parameters.find_spectrum("opacity");
    const Vec3* const value = opacity ? graph.constant_value(*opacity) : nullptr;
    if (value && *value == Vec3(0.0f)) recipe.flags |= kTransmissive;
  } else if (kind == "mirror") {
    recipe.albedo = spectrum("Kr", 0.9f);
    recipe.flags |= kMirror;
  } else if (kind == "glass") {
    recipe.albedo = spectrum("Kt", 1.0f);
    const Vec3* const transmitted = graph.constant_value(recipe.albedo);
    if (transmitted && *transmitted == Vec3(0.0f))
      recipe.albedo = spectrum("Kr", 1.0f); // the glass is opaque
    else
      recipe.flags |= kTransmissive;
  } else if (kind == "metal") {
    recipe.metal = metal_indices(parameters);
    recipe.albedo = graph.constant(metal_albedo(recipe.metal));
    recipe.flags |= kMetal;
  } else if (kind == "disney") {
    recipe.albedo = spectrum("color", 0.5f);
    if (is_at_least(parameters, "metallic", 0.5f)) recipe.flags |= kMetal;
    if (is_at_least(parameters, "spectrans", 0.5f)) recipe.flags |= kTransmissive;
  } else if (kind == "hair") {
    recipe.albedo = spectrum("color", 0.2f); // pbrt's default is brown hair: eumelanin 1.3
  } else if (kind == "subsurface") {
    recipe.albedo = graph.constant(Vec3(0.8f)); // most of pbrt's measured media scatter far more than they absorb
  } else if (kind == "none" || kind.empty()) {
    recipe.albedo = graph.constant(Vec3(0.0f));
    recipe.flags |= kInvisible;
  } else if (kind == "fourier") {
    recipe.albedo = graph.constant(Vec3(0.5f));
  } else {
    recipe.albedo = spectrum("Kd", 0.5f); // matte, substrate, kdsubsurface
  }
}

Vec3 clamped(Vec3 v) { return glm::clamp(v, Vec3(0.0f), Vec3(1.0f)); }

} // namespace

MaterialLibrary::MaterialLibrary(TextureGraph& graph) : graph_(graph) {
  definitions_.push_back({"matte", {}, {"default", 0, graph.constant(Vec3(0.5f)), matte_shading(graph), {}}, {}});
}

uint32_t MaterialLibrary::define(const Directive& directive, const TextureContext& context) {
  const bool named = directive.kind == DirectiveKind::kMakeNamedMaterial;
  const TextureParameters parameters(context, directive.parameters);
  std::string kind = directive.names[0];
  if (named) {
    if (context.state.named_materials.find(directive.names[0]))
      context.reporter.warning(directive.place, "named material " + in_quotes(directive.names[0]) +
                                                    " is defined again; what follows uses the new one");
    const Parameter* const type = directive.parameters.find("type", {ParameterType::kString});
    if (!type || type->strings.size() != 1)
      context.reporter.error(directive.place, "MakeNamedMaterial " + in_quotes(directive.names[0]) +
                                                  " has no \"string type\"; matte is used");
    kind = parameters.get_string("type", "matte");
  }
  if (std::find(std::begin(kKinds), std::end(kKinds), kind) == std::end(kKinds)) {
    context.reporter.error(directive.place, "unknown material " + in_quotes(kind) + "; matte is used" +
                                                did_you_mean(closest_name(kind, kKinds)));
    kind = "matte";
  }
  std::vector<std::string> reduced;
  const uint32_t number = add(kind, named ? directive.names[0] : kind.empty() ? "none" : kind, parameters, reduced);
  for (const std::string& what : reduced)
    context.reporter.note(directive.place,
                          "material " + in_quotes(definitions_[number].recipe.name) + " is simplified: " + what);
  definitions_[number].parameters = std::make_shared<const ParameterList>(directive.parameters);
  report_unused(directive.parameters, context.reporter);
  return number;
}

uint32_t MaterialLibrary::add(std::string kind, std::string name, const TextureParameters& parameters,
                              std::vector<std::string>& reduced) {
  MaterialRecipe recipe;
  recipe.name = std::move(name);
  if (kind == "mix") {
    const auto part = [&](std::string_view parameter) -> const MaterialRecipe& {
      const std::string part_name = parameters.get_string(parameter, "");
      const std::optional<uint32_t> found = parameters.context().state.named_materials.find(part_name);
      if (part_name.empty())
        parameters.context().reporter.error(parameters.context().place, "mix material without a \"string " +
                                                                            std::string(parameter) +
                                                                            "\"; grey matte is used");
      else if (!found)
        parameters.context().reporter.error(
            parameters.context().place,
            "mix material: no named material " + in_quotes(part_name) + " for \"" + std::string(parameter) +
                "\"; grey matte is used" + did_you_mean(parameters.context().state.named_materials.closest(part_name)));
      return definitions_[found ? *found : kDefault].recipe;
    };
    const MaterialRecipe &a = part("namedmaterial1"), &b = part("namedmaterial2");
    // pbrt weights the first material with amount.
    Node amount = parameters.spectrum("amount", Vec3(0.5f));
    if (const Vec3* const constant = graph_.constant_value(amount)) amount = graph_.constant(clamped(*constant));
    recipe.albedo = graph_.mix(b.albedo, a.albedo, amount);
    recipe.flags = (a.flags & b.flags) | ((a.flags | b.flags) & kNormalMap);
    if (shading_) {
      recipe.shading = mixed_shading(a.shading, b.shading, amount, graph_);
      reduced.emplace_back("it is one surface with the mean colours of both, not a mix of two");
    }
  } else {
    fill_recipe(recipe, kind, parameters);
    if (shading_) recipe.shading = shading_recipe(kind, parameters, recipe.metal, reduced);
  }
  // Exporters for other renderers write "Normal"; pbrt only has "bumpmap".
  for (const std::string_view map : {"normalmap", "Normal"})
    if (kind != "mix" && parameters.has(map)) recipe.flags |= kNormalMap;
  if (kind != "mix" && parameters.find_float("bumpmap")) recipe.flags |= kNormalMap;
  if (shading_ && kind != "mix" && (recipe.flags & kNormalMap) != 0)
    parameters.context().reporter.warning(
        parameters.context().place, "bump and normal maps are not used: surfaces are shaded as if they were smooth");
  if (!graph_.constant_value(recipe.albedo)) recipe.flags |= kAlbedoTexture;
  for (const std::string_view parameter : parameter_names(kind))
    parameters.check(parameter, parameter_kind(kind, parameter));
  definitions_.push_back({std::move(kind), {}, std::move(recipe), parameters.context().place});
  return static_cast<uint32_t>(definitions_.size() - 1);
}

uint32_t MaterialLibrary::with_shape_parameters(uint32_t base, const ParameterList& shape,
                                                const TextureContext& context) {
  const std::span<const Parameter> all = shape.all();
  if (std::all_of(all.begin(), all.end(), [](const Parameter& parameter) { return parameter.used; })) return base;
  const std::span<const std::string_view> names = parameter_names(definitions_[base].kind);
  const bool overrides = std::any_of(shape.all().begin(), shape.all().end(), [&](const Parameter& parameter) {
    return !parameter.used && std::find(names.begin(), names.end(), parameter.name) != names.end();
  });
  if (!overrides) return base;
  // Copies the list, because looking up parameters marks them as used. `shared` keeps it alive while definitions_
  // grows.
  const std::shared_ptr<const ParameterList> shared = definitions_[base].parameters;
  const ParameterList base_parameters = shared ? *shared : ParameterList();
  std::vector<std::string> as_reduced_before;
  const uint32_t number = add(definitions_[base].kind, definitions_[base].recipe.name,
                              TextureParameters(context, shape, &base_parameters), as_reduced_before);
  definitions_[number].parameters = shared;
  return number;
}

uint32_t MaterialLibrary::use(const MaterialUse& use) {
  const bool plain = use.alpha == kNone && use.shadow_alpha == kNone && use.area_light == kNone; // no emission
  if (plain) {                                                                                   // most uses are plain
    plain_uses_.resize(definitions_.size(), kNone);
    uint32_t& number = plain_uses_[use.recipe];
    if (number != kNone) return number;
    number = static_cast<uint32_t>(uses_.size());
    uses_.push_back(use);
    return number;
  }
  const auto [it, inserted] = use_numbers_.try_emplace(use, static_cast<uint32_t>(uses_.size()));
  if (inserted) uses_.push_back(use);
  return it->second;
}

void MaterialLibrary::require_images(bool colours) {
  colours_ = colours;
  for (const MaterialUse& use : uses_) {
    const MaterialRecipe& recipe = definitions_[use.recipe].recipe;
    graph_.require(recipe.albedo, {false, colours, false});
    if (shading_) for_each_node(recipe.shading, [&](Node node) { graph_.require(node, {}); });
    if (use.alpha != kNone) graph_.require(use.alpha, {true, false, false});
    if (use.shadow_alpha != kNone) graph_.require(use.shadow_alpha, {true, false, false});
  }
}

Vec3 MaterialLibrary::albedo_of(const Definition& definition, Reporter& reporter) {
  const Vec3 albedo = graph_.average(definition.recipe.albedo);
  const auto material = [&] { return "material " + in_quotes(definition.recipe.name); };
  if (!is_finite(albedo)) {
    reporter.error(definition.place, material() + ": its colour is not finite; grey is used");
    return Vec3(0.5f);
  }
  const Vec3 inside = clamped(albedo);
  if (inside != albedo) reporter.note(definition.place, material() + ": its colour leaves [0, 1] and is clamped");
  return inside;
}

uint32_t MaterialLibrary::texture_of(const Definition& definition, Scene& scene, MemoryReservation& memory,
                                     Reporter& reporter) {
  if (!colours_ || (definition.recipe.flags & kAlbedoTexture) == 0) return kNoTexture;
  const auto [it, inserted] = texture_of_node_.try_emplace(definition.recipe.albedo, kNoTexture);
  if (!inserted) return it->second;
  const uint64_t before = memory.bytes();
  std::optional<AlbedoTexture> texture = graph_.albedo_texture(definition.recipe.albedo, memory);
  if (!texture) return kNoTexture;
  if (texture->rgb.empty()) {
    reporter.note(definition.place, "texture " + in_quotes(texture->name) +
                                        ": working out all textures takes too long; its average is used");
    return kNoTexture;
  }
  const size_t count = scene.textures.size();
  it->second = add_texture(scene.textures, std::move(*texture));
  if (scene.textures.size() == count) memory.resize(before, ""); // an equal texture exists
  return it->second;
}

uint32_t MaterialLibrary::add_texture(std::vector<AlbedoTexture>& textures, AlbedoTexture texture) {
  const std::array<float, 7> place = {texture.uv_scale.x,
                                      texture.uv_scale.y,
                                      texture.uv_offset.x,
                                      texture.uv_offset.y,
                                      static_cast<float>(texture.width),
                                      static_cast<float>(texture.height),
                                      static_cast<float>(texture.wrap)};
  const auto hash_of = [](const auto& v) {
    return std::hash<std::string_view>()({reinterpret_cast<const char*>(v.data()), v.size() * sizeof v[0]});
  };
  const size_t hash = hash_of(texture.rgb) * 31 + hash_of(place);
  const auto [first, last] = textures_by_hash_.equal_range(hash);
  for (auto it = first; it != last; ++it) {
    const AlbedoTexture& other = textures[it->second];
    if (other.width == texture.width && other.height == texture.height && other.wrap == texture.wrap &&
        other.uv_scale == texture.uv_scale && other.uv_offset == texture.uv_offset && other.rgb == texture.rgb)
      return it->second;
  }
  const auto number = static_cast<uint32_t>(textures.size());
  textures_by_hash_.emplace(hash, number);
  textures.push_back(std::move(texture));
  return number;
}

SurfaceShading MaterialLibrary::shading_of(const Definition& definition, const MaterialUse& use, Reporter& reporter) {
  std::vector<std::string> outside;
  SurfaceShading shading = resolved(definition.recipe.shading, graph_, outside);
  for (const std::string& what : outside)
    reporter.warning(definition.place, "material " + in_quotes(definition.recipe.name) + ": its " + what +
                                           " leaves its range; the nearest value is used");
  if (use.emission != kNone) shading.emission = emissions_[use.emission];
  return shading;
}

/// Number of equal properties, for keys.
uint32_t MaterialLibrary::number_of(const SurfaceShading& shading) {
  const auto floats = [](Vec3 v) { return std::array{v.x, v.y, v.z}; };
  const ShadingKey key{shading.bits,
                       {shading.diffuse, shading.eta, shading.roughness, shading.sigma},
                       floats(shading.specular),
                       floats(shading.transmission),
                       floats(shading.emission),
                       floats(shading.metal_eta),
                       floats(shading.metal_k)};
  return shading_numbers_.try_emplace(key, static_cast<uint32_t>(shading_numbers_.size())).first->second;
}

uint32_t MaterialLibrary::emission(Vec3 radiance) {
  const auto [it, inserted] =
      emission_numbers_.try_emplace({radiance.x, radiance.y, radiance.z}, static_cast<uint32_t>(emissions_.size()));
  if (inserted) emissions_.push_back(radiance);
  return it->second;
}

std::vector<uint32_t> MaterialLibrary::resolve(Scene& scene, MemoryReservation& memory, Reporter& reporter) {
  std::vector<Material>& materials = scene.materials;
  std::vector<AlphaMask>& masks = scene.masks;
  std::map<Node, std::pair<TextureGraph::MaskKind, uint32_t>> mask_of_node;
  const auto mask_of = [&](Node node) {
    const auto [it, inserted] = mask_of_node.try_emplace(node, TextureGraph::MaskKind::kNoHoles, kNoMask);
    if (!inserted) return it->second;
    TextureGraph::MaskResult result = graph_.alpha_mask(node);
    if (!result.exact) {
      const TextureGraph::Origin origin = graph_.origin(node);
      reporter.note(origin.place, "alpha texture " + in_quotes(origin.name) +
                                      " is not a plain image over uv; its holes are approximated");
    }
    if (result.kind == TextureGraph::MaskKind::kSomeHoles) {
      it->second.second = static_cast<uint32_t>(masks.size());
      masks.push_back(std::move(result.mask));
    }
    it->second.first = result.kind;
    return it->second;
  };
  using Key = std::tuple<std::string, MaterialFlags, std::array<float, 3>, uint32_t, uint32_t, uint32_t, uint32_t>;
  std::map<Key, uint32_t> numbers;
  std::vector<uint32_t> result;
  for (const MaterialUse& use : uses_) {
    const MaterialRecipe& recipe = definitions_[use.recipe].recipe;
    Material material{recipe.name, recipe.flags, albedo_of(definitions_[use.recipe], reporter), kNoMask, kNoMask};
    material.albedo_texture = texture_of(definitions_[use.recipe], scene, memory, reporter);
    if (use.area_light != kNone) material.flags |= use.area_light == 1 ? kEmissive | kEmitsBothSides : kEmissive;
    if (shading_) material.shading = shading_of(definitions_[use.recipe], use, reporter);
    if (use.alpha != kNone) {
      const auto [kind, mask] = mask_of(use.alpha);
      material.alpha_mask = mask;
      if (kind == TextureGraph::MaskKind::kAllHoles) material.flags |= kAbsent;
      if (kind == TextureGraph::MaskKind::kSomeHoles) material.flags |= kAlphaMask;
    }
    if (use.shadow_alpha != kNone) {
      const auto [kind, mask] = mask_of(use.shadow_alpha);
      material.shadow_alpha_mask = mask;
      if (kind == TextureGraph::MaskKind::kAllHoles) material.flags |= kNoShadow;
      if (kind == TextureGraph::MaskKind::kSomeHoles) material.flags |= kShadowAlphaMask;
    }
    const Key key{material.name,
                  material.flags,
                  {material.albedo.x, material.albedo.y, material.albedo.z},
                  material.alpha_mask,
                  material.shadow_alpha_mask,
                  material.albedo_texture,
                  number_of(material.shading)};
    const auto [it, inserted] = numbers.try_emplace(key, static_cast<uint32_t>(materials.size()));
    if (inserted) materials.push_back(std::move(material));
    result.push_back(it->second);
  }
  return result;
}

} // namespace packtrace
