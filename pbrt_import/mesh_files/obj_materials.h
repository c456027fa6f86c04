#pragma once

#include <cstdint>
#include <string>
#include <unordered_map>
#include <vector>

#include "pbrt_import/mesh_files/mesh_file_context.h"
#include "pbrt_import/mesh_files/mtl_reader.h"

namespace packtrace {

/// The materials of an OBJ file, as pbrt materials (docs/mesh_files.md has the table).
class ObjMaterials {
public:
  /// Number of the material of faces before any usemtl, and of materials that no file defines.
  static constexpr uint32_t kDefault = ~0u;

  /// Reads a material library. Problems are reported, a missing file too.
  /// @param names what follows mtllib: a file name, which may contain spaces, or several
  void read_library(std::string_view names, const Place& place, const std::filesystem::path& folder,
                    const MeshFileContext& context);

  /// Number of a material by name; kDefault, with an error reported, if there is none.
  uint32_t find(std::string_view name, const Place& place, Reporter& reporter) const;

  /// Defines all materials in the scene.
  void define(const MeshFileContext& context) const;
  /// Makes a material current for the next shape, with its emission.
  void use(uint32_t material, const Place& place, DirectiveFeed& feed) const;
  /// Adds the material's opacity to the parameters of a shape.
  void add_opacity(uint32_t material, DirectiveFeed& feed) const;

private:
  void read_file(const std::filesystem::path& file, const Place& place, const MeshFileContext& context);

  std::vector<MtlMaterial> materials_;
  std::unordered_map<std::string, uint32_t> numbers_; ///< by name; the last definition wins
};

} // namespace packtrace
