#include "compress/exchange/gltf/gltf_materials.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <stdexcept>

#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_WRITE_IMPLEMENTATION
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#include <stb/stb_image_write.h>
#pragma GCC diagnostic pop

#include "pbrt_import/base/error.h"
#include "pbrt_import/base/printable.h"
#include "pbrt_import/scene/material_flags.h"

namespace packtrace {
namespace {

// Leaves room for the JSON part.
constexpr uint64_t kMaxBytes = std::numeric_limits<uint32_t>::max() - (uint64_t{64} << 20);
constexpr int kChannels = 4;

int wrap_of(WrapMode wrap) {
  return wrap == WrapMode::kRepeat ? TINYGLTF_TEXTURE_WRAP_REPEAT : TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE;
}

tinygltf::Value numbers(double x, double y) {
  return tinygltf::Value(tinygltf::Value::Array{tinygltf::Value(x), tinygltf::Value(y)});
}

/// Whether a mask and a texture have the same texture transform and wrap mode.
template <typename A, typename B>
bool same_layout(const A& a, const B& b) {
  return a.wrap == b.wrap && a.uv_scale == b.uv_scale && a.uv_offset == b.uv_offset;
}

} // namespace

int append_buffer_view(tinygltf::Model& model, const void* bytes, size_t size) {
  std::vector<unsigned char>& data = model.buffers.front().data;
  data.resize((data.size() + 3) / 4 * 4);
  if (size > kMaxBytes - std::min<uint64_t>(kMaxBytes, data.size()))
    throw Error(ErrorKind::kLimitExceeded, "more than the 4 GiB that a .glb file holds");
  tinygltf::BufferView view;
  view.buffer = 0;
  view.byteOffset = data.size();
  view.byteLength = size;
  const auto* const begin = static_cast<const unsigned char*>(bytes);
  data.insert(data.end(), begin, begin + size);
  model.bufferViews.push_back(std::move(view));
  return static_cast<int>(model.bufferViews.size() - 1);
}

void GltfMaterials::add_all() {
  for (const baked::MaterialRecord& record : file_.sections().materials) add(record);
}

void GltfMaterials::add(const baked::MaterialRecord& record) {
  tinygltf::Material material;
  material.name = to_utf8(file_.text(record.name));
  material.doubleSided = true; // as all surfaces in pbrt
  tinygltf::PbrMetallicRoughness& surface = material.pbrMetallicRoughness;
  surface.baseColorFactor = {record.albedo[0], record.albedo[1], record.albedo[2], 1.0};
  surface.metallicFactor = (record.flags & (kMetal | kMirror)) != 0 ? 1.0 : 0.0;
  surface.roughnessFactor = (record.flags & kMirror) != 0 ? 0.0 : 1.0;
  if (record.flags & kEmissive) material.emissiveFactor = {1.0, 1.0, 1.0};
  if (record.flags & kTransmissive)
    material.extensions["KHR_materials_transmission"] =
        tinygltf::Value(tinygltf::Value::Object{{"transmissionFactor", tinygltf::Value(1.0)}});
  // glTF has one mask per material; it gets the one for camera rays.
  const uint32_t mask = (record.flags & kAlphaMask) != 0 ? record.alpha_mask : baked::kNone;
  if (mask != baked::kNone || record.albedo_texture != baked::kNone) add_image(record, mask, material);
  material.extras =
      tinygltf::Value(tinygltf::Value::Object{{"flags", tinygltf::Value(static_cast<int>(record.flags))}});
  model_.materials.push_back(std::move(material));
}

void GltfMaterials::add_image(const baked::MaterialRecord& record, uint32_t mask, tinygltf::Material& material) {
  uint32_t albedo = record.albedo_texture;
  if (mask != baked::kNone && albedo != baked::kNone && !same_layout(file_.mask(mask), file_.texture(albedo))) {
    albedo = baked::kNone;
    ++simplified_;
  }
  tinygltf::PbrMetallicRoughness& surface = material.pbrMetallicRoughness;
  surface.baseColorTexture.index = texture_of(mask, albedo);
  if (albedo != baked::kNone) surface.baseColorFactor = {1.0, 1.0, 1.0, 1.0};
  const Vec2 scale = mask != baked::kNone ? file_.mask(mask).uv_scale : file_.texture(albedo).uv_scale;
  const Vec2 offset = mask != baked::kNone ? file_.mask(mask).uv_offset : file_.texture(albedo).uv_offset;
  // glTF rows count from the top: t = 1 - (v scale + offset).
  surface.baseColorTexture.extensions["KHR_texture_transform"] =
      tinygltf::Value(tinygltf::Value::Object{{"offset", numbers(double{offset.x}, 1.0 - double{offset.y})},
                                              {"scale", numbers(double{scale.x}, -double{scale.y})}});
  if (mask == baked::kNone) return;
  material.alphaMode = "MASK";
  material.alphaCutoff = 0.5;
}

/// Returns the glTF texture for a mask, an albedo texture or both. Its size per axis is that of the larger one.
int GltfMaterials::texture_of(uint32_t mask, uint32_t albedo_texture) {
  const auto [place, added] = textures_.try_emplace({mask, albedo_texture}, static_cast<int>(model_.textures.size()));
  if (!added) return place->second;
  const AlphaMaskView bits = mask != baked::kNone ? file_.mask(mask) : AlphaMaskView{};
  const TextureView colours = albedo_texture != baked::kNone ? file_.texture(albedo_texture) : TextureView{};
  const uint32_t width = std::max(bits.width, colours.width), height = std::max(bits.height, colours.height);
  std::vector<uint8_t> pixels;
  const uint64_t bytes = uint64_t{width} * height * kChannels;
  if (bytes > std::numeric_limits<int>::max())
    throw Error(ErrorKind::kLimitExceeded, "a texture of more than 2^29 texels cannot be written as PNG");
  pixels.reserve(bytes);
  for (uint32_t y = 0; y < height; ++y)
    for (uint32_t x = 0; x < width; ++x) {
      const auto scaled = [](uint32_t at, uint32_t from, uint32_t to) {
        return static_cast<uint32_t>((uint64_t{at} * 2 + 1) * to / (uint64_t{from} * 2));
      };
      Rgb8 colour{255, 255, 255};
      if (colours.width > 0) colour = colours.texel(scaled(x, width, colours.width), scaled(y, height, colours.height));
      uint8_t alpha = 255;
      if (bits.width > 0) {
        const uint32_t column = scaled(x, width, bits.width), row = scaled(y, height, bits.height);
        const size_t word = size_t{row} * AlphaMask::row_words(bits.width) + column / 32;
        alpha = (bits.words[word] >> (column % 32)) & 1u ? 255 : 0;
      }
      pixels.insert(pixels.end(), {colour[0], colour[1], colour[2], alpha});
    }
  std::vector<uint8_t> png;
  const auto append = [](void* to, void* data, int size) {
    const auto* const begin = static_cast<const uint8_t*>(data);
    static_cast<std::vector<uint8_t>*>(to)->insert(static_cast<std::vector<uint8_t>*>(to)->end(), begin, begin + size);
  };
  if (!stbi_write_png_to_func(append, &png, static_cast<int>(width), static_cast<int>(height), kChannels, pixels.data(),
                              static_cast<int>(width) * kChannels))
    throw std::runtime_error("an image could not be written as PNG");
  image_bytes_ += png.size();

  tinygltf::Image image;
  image.bufferView = append_buffer_view(model_, png.data(), png.size());
  image.mimeType = "image/png";
  image.width = static_cast<int>(width), image.height = static_cast<int>(height);
  model_.images.push_back(std::move(image));
  tinygltf::Sampler sampler;
  sampler.wrapS = sampler.wrapT = wrap_of(mask != baked::kNone ? bits.wrap : colours.wrap);
  sampler.magFilter = TINYGLTF_TEXTURE_FILTER_LINEAR;
  model_.samplers.push_back(std::move(sampler));
  tinygltf::Texture texture;
  texture.source = static_cast<int>(model_.images.size() - 1);
  texture.sampler = static_cast<int>(model_.samplers.size() - 1);
  model_.textures.push_back(std::move(texture));
  return place->second;
}

} // namespace packtrace
