#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <unordered_set>
#include <utility>
#include <vector>

#include "pbrt_import/gltf/gltf_document.h"

namespace packtrace::gltf {

/// How the primitives of a material use it.
struct MaterialUse {
  std::string name;         ///< of the MakeNamedMaterial directive; empty: the default material
  Vec3 emission{0.0f};      ///< radiance of an area light; 0: none
  std::string opacity;      ///< texture of the alpha mask; empty: none
  bool absent = false;      ///< transparent everywhere
  uint64_t uv_set = 0;      ///< TEXCOORD_n of its textures
  double uv_rotation = 0.0; ///< radians, for KHR_texture_transform; uv scale and offset are then applied to vertices
  Vec2 uv_scale{1.0f}, uv_offset{0.0f}; ///< only with a rotation
};

/// The materials of a document as pbrt materials (docs/mesh_files.md has the table).
class Materials {
public:
  /// Defines all materials in the scene, with their textures. One that is malformed is reported and grey.
  Materials(Document& document, FileNames& file_names);

  /// A material by number; the default without one. Throws Error(kInput) if the number is out of range.
  const MaterialUse& use(std::optional<uint64_t> material) const;

private:
  /// Mean of an image.
  struct Average {
    Vec3 value{0.0f};
    std::string problem; ///< why there is none; empty: there is one
  };
  void define(const Value& material, MaterialUse& use);
  std::string define_image(const Value& info, MaterialUse& use, std::string_view what, std::optional<float> cutoff);
  float index_of(const Value& material);
  void read_mapping(const Value& info, MaterialUse& use, Vec2& scale, Vec2& offset);
  std::string image_file(uint64_t image);
  Vec3 image_average(const Value& info, bool decode_srgb);
  Vec3 read_average(uint64_t image, bool decode_srgb);
  std::string unique_name(const Value& material, size_t number);
  void report_losses(const Value& material);
  bool read_transparency(const Value& material, double alpha, const std::optional<Value>& image, MaterialUse& use);
  Vec3 read_emission(const Value& material);
  Vec3 roughness_and_metalness(const Value& base);
  void warn(const std::string& text);

  Document& document_;
  FileNames& file_names_;
  std::vector<MaterialUse> uses_;
  MaterialUse default_;
  std::unordered_set<std::string> names_;                 ///< of the materials so far
  std::map<std::pair<uint64_t, bool>, Average> averages_; ///< by image, and whether its mean is linear
};

} // namespace packtrace::gltf
