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

/// Appends bytes to the model's only buffer, aligned to 4 bytes, and returns the number of the new buffer view.
/// Throws Error(kLimitExceeded) beyond the size limit of a .glb.
int append_buffer_view(tinygltf::Model& model, const void* bytes, size_t size);

/// Converts the materials of a baked file to glTF materials, and their masks and textures to images. The extras of a
/// material hold its flags.
class GltfMaterials {
public:
  GltfMaterials(const BakedFile& file, tinygltf::Model& model) : file_(file), model_(model) {}

  /// Adds all materials, in the file's order.
  void add_all();

  uint64_t image_bytes() const { return image_bytes_; }
  /// Number of materials whose mask and texture have different transforms; they use the texture's average colour.
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
