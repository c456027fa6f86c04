#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <tiny_gltf.h>

#include "compress/format/file/baked_file.h"

namespace packtrace {

/// Appends bytes to a model's one buffer, at multiples of 4, and returns the new buffer view.
/// Throws Error(kLimitExceeded) beyond what a .glb can hold.
int append_buffer_view(tinygltf::Model& model, const void* bytes, size_t size);

/// Turns the materials of a baked file into those of a glTF model, and masks and textures into its images. Extras hold
/// the flags.
class GltfMaterials {
public:
  GltfMaterials(const BakedFile& file, tinygltf::Model& model) : file_(file), model_(model) {}

  /// All materials, in the file's order.
  void add_all();

  uint64_t image_bytes() const { return image_bytes_; }
  /// Whose mask and texture lie differently on the surface: the texture's average is used.
  uint64_t simplified() const { return simplified_; }

private:
  void add(const baked::MaterialRecord& record);
  void add_image(const baked::MaterialRecord& record, uint32_t mask, tinygltf::Material& material);
  int texture_of(uint32_t mask, uint32_t albedo_texture);

  const BakedFile& file_;
  tinygltf::Model& model_;
  std::map<std::pair<uint32_t, uint32_t>, int> textures_; ///< by mask and albedo texture
  uint64_t image_bytes_ = 0, simplified_ = 0;
};

} // namespace packtrace
