#include "pbrt_import/language/shading_recipe.h"

#include <algorithm>
#include <cmath>

namespace packtrace {
namespace {

using Node = TextureGraph::Node;

constexpr float kLargestEta = 8.0f;

/// Reads the parameters of one material.
class Reducer {
public:
  Reducer(const TextureParameters& parameters, std::vector<std::string>& reduced)
      : parameters_(parameters), graph_(parameters.context().graph), reduced_(reduced), recipe_(matte_shading(graph_)) {
  }

  void matte() { recipe_.sigma = number("sigma", 0.0f); }

  void plastic() {
    recipe_.bits = kFresnelDielectric;
    recipe_.specular = colour("Ks", 0.25f);
    one_roughness(0.1f);
  }

  void translucent() {
    plastic();
    recipe_.diffuse = colour("reflect", 0.5f);
    recipe_.specular = graph_.product(recipe_.specular, recipe_.diffuse);
    reduce("light that it transmits is left out");
  }

  void uber() {
    recipe_.bits = kFresnelDielectric;
    recipe_.eta = index();
    const Node opacity = colour("opacity", 1.0f), glossy = colour("Ks", 0.25f), mirror = colour("Kr", 0.0f),
               transmitted = colour("Kt", 0.0f);
    if (is_black(mirror)) {
      recipe_.specular = glossy;
      two_roughnesses(0.1f, "roughness");
    } else {
      recipe_.specular = mirror;
      if (!is_black(glossy)) reduce("\"Ks\" is left out, since it has a \"Kr\"");
    }
    const Vec3* const opaque = graph_.constant_value(opacity);
    if (opaque && *opaque == Vec3(1.0f)) {
      recipe_.transmission = transmitted;
      return;
    }
    recipe_.bits |= kThin;
    recipe_.diffuse = opacity;
    recipe_.specular = graph_.product(opacity, recipe_.specular);
    recipe_.transmission = graph_.mix(graph_.constant(Vec3(1.0f)), graph_.constant(Vec3(0.0f)), opacity);
    if (!is_black(transmitted)) reduce("\"Kt\" is left out, since it has an \"opacity\"");
  }

  void substrate() {
    recipe_.bits = kFresnelSchlick;
    recipe_.specular = colour("Ks", 0.5f);
    two_roughnesses(0.1f, {});
  }

  void mirror() {
    recipe_.bits = kFresnelNone | kSpecularTimesAlbedo; // its albedo is Kr
    recipe_.diffuse = constant(0.0f);
    recipe_.specular = constant(1.0f);
  }

  void glass() {
    recipe_.bits = kFresnelDielectric;
    recipe_.diffuse = constant(0.0f);
    recipe_.specular = colour("Kr", 1.0f);
    recipe_.transmission = colour("Kt", 1.0f);
    const Vec3* const transmitted = graph_.constant_value(recipe_.transmission);
    if (!transmitted) { // its albedo is Kt
      recipe_.bits |= kTransmissionTimesAlbedo;
      recipe_.transmission = constant(1.0f);
    }
    recipe_.eta = index();
    two_roughnesses(0.0f, {});
  }

  void metal(const MetalIndices& indices) {
    recipe_.bits = kFresnelConductor;
    recipe_.diffuse = constant(0.0f);
    recipe_.specular = constant(1.0f);
    recipe_.metal = indices;
    two_roughnesses(0.01f, "roughness");
  }

  void disney() {
    const float metallic = std::clamp(average("metallic", 0.0f), 0.0f, 1.0f);
    const float transmitted = std::clamp(average("spectrans", 0.0f), 0.0f, 1.0f) * (1.0f - metallic);
    recipe_.eta = number("eta", 1.5f);
    recipe_.diffuse = constant((1.0f - metallic) * (1.0f - transmitted));
    if (metallic >= 0.5f) {
      recipe_.bits = kFresnelSchlick | kSpecularTimesAlbedo;
      recipe_.specular = constant(metallic);
    } else {
      recipe_.bits = kFresnelDielectric;
      recipe_.specular = constant(1.0f - metallic);
    }
    if (metallic > 0.0f && metallic < 1.0f) reduce("it is taken as half metal: \"metallic\" is neither 0 nor 1");
    if (transmitted > 0.0f) {
      recipe_.bits |= kTransmissionTimesAlbedo;
      recipe_.transmission = constant(transmitted);
      if (parameters_.get_bool("thin", false)) recipe_.bits |= kThin;
    }
    const Node roughness = number("roughness", 0.5f);
    recipe_.roughness_u = recipe_.roughness_v = graph_.product(roughness, roughness);
    for (const std::string_view lobe : {"sheen", "clearcoat", "anisotropic", "flatness", "difftrans", "speculartint"})
      if (average(lobe, 0.0f) != 0.0f) reduce("\"" + std::string(lobe) + "\" is left out");
    if (const auto distance = parameters_.find_spectrum("scatterdistance"); distance && !is_black(*distance))
      reduce("its light does not scatter below the surface");
  }

