#include "compress/exchange/gltf/gltf_materials.h"

#include <algorithm>
#include <limits>

#include "compress/exchange/gltf/baked_images.h"
#include "pbrt_import/base/error.h"
#include "pbrt_import/base/printable.h"
#include "pbrt_import/scene/material_flags.h"

namespace packtrace {
namespace {

constexpr int kRepeat = 10497, kClampToEdge = 33071, kLinear = 9729;
constexpr double kBlendAlpha = 0.25; // of transmitting materials without KHR_materials_transmission

/// Whether a mask and a texture have the same texture transform and wrap mode.
template <typename A, typename B>
bool same_layout(const A& a, const B& b) {
  return a.wrap == b.wrap && a.uv_scale == b.uv_scale && a.uv_offset == b.uv_offset;
}

} // namespace

void GltfMaterials::add_all(const UvMap& stored) {
  lowest_psnr_ = std::numeric_limits<double>::infinity();
  for (const baked::MaterialRecord& record : file_.sections().materials) add(record, stored);
}

void GltfMaterials::add(const baked::MaterialRecord& record, const UvMap& stored) {
  Use& use = uses_.emplace_back();
  GltfJson material{{"doubleSided", true}}; // as all surfaces in pbrt
  GltfJson surface{{"metallicFactor", (record.flags & (kMetal | kMirror)) != 0 ? 1 : 0}};
  if ((record.flags & kMirror) != 0) surface["roughnessFactor"] = 0;
  GltfJson colour = shortest(record.albedo);
  colour.push_back(1);
  if ((record.flags & kTransmissive) != 0) {
    if (config_.material_extensions) {
      material["extensions"]["KHR_materials_transmission"] = {{"transmissionFactor", 1}};
      model_.use_extension("KHR_materials_transmission", false);
    } else {
      material["alphaMode"] = "BLEND";
      colour[3] = kBlendAlpha;
    }
  }
  surface["baseColorFactor"] = std::move(colour);
  material["pbrMetallicRoughness"] = std::move(surface);
  if ((record.flags & kEmissive) != 0) material["emissiveFactor"] = {1, 1, 1};
  // glTF has one mask per material; it gets the one for camera rays.
  const uint32_t mask = (record.flags & kAlphaMask) != 0 ? record.alpha_mask : baked::kNone;
  const bool blends = (record.flags & kTransmissive) != 0 && !config_.material_extensions; // readers take alpha's image
  if (mask != baked::kNone || (record.albedo_texture != baked::kNone && !blends))
    add_image(record, mask, stored, material, use);
  if (!config_.names) {
    const auto [place, added] = known_.try_emplace(material.dump(), static_cast<int>(model_.count("materials")));
    use.number = added ? model_.add("materials", std::move(material)) : place->second;
    return;
  }
  material["name"] = to_utf8(file_.text(record.name));
  material["extras"] = {{"flags", record.flags}};
  use.number = model_.add("materials", std::move(material));
}

void GltfMaterials::add_image(const baked::MaterialRecord& record, uint32_t mask, const UvMap& stored,
                              GltfJson& material, Use& use) {
  uint32_t albedo = record.albedo_texture;
  if (mask != baked::kNone && albedo != baked::kNone && !same_layout(file_.mask(mask), file_.texture(albedo))) {
    albedo = baked::kNone;
    ++simplified_;
  }
  GltfJson& surface = material["pbrMetallicRoughness"];
  GltfJson texture{{"index", texture_of(mask, albedo)}};
  if (albedo != baked::kNone) surface["baseColorFactor"] = {1, 1, 1, surface["baseColorFactor"][3]};
  const glm::dvec2 scale(mask != baked::kNone ? file_.mask(mask).uv_scale : file_.texture(albedo).uv_scale);
  const glm::dvec2 offset(mask != baked::kNone ? file_.mask(mask).uv_offset : file_.texture(albedo).uv_offset);
  // glTF rows count from the top: t = 1 - (v scale + offset).
  const UvMap map{{scale.x, -scale.y}, {offset.x, 1.0 - offset.y}};
  use.has_image = true;
  if (config_.material_extensions) {
    const glm::dvec2 s = map.scale * stored.scale, o = map.offset + map.scale * stored.offset;
    texture["extensions"]["KHR_texture_transform"] = {{"scale", {s.x, s.y}}, {"offset", {o.x, o.y}}};
    model_.use_extension("KHR_texture_transform", false);
  } else {
    use.vertex_map = map;
  }
  surface["baseColorTexture"] = std::move(texture);
  if (mask == baked::kNone) return;
  material["alphaMode"] = "MASK"; // with the default cutoff, 1/2
}

/// Returns the glTF texture for a mask, an albedo texture or both.
int GltfMaterials::texture_of(uint32_t mask, uint32_t albedo_texture) {
  const auto [place, added] = textures_.try_emplace({mask, albedo_texture}, 0);
  if (!added) return place->second;
  const AlphaMaskView bits = mask != baked::kNone ? file_.mask(mask) : AlphaMaskView{};
  const TextureView colours = albedo_texture != baked::kNone ? file_.texture(albedo_texture) : TextureView{};
  const std::string_view name =
      albedo_texture != baked::kNone ? file_.text(file_.sections().textures[albedo_texture].name) : std::string_view{};
  return place->second = add_texture(image_of(bits, colours), mask != baked::kNone ? bits.wrap : colours.wrap, name);
}

int GltfMaterials::add_texture(const RgbaImage& image, WrapMode wrap, std::string_view name) {
  const bool webp = config_.webp_psnr > 0.0;
  std::vector<std::byte> bytes;
  if (webp) {
    WebpImage coded = encode_webp(image, config_.webp_psnr);
    bytes = std::move(coded.bytes);
    lowest_psnr_ = std::min(lowest_psnr_, coded.psnr);
  } else {
    bytes = encode_png(image);
  }
  image_bytes_ += bytes.size();
  GltfJson stored{{"bufferView", model_.add_view(bytes, 0)}, {"mimeType", webp ? "image/webp" : "image/png"}};
  if (config_.names && !name.empty()) stored["name"] = to_utf8(name);
  const int source = model_.add("images", std::move(stored));
  const int mode = wrap == WrapMode::kRepeat ? kRepeat : kClampToEdge;
  const auto [sampler, added] = samplers_.try_emplace(mode, 0);
  if (added) sampler->second = model_.add("samplers", {{"wrapS", mode}, {"wrapT", mode}, {"magFilter", kLinear}});
  GltfJson texture{{"sampler", sampler->second}};
  if (webp) {
    texture["extensions"]["EXT_texture_webp"] = {{"source", source}};
    model_.use_extension("EXT_texture_webp", true);
  } else {
    texture["source"] = source;
  }
  return model_.add("textures", std::move(texture));
}

} // namespace packtrace
