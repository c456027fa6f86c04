#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "pbrt_import/gltf/gltf_document.h"
#include "pbrt_import/gltf/gltf_materials.h"
#include "pbrt_import/gltf/gltf_nodes.h"
#include "pbrt_import/gltf/gltf_pose.h"

namespace packtrace::gltf {

/// Reads a glTF 2.0 file as part of a scene. Cameras belong before the world, so reading has two steps.
class Reader {
public:
  /// Reads the document and places its nodes. Throws like Document and place_nodes().
  Reader(const std::filesystem::path& file, uint32_t file_number, const MeshFileContext& context);

  /// Adds the cameras, the last one first, since pbrt renders with the last.
  /// @param world_from_file as for the other mesh files
  void add_cameras(const DAffine& world_from_file);
  /// Adds materials, meshes, their instances, and lights. A mesh that several nodes use becomes an object with
  /// instances. What is malformed is reported and left out.
  void add_world();

private:
  /// A node with a mesh, times its instances.
  struct MeshUse {
    uint64_t mesh = 0;
    DAffine world_from_mesh{1.0};
    Pose pose;
  };
  void add_camera(const PlacedNode& placed, uint64_t camera, const DAffine& world_from_file);
  void collect_meshes();
  void add_shapes(const Materials& materials, uint64_t mesh, const Pose& pose);
  void add_light(const PlacedNode& placed, uint64_t light);
  void report(const std::string& problem, std::string_view consequence);

  MeshFileContext context_;
  std::unique_ptr<Document> document_;
  std::vector<PlacedNode> nodes_;
  std::vector<MeshUse> uses_;
};

} // namespace packtrace::gltf