  void subsurface() {
    recipe_.bits = kFresnelDielectric;
    recipe_.specular = colour("Kr", 1.0f);
    recipe_.eta = number("eta", 1.33f);
    two_roughnesses(0.0f, {});
    reduce("light does not scatter below the surface: it is diffuse");
  }

  void diffuse_only(std::string why) { reduce(std::move(why)); }

  ShadingRecipe recipe() && { return recipe_; }

private:
  Node constant(float value) const { return graph_.constant(Vec3(value)); }
  Node colour(std::string_view name, float fallback) const { return parameters_.spectrum(name, Vec3(fallback)); }
  Node number(std::string_view name, float fallback) const { return parameters_.float_texture(name, fallback); }
  void reduce(std::string what) { reduced_.push_back(std::move(what)); }

  bool is_black(Node node) const {
    const Vec3* const value = graph_.constant_value(node);
    return value && *value == Vec3(0.0f);
  }

  /// Value of a float parameter; a texture counts as its default, and is reported.
  float average(std::string_view name, float fallback) {
    const std::optional<Node> node = parameters_.find_float(name);
    if (!node) return fallback;
    if (const Vec3* const value = graph_.constant_value(*node)) return value->x;
    reduce("the texture of \"" + std::string(name) + "\" is left out");
    return fallback;
  }

  Node index() const {
    const std::optional<Node> eta = parameters_.find_float("eta");
    return eta ? *eta : number("index", 1.5f); // pbrt accepts both names
  }

  void one_roughness(float fallback) {
    recipe_.roughness_u = recipe_.roughness_v = number("roughness", fallback);
    recipe_.remap = parameters_.get_bool("remaproughness", true);
    note_texture(recipe_.roughness_u);
  }

  /// @param common name of the parameter that replaces both if they are not given; empty: none
  void two_roughnesses(float fallback, std::string_view common) {
    const Node both = common.empty() ? constant(fallback) : number(common, fallback);
    const std::optional<Node> u = parameters_.find_float("uroughness"), v = parameters_.find_float("vroughness");
    recipe_.roughness_u = u.value_or(both), recipe_.roughness_v = v.value_or(both);
    recipe_.remap = parameters_.get_bool("remaproughness", true);
    const Vec3 *const in_u = graph_.constant_value(recipe_.roughness_u), *const in_v =
                                                                             graph_.constant_value(recipe_.roughness_v);
    if (in_u && in_v && *in_u != *in_v) reduce("its roughness is the same in all directions: the geometric mean");
    note_texture(recipe_.roughness_u), note_texture(recipe_.roughness_v);
  }

  void note_texture(Node node) {
    const std::string what = "its roughness is the average of a texture";
    if (!graph_.constant_value(node) && std::ranges::find(reduced_, what) == reduced_.end()) reduce(what);
  }

