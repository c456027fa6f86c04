#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "pbrt_import/mesh_files/mesh_file_context.h"
#include "pbrt_import/scene/math.h"
#include "pbrt_import/scene_format.h"

namespace packtrace {

namespace gltf {
class Reader;
}

/// Reads PLY, OBJ, STL and glTF files as the world of one scene, in their order. Their coordinates are scaled and
/// turned according to ImportOptions::mesh_scale and mesh_up. Images within glTF files live as long as this object.
class MeshFiles {
public:
  MeshFiles(std::span<const std::filesystem::path> files, const MeshFileContext& context);
  ~MeshFiles();

  /// @return position of the end of the last file
  /// Throws FileError(kInput) if a file cannot be read; MemoryError; Error(kCancelled).
  Place read();

private:
  template <class Work>
  void with_name(const std::filesystem::path& file, const Work& work);
  void read_file(size_t i);

  std::vector<std::filesystem::path> files_;
  MeshFileContext context_;
  DAffine world_from_file_;
  std::vector<Place> places_; ///< start of each file
  std::map<size_t, std::unique_ptr<gltf::Reader>> gltf_readers_;
};

} // namespace packtrace
