#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "runtime/gpu/gpu_config.h"
#include "runtime/gpu/records/gpu_records.h"

namespace packtrace::gpu {

class Device;
class RayStructures;
class StructureMemory;

/// The tables of a scene to upload. Needed during the upload only.
struct SceneTables {
  std::span<const baked::PackedNode> nodes; ///< of all trees
  std::span<const TreeRecord> trees;
  std::span<const ClusterRecord> clusters;
  std::span<const uint8_t> payload; ///< the clusters' bits; 8 more bytes are not read
  std::span<const packed::TracePlacement> placements;
  packed::TracePlacement top;                 ///< KernelScene::top
  std::span<const packed::TopNode> top_nodes; ///< empty for a single placement
  std::span<const float> exact_vertices;
  std::span<const uint32_t> masks; ///< empty: no cluster is masked. See gpu_records.h
  SceneRecord scene;
  uint32_t tree_levels = 0; ///< of the deepest tree
};

struct BottomLevel;

/// A scene on a device. Hits are those of the CPU's packed kernels, bit for bit, where DeviceTraits::fused_floats or
/// the exact arithmetic holds; with GpuStructures::kDriver they are those that the driver finds. All const functions
/// may be called from several threads; they take turns.
class GpuScene {
public:
  /// Opens a device and uploads the scene. Throws as Device::open() and Buffer do.
  GpuScene(const GpuConfig& config, const SceneTables& tables);
  ~GpuScene();

  /// Prepares a scene with GpuStructures::kDriver, which traces nothing before place_structures() was called.
  /// @param ranges as RayStructures'
  void use_structures(std::shared_ptr<StructureMemory> memory, std::span<const RangeRecord> ranges);
  /// Null without use_structures().
  RayStructures* structures() const;
  /// Replaces the traced structures; see RayStructures::place().
  void place_structures(std::span<const packed::TracePlacement> placements, std::span<const BottomLevel> levels,
                        std::span<const uint64_t> structures) const;

  /// Uploads the placements that changed, and the nodes of the tree over them that did.
  void replace_placements(const SceneTables& tables);

  /// Size of the last upload of placements in bytes.
  uint64_t uploaded_bytes() const;

  /// Finds nearest hits; see RayTracer::closest_hits().
  /// @param between called before each dispatch; may throw
  void closest(std::span<const packed::KernelRay> rays, uint32_t ray_class, std::span<packed::KernelHit> hits,
               const std::function<void()>& between = {}) const;
  /// Finds any hits; see RayTracer::any_hits().
  void any(std::span<const packed::KernelRay> rays, uint32_t ray_class, std::span<uint8_t> occluded) const;

  /// Frees the memory for rays and hits, which otherwise stays allocated between calls.
  void release_rays() const;

  std::string device_name() const;
  /// Lanes of a subgroup.
  uint32_t subgroup_size() const;
  /// Whether float operations are emulated by doubles.
  bool emulates_floats() const;
  /// Memory on the device that stays allocated.
  uint64_t bytes() const;
  std::vector<std::string> validation_messages() const;
  bool validates() const;

  struct State;
  /// For kernels other than those of spans of rays.
  State& state() const { return *state_; }

private:
  std::unique_ptr<State> state_;
};

} // namespace packtrace::gpu
