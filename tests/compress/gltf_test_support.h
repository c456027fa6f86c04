#pragma once

#include <array>
#include <cmath>
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include <draco/compression/decode.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <tiny_gltf.h>

#include "compress/exchange/gltf/gltf_export.h"

/// Reading of exported glTF files with tinygltf, as another program would.
namespace packtrace::gltf_test {

inline GltfExport export_of(const BakedFile& file, const GltfConfig& config = {}) {
  Progress progress;
  return export_gltf(file, config, progress);
}

inline GltfConfig plain() {
  GltfConfig config;
  config.codec = GltfCodec::kNone;
  return config;
}

inline uint32_t word_at(const std::vector<std::byte>& bytes, size_t place) {
  uint32_t word = 0;
  std::memcpy(&word, bytes.data() + place, sizeof word);
  return word;
}

/// tinygltf without Draco rejects accessors without a buffer view, as Draco primitives have them, so they get the first
/// one.
inline std::vector<std::byte> readable_without_draco(const std::vector<std::byte>& glb) {
  constexpr size_t kHeader = 12, kChunkHeader = 8;
  const size_t json_bytes = word_at(glb, kHeader);
  const auto* const text = reinterpret_cast<const char*>(glb.data()) + kHeader + kChunkHeader;
  nlohmann::json json = nlohmann::json::parse(text, text + json_bytes);
  if (json.contains("accessors"))
    for (nlohmann::json& accessor : json["accessors"])
      if (!accessor.contains("bufferView")) accessor["bufferView"] = 0;
  std::string changed = json.dump();
  changed.resize((changed.size() + 3) / 4 * 4, ' ');
  std::vector<std::byte> result(glb.begin(), glb.begin() + kHeader + kChunkHeader);
  const auto set_word = [&](size_t place, size_t value) {
    const auto word = static_cast<uint32_t>(value);
    std::memcpy(result.data() + place, &word, sizeof word);
  };
  set_word(8, glb.size() - json_bytes + changed.size());
  set_word(kHeader, changed.size());
  const auto bytes = std::as_bytes(std::span(changed));
  result.insert(result.end(), bytes.begin(), bytes.end());
  result.insert(result.end(), glb.begin() + static_cast<ptrdiff_t>(kHeader + kChunkHeader + json_bytes), glb.end());
  return result;
}

inline tinygltf::Model parse(const GltfExport& from) {
  EXPECT_EQ(word_at(from.bytes, 8), from.bytes.size());
  const std::vector<std::byte> bytes = readable_without_draco(from.bytes);
  tinygltf::Model model;
  std::string errors, warnings;
  EXPECT_TRUE(tinygltf::TinyGLTF().LoadBinaryFromMemory(&model, &errors, &warnings,
                                                        reinterpret_cast<const unsigned char*>(bytes.data()),
                                                        static_cast<unsigned int>(bytes.size())))
      << errors;
  return model;
}

struct Part {
  std::vector<Vec3> positions, normals;
  std::vector<Vec2> uvs;
  std::vector<Triangle> triangles;
};

template <typename Value>
std::vector<Value> accessor_values(const tinygltf::Model& model, int accessor, size_t count) {
  const tinygltf::BufferView& view =
      model.bufferViews[static_cast<size_t>(model.accessors[static_cast<size_t>(accessor)].bufferView)];
  EXPECT_EQ(view.byteLength, count * sizeof(Value));
  std::vector<Value> values(count);
  std::memcpy(static_cast<void*>(values.data()), model.buffers[0].data.data() + view.byteOffset, view.byteLength);
  return values;
}

inline std::vector<Triangle> triangles_of(const tinygltf::Model& model, int accessor, size_t count) {
  if (model.accessors[static_cast<size_t>(accessor)].componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT)
    return accessor_values<Triangle>(model, accessor, count);
  std::vector<Triangle> triangles;
  for (const auto& t : accessor_values<std::array<uint16_t, 3>>(model, accessor, count))
    triangles.emplace_back(t[0], t[1], t[2]);
  return triangles;
}

template <typename Value>
std::vector<Value> draco_values(const draco::Mesh& mesh, const tinygltf::Value& ids, const char* name) {
  std::vector<Value> values;
  if (!ids.Has(name)) return values;
  const draco::PointAttribute* const attribute =
      mesh.GetAttributeByUniqueId(static_cast<uint32_t>(ids.Get(name).GetNumberAsInt()));
  for (draco::PointIndex point(0); point < mesh.num_points(); ++point)
    attribute->GetMappedValue(point, &values.emplace_back());
  return values;
}

/// Decodes one primitive as any reader would, and checks it against its accessors.
inline Part part_of(const tinygltf::Model& model, const tinygltf::Primitive& primitive) {
  Part part;
  const auto count = [&](int accessor) { return model.accessors[static_cast<size_t>(accessor)].count; };
  const size_t vertices = count(primitive.attributes.at("POSITION")), indices = count(primitive.indices);
  const auto extension = primitive.extensions.find("KHR_draco_mesh_compression");
  if (extension == primitive.extensions.end()) {
    part.positions = accessor_values<Vec3>(model, primitive.attributes.at("POSITION"), vertices);
    if (primitive.attributes.count("NORMAL"))
      part.normals = accessor_values<Vec3>(model, primitive.attributes.at("NORMAL"), vertices);
    if (primitive.attributes.count("TEXCOORD_0"))
      part.uvs = accessor_values<Vec2>(model, primitive.attributes.at("TEXCOORD_0"), vertices);
    part.triangles = triangles_of(model, primitive.indices, indices / 3);
    return part;
  }
  const tinygltf::BufferView& view =
      model.bufferViews[static_cast<size_t>(extension->second.Get("bufferView").GetNumberAsInt())];
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(model.buffers[0].data.data()) + view.byteOffset, view.byteLength);
  const auto decoded = draco::Decoder().DecodeMeshFromBuffer(&buffer);
  EXPECT_TRUE(decoded.ok());
  const draco::Mesh& mesh = *decoded.value();
  const tinygltf::Value& ids = extension->second.Get("attributes");
  part.positions = draco_values<Vec3>(mesh, ids, "POSITION");
  part.normals = draco_values<Vec3>(mesh, ids, "NORMAL");
  part.uvs = draco_values<Vec2>(mesh, ids, "TEXCOORD_0");
  for (draco::FaceIndex f(0); f < mesh.num_faces(); ++f)
    part.triangles.emplace_back(mesh.face(f)[0].value(), mesh.face(f)[1].value(), mesh.face(f)[2].value());
  EXPECT_EQ(part.positions.size(), vertices);
  EXPECT_EQ(3 * part.triangles.size(), indices);
  EXPECT_EQ(part.normals.empty(), primitive.attributes.count("NORMAL") == 0);
  EXPECT_EQ(part.uvs.empty(), primitive.attributes.count("TEXCOORD_0") == 0);
  return part;
}

} // namespace packtrace::gltf_test
