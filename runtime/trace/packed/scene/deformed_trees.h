#pragma once

#include <memory>
#include <span>
#include <vector>

#include "runtime/trace/packed/scene/deformed_tree.h"
#include "runtime/trace/packed/scene/traced_trees.h"

namespace packtrace {

/// A frame of a deforming geometry.
struct DeformedFrame {
  uint32_t geometry = 0;
  const FrameVertices* vertices = nullptr;
};

/// The deforming geometries of a file and their current trees, which several tracers may show.
class DeformedTrees {
public:
  DeformedTrees() = default;
  /// @param traced trees over LOD level 0
  /// Throws Error(kInput) if a geometry does not exist, occurs twice or lies in the world's tree.
  DeformedTrees(const BakedFile& file, std::span<const DeformingGeometry> deforming, const DeformConfig& config,
                const TracedTrees& traced);

  /// The geometries that deform, in the order in which they were given.
  std::span<const uint32_t> geometries() const { return geometries_; }

  /// The tree of a geometry of the file; null if it does not deform.
  const DeformedTree* find(uint32_t geometry) const;

  /// Number of updates of a geometry that deforms so far.
  uint64_t updates(uint32_t geometry) const { return updates_[geometry]; }

  /// Moves a geometry's vertices.
  /// Throws Error(kInput) if the geometry does not deform, and as DeformedTree::update() does.
  DeformStep update(const DeformedFrame& frame);

  uint64_t bytes() const;

private:
  std::vector<uint32_t> geometries_;
  std::vector<std::unique_ptr<DeformedTree>> trees_; ///< by geometry; empty if none deforms
  std::vector<uint64_t> updates_;                    ///< by geometry
};

/// Puts a deforming geometry's tree and clusters in the place of those that the file has of it.
/// @param number of its tree
/// @param first_cluster number of the geometry's first cluster in the cluster section
/// @param records what traced.records refers to
void show_deformed(const DeformedTree& tree, uint32_t number, size_t first_cluster,
                   std::span<baked::TreeRecord> records, TracedTrees& traced);

} // namespace packtrace
