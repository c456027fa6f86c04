#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "compress/bake/bake_config.h"
#include "compress/bake/geometry_packer.h"
#include "compress/bake/grid/scene_measure.h"
#include "compress/bake/plan/geometry_plan.h"
#include "compress/bake/sequence/sequence_measure.h"
#include "compress/format/deformation/deformation_encoder.h"
#include "pbrt_import/base/progress.h"

namespace packtrace {

/// Bakes the geometries whose vertices move. Frames are read twice, one at a time: first for the box of all frames,
/// which sets the grid; then to be encoded.
class SequenceBaker {
public:
  /// Throws Error(kUsage) if a mesh does not exist or has two sequences.
  SequenceBaker(const Scene& scene, const BakeConfig& config);

  /// The meshes that move, for plan_scene().
  std::span<const uint32_t> meshes() const { return meshes_; }

  /// Measures all sequences. Connects the plan's parts with them, and extends the bounds of their geometries to those
  /// of all frames. Throws like measure_sequence().
  void measure(ScenePlan& plan, SceneMeasure& measure, Progress& progress);

  /// Encodes the frames of all geometries that deform.
  /// @param grids,packed by geometry of the plan
  /// Throws Error(kInput) if the sequences of one geometry differ in their number of frames or their frames per second;
  /// Error(kLimitExceeded) if the frames span more steps than a tree holds, or a cluster in one frame more than its
  /// position fields hold, or a measured error exceeds the bound of the geometry; and what MeshFrames::positions()
  /// throws.
  std::vector<EncodedDeformation> pack(const ScenePlan& plan, std::span<const GeometryGrid> grids,
                                       std::span<const PackedGeometry> packed, Progress& progress) const;

private:
  const MeshSequence* sequence_of(const GeometryPart& part) const;
  EncodedDeformation pack_geometry(const GeometryPlan& plan, uint32_t geometry, const GeometryGrid& grid,
                                   const PackedGeometry& packed, Progress& progress) const;

  const Scene& scene_;
  const BakeConfig& config_;
  std::vector<uint32_t> meshes_;
  std::vector<SequenceMeasure> measures_; ///< by sequence
};

} // namespace packtrace
