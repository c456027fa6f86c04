#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "compress/exchange/gltf/gltf_config.h"
#include "compress/exchange/gltf/gltf_model.h"
#include "compress/format/file/baked_file.h"

namespace packtrace {

/// A map of texture coordinates: uv * scale + offset.
struct UvMap {
  glm::dvec2 scale{1.0}, offset{0.0};
  bool operator==(const UvMap&) const = default;
};

/// Converts the materials of a baked file to glTF materials, and their masks and textures to images.
class GltfMaterials {
public:
  GltfMaterials(const BakedFile& file, const GltfConfig& config, GltfModel& model)
      : file_(file), config_(config), model_(model) {}

  /// Adds all materials, in the file's order.
  /// @param stored maps the texture coordinates that vertices store to the file's
  void add_all(const UvMap& stored);

  /// Number of the glTF material.
  int number(uint32_t material) const { return uses_[material].number; }
  bool has_image(uint32_t material) const { return uses_[material].has_image; }
  /// What vertices must apply to the file's texture coordinates; the identity if the material does it.
  const UvMap& vertex_map(uint32_t material) const { return uses_[material].vertex_map; }

  uint64_t image_bytes() const { return image_bytes_; }
  double lowest_psnr() const { return lowest_psnr_; } ///< of the images, dB; infinite if all are exact
  /// Number of materials whose mask and texture have different transforms; they use the texture's average colour.
  uint64_t simplified() const { return simplified_; }

private:
  struct Use {
    int number = 0;
    bool has_image = false;
    UvMap vertex_map;
  };
  void add(const baked::MaterialRecord& record, const UvMap& stored);
  void add_image(const baked::MaterialRecord& record, uint32_t mask, const UvMap& stored, GltfJson& material, Use& use);
  int texture_of(uint32_t mask, uint32_t albedo_texture);
  int add_texture(const struct RgbaImage& image, WrapMode wrap, std::string_view name);

  const BakedFile& file_;
  const GltfConfig& config_;
  GltfModel& model_;
  std::vector<Use> uses_;
  std::map<std::string, int> known_;                      ///< materials without names, by their JSON
  std::map<std::pair<uint32_t, uint32_t>, int> textures_; ///< by mask and albedo texture
  std::map<int, int> samplers_;                           ///< by wrap mode
  uint64_t image_bytes_ = 0, simplified_ = 0;
  double lowest_psnr_ = 0.0;
};

} // namespace packtrace
