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

/// The deforming geometries of a tracer. Puts their trees and clusters in the place of the file's.
class DeformedTrees {
public:
  DeformedTrees() = default;
  /// @param traced trees over LOD level 0; its records, trees, hulls and clusters are replaced
  /// Throws Error(kInput) if a geometry does not exist, occurs twice or has no tree of its own.
  DeformedTrees(const BakedFile& file, std::span<const DeformingGeometry> deforming, const DeformConfig& config,
                TracedTrees& traced);

  /// The tree of a geometry of the file; null if it does not deform.
  const DeformedTree* find(uint32_t geometry) const;

  /// Moves a geometry's vertices and replaces its tree and clusters.
  /// Throws Error(kInput) if the geometry does not deform, and as DeformedTree::update() does.
  DeformStep update(const DeformedFrame& frame, TracedTrees& traced);

  uint64_t bytes() const;

private:
  void show(uint32_t geometry, const DeformedTree& tree, TracedTrees& traced);

  const BakedFile* file_ = nullptr;
  std::vector<baked::TreeRecord> records_;           ///< of all trees, with the grids of the deforming ones
  std::vector<std::unique_ptr<DeformedTree>> trees_; ///< by geometry; empty if none deforms
};

} // namespace packtrace
