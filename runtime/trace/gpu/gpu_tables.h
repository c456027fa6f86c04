#pragma once

#include <cstdint>
#include <vector>

#include "runtime/gpu/gpu_scene.h"
#include "runtime/gpu/structures/ray_structures.h"
#include "runtime/trace/gpu/structure_cache.h"
#include "runtime/trace/packed/scene/packed_tracer.h"

namespace packtrace {

/// The tables of a packed tracer as a GPU reads them.
class GpuTables {
public:
  /// @param file, source, tracer needed as long as this object
  /// @param structures what rays will traverse
  /// Throws Error(kUnsupported) for geometry that deforms.
  GpuTables(const BakedFile& file, const SceneSource& source, const PackedTracer& tracer, GpuStructures structures);

  /// Reads the tracer's placements again.
  void update_placements();
  gpu::SceneTables view() const;

  // With GpuStructures::kDriver:
  std::span<const gpu::BottomLevel> bottom_levels() const { return bottom_levels_; }
  std::span<const StructureKey> structure_keys() const { return structure_keys_; }
  std::span<const gpu::RangeRecord> ranges() const { return ranges_; }

private:
  void add_trees();
  void add_clusters();
  void add_bottom_levels();
  void add_bottom_level(uint32_t tree, uint32_t ray_classes, std::span<const uint32_t> clusters);
  void add_exact_vertices(uint32_t cluster, gpu::ClusterRecord& record);
  void add_materials();
  void add_masked_cluster(uint32_t cluster, gpu::ClusterRecord& record);
  uint32_t image_word(uint32_t mask);
  uint32_t geometry_of(uint32_t cluster) const;

  const BakedFile& file_;
  const SceneSource& source_;
  const PackedTracer& tracer_;
  const GpuStructures structures_;
  std::vector<gpu::TreeRecord> trees_;
  std::vector<gpu::ClusterRecord> clusters_;
  std::vector<float> exact_vertices_;
  std::vector<uint32_t> masks_;
  std::vector<uint32_t> image_words_;        ///< by mask of the source: its word in masks_, 0: not there yet
  std::vector<uint32_t> instance_materials_; ///< by instance: word in masks_ of its first material
  uint32_t materials_word_ = 0;              ///< word of material 0
  uint32_t placements_word_ = 0;             ///< word of the placements' materials
  uint32_t levels_ = 0;
  std::vector<gpu::BottomLevel> bottom_levels_; ///< in the order of trees
  std::vector<StructureKey> structure_keys_;    ///< by bottom level
  std::vector<gpu::RangeRecord> ranges_;
};

} // namespace packtrace
