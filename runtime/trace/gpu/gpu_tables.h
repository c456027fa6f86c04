#pragma once

#include <cstdint>
#include <vector>

#include "runtime/gpu/gpu_scene.h"
#include "runtime/trace/packed/scene/packed_tracer.h"

namespace packtrace {

/// The tables of a packed tracer as a GPU reads them.
class GpuTables {
public:
  /// @param file, source, tracer needed as long as this object
  /// Throws Error(kUnsupported) for geometry that deforms.
  GpuTables(const BakedFile& file, const SceneSource& source, const PackedTracer& tracer);

  /// Reads the tracer's placements again.
  void update_placements();
  gpu::SceneTables view() const;

private:
  void add_trees();
  void add_clusters();
  void add_exact_vertices(uint32_t cluster, gpu::ClusterRecord& record);
  void add_masks();
  void add_materials();
  void add_masked_cluster(uint32_t cluster, gpu::ClusterRecord& record);
  uint32_t image_word(uint32_t mask);
  uint32_t geometry_of(uint32_t cluster) const;

  const BakedFile& file_;
  const SceneSource& source_;
  const PackedTracer& tracer_;
  std::vector<gpu::TreeRecord> trees_;
  std::vector<gpu::ClusterRecord> clusters_;
  std::vector<float> exact_vertices_;
  std::vector<uint32_t> masks_;
  std::vector<uint32_t> image_words_;        ///< by mask of the source: its word in masks_, 0: not there yet
  std::vector<uint32_t> instance_materials_; ///< by instance: word in masks_ of its first material
  uint32_t materials_word_ = 0;              ///< word of material 0
  uint32_t placements_word_ = 0;             ///< word of the placements' materials
  uint32_t levels_ = 0;
};

} // namespace packtrace
