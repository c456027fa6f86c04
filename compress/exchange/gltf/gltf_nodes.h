#pragma once

#include <map>
#include <span>
#include <vector>

#include "compress/exchange/gltf/gltf_instances.h"
#include "compress/exchange/gltf/gltf_meshes.h"

namespace packtrace {

/// Adds the nodes of a baked file to a model: instances and cameras below a root that mirrors x.
class GltfNodes {
public:
  GltfNodes(const BakedFile& file, const GltfConfig& config, GltfMeshes& meshes, GltfModel& model, GltfReport& report)
      : file_(file), config_(config), meshes_(meshes), model_(model), report_(report) {}

  /// @param is_merged by instance: whether GltfMeshes::add_world() has added it
  void add_all(const std::vector<bool>& is_merged);

private:
  void add_instance(uint32_t instance, std::map<int, std::vector<uint32_t>>& groups);
  void add_group(int mesh, const std::vector<uint32_t>& instances);
  void add_levels(const baked::InstanceRecord& instance, GltfJson& node);
  void add_camera(const Camera& camera);
  void add_node(GltfJson node) { children_.push_back(model_.add("nodes", std::move(node))); }
  double scene_size() const;

  const BakedFile& file_;
  const GltfConfig& config_;
  GltfMeshes& meshes_;
  GltfModel& model_;
  GltfReport& report_;
  std::vector<int> children_; ///< of the root
};

} // namespace packtrace
