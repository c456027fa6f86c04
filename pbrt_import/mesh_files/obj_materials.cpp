#include "pbrt_import/mesh_files/obj_materials.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <system_error>

#include "pbrt_import/text/problem_text.h"
#include "pbrt_import/text/tokenizer.h"

namespace packtrace {
namespace {

bool is_file(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::is_regular_file(path, error);
}

/// Name of a material's texture in the scene.
std::string texture_name(const MtlMaterial& material, std::string_view use) {
  return material.name + ": " + std::string(use);
}

void define_texture(const MtlMaterial& material, std::string_view use, std::string_view type, const MtlMap& map,
                    DirectiveFeed& feed) {
  feed.begin("Texture", map.place, {texture_name(material, use), type, "imagemap"});
  feed.text("filename", map.file.string());
  feed.number("uscale", map.scale.x);
  feed.number("vscale", map.scale.y);
  feed.number("udelta", map.offset.x);
  feed.number("vdelta", map.offset.y);
  if (map.clamp) feed.text("wrap", "clamp");
  if (type == "float" && use == "opacity") { // pbrt's alpha has no values between 0 and 1
    constexpr float kCutoff = 0.5f;
    feed.text("channel", "grey");
    feed.number("cutoff", kCutoff);
    feed.flag("gamma", false);
  }
  feed.send();
}

/// Defines the diffuse colour's texture, Kd times the image; returns its name, or an empty one without an image.
/// Exporters write Kd 0 beside an image that is meant to be seen.
std::string define_diffuse(const MtlMaterial& material, DirectiveFeed& feed) {
  if (material.diffuse_map.file.empty()) return {};
  define_texture(material, "image", "spectrum", material.diffuse_map, feed);
  std::string image = texture_name(material, "image");
  const Vec3 factor = material.diffuse.value_or(Vec3(1.0f));
  if (factor == Vec3(1.0f) || factor == Vec3(0.0f)) return image;
  const std::string product = texture_name(material, "diffuse");
  feed.begin("Texture", material.place, {product, "spectrum", "scale"});
  feed.texture("tex1", image);
  feed.colour("tex2", factor);
  feed.send();
  return product;
}

/// Whether light passes: the opacity is low, or the illumination model refracts.
bool transmits(const MtlMaterial& material) {
  if (!material.opacity_map.file.empty() || material.opacity >= 1.0f) return false;
  constexpr std::array kRefracting = {4, 6, 7, 9};
  return material.opacity < 0.5f || std::ranges::find(kRefracting, material.illumination) != kRefracting.end();
}

/// Roughness of a microfacet lobe that is about as wide as a Phong lobe.
/// Source: Walter et al., Microfacet models for refraction through rough surfaces, 2007, section 5.2.
float roughness_of(float shininess) { return std::sqrt(2.0f / (shininess + 2.0f)); }

void define_material(const MtlMaterial& material, DirectiveFeed& feed) {
  const std::string diffuse = define_diffuse(material, feed);
  const bool bumps = !material.normal_map.file.empty();
  if (bumps) define_texture(material, "bump", "float", material.normal_map, feed);
  if (!material.opacity_map.file.empty()) define_texture(material, "opacity", "float", material.opacity_map, feed);

  if (bumps)
    feed.reporter().warning(material.normal_map.place,
                            "normal and bump maps are left out: surfaces keep the normals of their vertices");
  if (material.opacity > 0.0f && material.opacity < 1.0f && !transmits(material))
    feed.reporter().warning(material.place, "materials that are partly transparent are opaque, or glass below 0.5");
  feed.begin("MakeNamedMaterial", material.place, {material.name});
  const bool measured = material.roughness || material.metallic;
  const bool shiny = material.specular != Vec3(0.0f);
  std::string_view colour = "Kd";
  if (transmits(material)) {
    feed.text("type", "glass");
    feed.colour("Kt", glm::min(material.diffuse.value_or(Vec3(1.0f)), Vec3(1.0f)));
    feed.number("eta", std::max(material.refraction, 1.0f));
    colour = {};
    if (!diffuse.empty()) feed.reporter().warning(material.diffuse_map.place, "glass has no image: map_Kd is left out");
  } else if (measured) {
    feed.text("type", "disney");
    feed.number("metallic", std::clamp(material.metallic.value_or(0.0f), 0.0f, 1.0f));
    feed.number("roughness", std::clamp(material.roughness.value_or(0.5f), 0.0f, 1.0f));
    colour = "color";
  } else if (shiny) {
    feed.text("type", "plastic");
    feed.colour("Ks", material.specular);
    feed.number("roughness", roughness_of(material.shininess));
    feed.flag("remaproughness", false);
  } else {
    feed.text("type", "matte");
  }
  if (!colour.empty() && !diffuse.empty())
    feed.texture(colour, diffuse);
  else if (!colour.empty())
    feed.colour(colour, material.diffuse.value_or(Vec3(0.5f)));
  if (bumps) feed.texture("bumpmap", texture_name(material, "bump"));
  feed.send();
}

} // namespace

void ObjMaterials::read_library(std::string_view names, const Place& place, const std::filesystem::path& folder,
                                const MeshFileContext& context) {
  if (names.empty()) return context.feed.reporter().error(place, "mtllib without a file name");
  if (const std::filesystem::path whole = resolve_named_file(names, folder); is_file(whole))
    return read_file(whole, place, context);
  for (size_t at = 0; at < names.size();) {
    const size_t end = std::min(names.find_first_of(" \t", at), names.size());
    if (end > at) read_file(resolve_named_file(names.substr(at, end - at), folder), place, context);
    at = end + 1;
  }
}

void ObjMaterials::read_file(const std::filesystem::path& file, const Place& place, const MeshFileContext& context) {
  Reporter& reporter = context.feed.reporter();
  const uint32_t number = add_source(file, place, context);
  const std::string problem = problem_of([&] {
    const PaddedText text = read_padded(file, context);
    for (MtlMaterial& material : read_mtl(text.text, number, file.parent_path(), reporter)) {
      numbers_[material.name] = static_cast<uint32_t>(materials_.size());
      materials_.push_back(std::move(material));
    }
  });
  if (!problem.empty())
    reporter.error(place, "material file " + in_quotes(file.string(), kMaxShownPath) + ": " + problem +
                              "; its materials are grey");
}

uint32_t ObjMaterials::find(std::string_view name, const Place& place, Reporter& reporter) const {
  if (const auto found = numbers_.find(std::string(name)); found != numbers_.end()) return found->second;
  std::vector<std::string_view> known;
  for (const MtlMaterial& material : materials_) known.push_back(material.name);
  reporter.error(place, "no material " + in_quotes(name) + " in the material files; its faces are grey" +
                            did_you_mean(closest_name(name, known)));
  return kDefault;
}

void ObjMaterials::define(const MeshFileContext& context) const {
  for (uint32_t i = 0; i < materials_.size(); ++i)
    if (numbers_.at(materials_[i].name) == i) define_material(materials_[i], context.feed);
}

void ObjMaterials::use(uint32_t material, const Place& place, DirectiveFeed& feed) const {
  if (material == kDefault) {
    feed.begin("Material", place, {"matte"});
    return feed.send();
  }
  const MtlMaterial& used = materials_[material];
  feed.begin("NamedMaterial", place, {used.name});
  feed.send();
  if (used.emission == Vec3(0.0f)) return;
  feed.begin("AreaLightSource", used.place, {"diffuse"});
  feed.colour("L", used.emission);
  feed.send();
}

void ObjMaterials::add_opacity(uint32_t material, DirectiveFeed& feed) const {
  if (material == kDefault) return;
  const MtlMaterial& used = materials_[material];
  if (!used.opacity_map.file.empty())
    feed.texture("alpha", texture_name(used, "opacity"));
  else if (used.opacity <= 0.0f)
    feed.number("alpha", 0.0f);
}

} // namespace packtrace
