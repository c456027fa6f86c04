#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "pbrt_import/gltf/gltf_animation.h"
#include "pbrt_import/gltf/gltf_document.h"
#include "pbrt_import/gltf/gltf_materials.h"
#include "pbrt_import/gltf/gltf_motion.h"
#include "pbrt_import/gltf/gltf_nodes.h"
#include "pbrt_import/gltf/gltf_pose.h"

namespace packtrace::gltf {

/// Reads a glTF 2.0 file as part of a scene. Cameras belong before the world, so reading has two steps.
class Reader {
public:
  /// Reads the document and places its nodes. Throws like Document, Animation and place_nodes().
  /// @param world_from_file as for the other mesh files
  Reader(const std::filesystem::path& file, uint32_t file_number, const MeshFileContext& context,
         const DAffine& world_from_file);

  /// Adds the cameras, the last one first, since pbrt renders with the last.
  void add_cameras();
  /// Adds materials, meshes, their instances, and lights. A mesh that moves, or that several nodes use, becomes an
  /// object with instances. What is malformed is reported and left out.
  void add_world();

private:
  /// A node with a mesh.
  struct MeshUse {
    uint64_t mesh = 0;
    size_t placed = kNoNode;                              ///< the node; none for skins, which joints move
    std::vector<DAffine> node_from_mesh = {DAffine(1.0)}; ///< of its instances
    size_t weights_of = kNoNode;                          ///< placed node whose weights the morph targets have
    std::optional<uint64_t> skin;
    Pose pose;
    bool deforms = false; ///< the animation moves its morph targets or its joints
    std::optional<NodeMotion> motion;
    /// Whether the mesh is a separate object: it is deformed, and moves as a whole.
    bool alone() const { return !pose.empty() && motion.has_value(); }
  };
  void add_camera(size_t placed, uint64_t camera);
  void collect_meshes();
  bool leaves_lattice(const MeshUse& use);
  void collect_frames(Skins& skins);
  void collect_mesh(size_t placed, Skins& skins, PosedSkins& posed_skins);
  void add_objects(const Materials& materials);
  void add_object(const Materials& materials, uint64_t mesh, const Pose& pose, const std::string& name);
  void add_use(const Materials& materials, const MeshUse& use);
  void add_shapes(const Materials& materials, uint64_t mesh, const Pose& pose);
  void add_light(const PlacedNode& placed, uint64_t light);
  void report_motion();
  std::span<const PlacedNode> posed() const { return posed_.empty() ? nodes_ : posed_; }
  void report(const std::string& problem, std::string_view consequence);

  MeshFileContext context_;
  DAffine world_from_file_;
  std::unique_ptr<Document> document_;
  Animation animation_;
  double pose_time_; ///< of morph targets and skins, in seconds
  std::vector<PlacedNode> nodes_;
  std::vector<PlacedNode> posed_; ///< at the time of morphs and skins; empty: as nodes_
  NodeTracks tracks_;
  std::vector<MeshUse> uses_;
  std::vector<uint8_t>
      is_object_; ///< by mesh: becomes an object, because it moves, is placed several times or leaves its lattice
};

} // namespace packtrace::gltf
