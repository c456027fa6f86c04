#include "pbrt_import/gltf/gltf_materials.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pbrt_import/files/image_file.h"
#include "pbrt_import/language/transforms.h"
#include "pbrt_import/text/problem_text.h"

namespace packtrace::gltf {
namespace {

Vec3 to_vec3(const std::vector<double>& v) {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

float clamped(double value) { return static_cast<float>(std::clamp(value, 0.0, 1.0)); }

std::string_view wrap_name(uint64_t mode) { return mode == 33071 ? "clamp" : "repeat"; }

} // namespace

Materials::Materials(Document& document, FileNames& file_names) : document_(document), file_names_(file_names) {
  for (size_t i = 0; i < document.count("materials"); ++i) {
    MaterialUse& use = uses_.emplace_back();
    const std::string problem = problem_of([&] {
      const Value material = document.element("materials", i);
      use.name = unique_name(material, i);
      define(material, use);
    });
    if (problem.empty()) continue;
    document.context().feed.reporter().error(document.place(), problem + "; the material is grey");
    use = MaterialUse{};
  }
}

const MaterialUse& Materials::use(std::optional<uint64_t> material) const {
  if (!material) return default_;
  if (*material >= uses_.size())
    throw Error(ErrorKind::kInput, "materials has no element " + std::to_string(*material));
  return uses_[static_cast<size_t>(*material)];
}

std::string Materials::unique_name(const Value& material, size_t number) {
  std::string name = material.text_or("name", "material " + std::to_string(number));
  while (name.empty() || !names_.insert(name).second) name += " (" + std::to_string(number) + ")";
  return name;
}

void Materials::warn(const std::string& text) { document_.context().feed.reporter().warning(document_.place(), text); }

/// The name under which the importer finds an image: a path, or that of an embedded file.
std::string Materials::image_file(uint64_t number) {
  const Value image = document_.element("images", number);
  const std::optional<Value> uri = image.find("uri");
  if (uri && !uri->text().starts_with("data:")) {
    const std::filesystem::path path = document_.uri_file(*uri);
    file_names_.accept(path);
    return path.string();
  }
  if (image.has("name"))
    document_.context().feed.reporter().note(document_.place(), "names of images in the file are left out");
  const std::string name =
      "image " + std::to_string(number) + " of glTF file " + std::to_string(document_.file_number());
  file_names_.embed(name, document_.image_bytes(number));
  return name;
}

namespace {

/// Number of a texture's image; WebP is preferred to its fallback.
uint64_t image_of(const Value& texture) {
  if (const std::optional<Value> webp = texture.extension("EXT_texture_webp"))
    if (const std::optional<uint64_t> source = webp->find_integer("source")) return *source;
  return texture.at("source").integer();
}

} // namespace

/// Mean of an image's values, as they are stored or linear.
Vec3 Materials::image_average(const Value& info, bool decode_srgb) {
  const uint64_t image = image_of(document_.element("textures", info.at("index").integer()));
  const auto [place, added] = averages_.try_emplace({image, decode_srgb});
  Average& average = place->second;
  if (added) average.problem = problem_of([&] { average.value = read_average(image, decode_srgb); });
  if (!average.problem.empty()) throw Error(ErrorKind::kInput, average.problem);
  return average.value;
}

Vec3 Materials::read_average(uint64_t number, bool decode_srgb) {
  MemoryReservation memory(document_.context().options.memory);
  return read_image(document_.image_bytes(number), decode_srgb, {}, memory).average;
}

void Materials::read_mapping(const Value& info, MaterialUse& use, Vec2& scale, Vec2& offset) {
  use.uv_set = info.find_integer("texCoord").value_or(0);
  const std::optional<Value> transform = info.extension("KHR_texture_transform");
  if (!transform) return;
  use.uv_set = transform->find_integer("texCoord").value_or(use.uv_set);
  const std::vector<double> s = transform->numbers_or("scale", {1.0, 1.0}),
                            o = transform->numbers_or("offset", {0.0, 0.0});
  scale = {static_cast<float>(s[0]), static_cast<float>(s[1])};
  offset = {static_cast<float>(o[0]), static_cast<float>(o[1])};
  use.uv_rotation = transform->number_or("rotation", 0.0);
}

/// Defines a texture of an image; returns its name.
/// @param info textureInfo object
/// @param cutoff unset: its colours; otherwise a mask of the texels with at least this alpha
std::string Materials::define_image(const Value& info, MaterialUse& use, std::string_view what,
                                    std::optional<float> cutoff) {
  const Value texture = document_.element("textures", info.at("index").integer());
  Vec2 scale(1.0f), offset(0.0f);
  read_mapping(info, use, scale, offset);
  std::string_view wrap = "repeat";
  if (const std::optional<uint64_t> sampler = texture.find_integer("sampler")) {
    const Value settings = document_.element("samplers", *sampler);
    const uint64_t s = settings.find_integer("wrapS").value_or(10497),
                   t = settings.find_integer("wrapT").value_or(10497);
    wrap = wrap_name(s);
    if (s == 33648 || t == 33648) warn("mirrored textures repeat without mirroring");
    if (wrap_name(t) != wrap) warn("textures that wrap differently along u and v wrap as along u");
  }
  if (use.uv_rotation != 0.0) { // vertices get the transform, since textures have no rotation
    use.uv_scale = scale, use.uv_offset = offset;
    scale = Vec2(1.0f), offset = Vec2(0.0f);
  }
  const std::string name = use.name + ": " + std::string(what);
  const std::string file = image_file(image_of(texture));
  DirectiveFeed& feed = document_.context().feed;
  feed.begin("Texture", document_.place(), {name, cutoff ? "float" : "spectrum", "imagemap"});
  feed.text("filename", file);
  feed.number("uscale", scale.x);
  feed.number("vscale", scale.y);
  feed.number("udelta", offset.x);
  feed.number("vdelta", 1.0f - offset.y - scale.y); // glTF's v points downwards
  feed.text("wrap", wrap);
  if (cutoff) {
    feed.text("channel", "alpha");
    feed.number("cutoff", *cutoff);
  } else {
    feed.flag("gamma", true);
  }
  feed.send();
  return name;
}

/// Index of refraction that gives the material's reflectance at normal incidence: that of KHR_materials_ior, scaled by
/// KHR_materials_specular.
float Materials::index_of(const Value& material) {
  constexpr double kDefault = 1.5, kMaxIndex = 1000.0;
  const std::optional<Value> ior = material.extension("KHR_materials_ior");
  double index = ior ? ior->number_or("ior", kDefault) : kDefault;
  if (!(index >= 1.0 && index <= kMaxIndex)) {
    warn(material.path() + " has an index of refraction of " + to_text(index) +
         ", which is not within 1 and 1000; it counts as 1.5");
    index = kDefault;
  }
  const std::optional<Value> specular = material.extension("KHR_materials_specular");
  if (!specular) return static_cast<float>(index);
  const double factor = std::clamp(specular->number_or("specularFactor", 1.0), 0.0, 1.0);
  const double root = std::sqrt(factor) * (index - 1.0) / (index + 1.0);
  return static_cast<float>((1.0 + root) / (1.0 - root));
}

/// Warns of material properties that the import ignores.
void Materials::report_losses(const Value& material) {
  if (material.has("normalTexture")) warn("normal maps are left out: surfaces keep the normals of their vertices");
  if (material.has("occlusionTexture")) warn("textures of occlusion are left out: occlusion is computed");
  if (const std::optional<Value> specular = material.extension("KHR_materials_specular"))
    if (specular->has("specularTexture") || specular->has("specularColorTexture") ||
        specular->has("specularColorFactor"))
      warn("KHR_materials_specular is reduced to its factor; its colour and textures are left out");
  if (const std::optional<Value> transmission = material.extension("KHR_materials_transmission");
      transmission && transmission->has("transmissionTexture"))
    warn("textures of transmission are left out");
  for (const char* name : {"KHR_materials_anisotropy", "KHR_materials_clearcoat", "KHR_materials_iridescence",
                           "KHR_materials_sheen", "KHR_materials_volume"})
    if (material.extension(name)) warn(std::string(name) + " is left out");
}

/// Sets how opaque the material is, and returns whether it transmits light.
/// @param alpha of its base colour
/// @param image of its base colour
bool Materials::read_transparency(const Value& material, double alpha, const std::optional<Value>& image,
                                  MaterialUse& use) {
  const std::string mode = material.text_or("alphaMode", "OPAQUE");
  const double cutoff = material.number_or("alphaCutoff", 0.5);
  bool transmits = false;
  if (mode == "MASK" || (mode == "BLEND" && image)) {
    if (alpha <= 0.0 || (!image && alpha < cutoff))
      use.absent = true;
    else if (image)
      use.opacity = define_image(*image, use, "opacity", static_cast<float>((mode == "MASK" ? cutoff : 0.5) / alpha));
  } else if (mode == "BLEND") {
    use.absent = alpha <= 0.0;
    transmits = alpha < 0.5;
  } else if (mode != "OPAQUE") {
    material.fail("has the unknown alphaMode \"" + mode + "\"");
  }
  if (mode == "BLEND" && !use.absent && !transmits)
    warn("blending is reduced to surfaces that are opaque where alpha is at least 0.5, with holes where it is less");
  if (const std::optional<Value> transmission = material.extension("KHR_materials_transmission"))
    transmits = transmits || transmission->number_or("transmissionFactor", 0.0) >= 0.5;
  return transmits;
}

Vec3 Materials::read_emission(const Value& material) {
  const std::optional<Value> strength = material.extension("KHR_materials_emissive_strength");
  Vec3 emission = to_vec3(material.numbers_or("emissiveFactor", {0.0, 0.0, 0.0})) *
                  static_cast<float>(strength ? strength->number_or("emissiveStrength", 1.0) : 1.0);
  if (glm::any(glm::lessThan(emission, Vec3(0.0f)))) material.fail("emits negative light");
  if (const std::optional<Value> glow = material.find("emissiveTexture"); glow && emission != Vec3(0.0f)) {
    const std::string problem = problem_of([&] { emission *= image_average(*glow, true); });
    warn(problem.empty() ? "textures of emission are reduced to their means"
                         : "a texture of emission counts as white: " + problem);
  }
  return emission;
}

/// Returns the mean of the texture of metalness (z) and roughness (y); 1 without a texture.
Vec3 Materials::roughness_and_metalness(const Value& base) {
  Vec3 means(1.0f);
  if (const std::optional<Value> gloss = base.find("metallicRoughnessTexture")) {
    const std::string problem = problem_of([&] { means = image_average(*gloss, false); });
    warn(problem.empty() ? "textures of metalness and roughness are reduced to their means"
                         : "a texture of metalness and roughness counts as white: " + problem);
  }
  return means;
}

void Materials::define(const Value& material, MaterialUse& use) {
  const nlohmann::json empty = nlohmann::json::object();
  const Value base = material.find("pbrMetallicRoughness").value_or(Value(empty, material.path()));
  const std::vector<double> factor = base.numbers_or("baseColorFactor", {1.0, 1.0, 1.0, 1.0});
  const Vec3 colour = glm::clamp(to_vec3(factor), Vec3(0.0f), Vec3(1.0f));
  const std::optional<Value> image = base.find("baseColorTexture");
  report_losses(material);
  std::string texture;
  if (image) texture = define_image(*image, use, "base colour", std::nullopt);
  DirectiveFeed& feed = document_.context().feed;
  if (!texture.empty() && colour != Vec3(1.0f)) {
    feed.begin("Texture", document_.place(), {use.name + ": product", "spectrum", "scale"});
    feed.texture("tex1", texture);
    feed.colour("tex2", colour);
    feed.send();
    texture = use.name + ": product";
  }

  const bool transmits = read_transparency(material, factor[3], image, use);
  use.emission = read_emission(material);
  const Vec3 means = roughness_and_metalness(base);
  feed.begin("MakeNamedMaterial", document_.place(), {use.name});
  const bool unlit = material.extension("KHR_materials_unlit").has_value();
  std::string_view kind = "disney", parameter = "color";
  if (transmits) kind = "glass", parameter = "Kt";
  if (unlit) kind = "matte", parameter = "Kd";
  feed.text("type", kind);
  if (texture.empty())
    feed.colour(parameter, colour);
  else
    feed.texture(parameter, texture);
  if (material.has("normalTexture")) feed.number("bumpmap", 0.0f); // its presence is kept, its content is not
  if (kind != "matte") feed.number("eta", index_of(material));
  if (kind == "disney") {
    feed.number("metallic", clamped(base.number_or("metallicFactor", 1.0) * double{means.z}));
    feed.number("roughness", clamped(base.number_or("roughnessFactor", 1.0) * double{means.y}));
  }
  feed.send();
}

} // namespace packtrace::gltf