  const TextureParameters& parameters_;
  TextureGraph& graph_;
  std::vector<std::string>& reduced_;
  ShadingRecipe recipe_;
};

/// Moves a value into its range, and reports it if it was outside.
float inside(float value, float low, float high, float fallback, const char* name, std::vector<std::string>& outside) {
  if (value >= low && value <= high) return value;
  outside.emplace_back(name);
  return std::isfinite(value) ? std::clamp(value, low, high) : fallback;
}

Vec3 inside(Vec3 value, float high, const char* name, std::vector<std::string>& outside) {
  std::vector<std::string> found;
  for (int c = 0; c < 3; ++c) value[c] = inside(value[c], 0.0f, high, 0.0f, name, found);
  if (!found.empty()) outside.emplace_back(name);
  return value;
}

float mean_of(Vec3 v) { return (v.x + v.y + v.z) / 3.0f; }

} // namespace

float alpha_of_roughness(float roughness) {
  const float x = std::log(std::max(roughness, 1e-3f));
  return 1.62142f + x * (0.819955f + x * (0.1734f + x * (0.0171201f + x * 0.000640711f)));
}

ShadingRecipe matte_shading(TextureGraph& graph) {
  ShadingRecipe recipe;
  const Node zero = graph.constant(Vec3(0.0f)), one = graph.constant(Vec3(1.0f));
  recipe.diffuse = one;
  recipe.specular = recipe.transmission = recipe.roughness_u = recipe.roughness_v = recipe.sigma = zero;
  recipe.eta = graph.constant(Vec3(1.5f));
  return recipe;
}

ShadingRecipe shading_recipe(std::string_view kind, const TextureParameters& parameters, const MetalIndices& metal,
                             std::vector<std::string>& reduced) {
  Reducer reducer(parameters, reduced);
  if (kind == "matte") reducer.matte();
  if (kind == "plastic") reducer.plastic();
  if (kind == "translucent") reducer.translucent();
  if (kind == "uber") reducer.uber();
  if (kind == "substrate") reducer.substrate();
  if (kind == "mirror") reducer.mirror();
  if (kind == "glass") reducer.glass();
  if (kind == "metal") reducer.metal(metal);
  if (kind == "disney") reducer.disney();
  if (kind == "subsurface" || kind == "kdsubsurface") reducer.subsurface();
  if (kind == "hair") reducer.diffuse_only("its fibres are diffuse");
  if (kind == "fourier") reducer.diffuse_only("its table is not read: it is grey and diffuse");
  return std::move(reducer).recipe();
}

ShadingRecipe mixed_shading(const ShadingRecipe& a, const ShadingRecipe& b, Node amount, TextureGraph& graph) {
  const Vec3* const weight = graph.constant_value(amount);
  ShadingRecipe mixed = weight && mean_of(*weight) < 0.5f ? b : a;
  mixed.diffuse = graph.mix(b.diffuse, a.diffuse, amount);
  mixed.specular = graph.mix(b.specular, a.specular, amount);
  mixed.transmission = graph.mix(b.transmission, a.transmission, amount);
  return mixed;
}

SurfaceShading resolved(const ShadingRecipe& recipe, TextureGraph& graph, std::vector<std::string>& outside) {
  SurfaceShading result;
  constexpr float kLarge = 1e6f;
  const auto average = [&](Node node) { return graph.average(node); };
  result.bits = recipe.bits;
  result.diffuse = inside(mean_of(average(recipe.diffuse)), 0.0f, 1.0f, 1.0f, "diffuse reflection", outside);
  result.specular = inside(average(recipe.specular), 1.0f, "specular reflection", outside);
  result.transmission = inside(average(recipe.transmission), 1.0f, "transmission", outside);
  if ((recipe.bits & kFresnelMask) == kFresnelConductor) {
    result.metal_eta = inside(recipe.metal.eta, kLarge, "\"eta\"", outside);
    result.metal_k = inside(recipe.metal.k, kLarge, "\"k\"", outside);
  }
  const float eta = average(recipe.eta).x;
  result.eta = inside(eta, 1.0f, kLargestEta, 1.5f, "index of refraction", outside);
  result.sigma = inside(average(recipe.sigma).x, 0.0f, 90.0f, 0.0f, "\"sigma\"", outside);
  const auto alpha = [&](Node node) {
    const float roughness = inside(average(node).x, 0.0f, 1.0f, 0.0f, "roughness", outside);
    // pbrt takes a roughness of 0 as perfectly smooth.
    return recipe.remap && roughness > 0.0f ? alpha_of_roughness(roughness) : roughness;
  };
  const float u = alpha(recipe.roughness_u), v = alpha(recipe.roughness_v);
  result.roughness = std::sqrt(u * v);
  if (result.specular == Vec3(0.0f) && !result.transmits()) result.roughness = 0.0f;
  std::ranges::sort(outside);
  outside.erase(std::unique(outside.begin(), outside.end()), outside.end());
  return result;
}

} // namespace packtrace
