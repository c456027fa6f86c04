#pragma once

#include <memory>
#include <vector>

#include "pbrt_import/scene/camera_rays.h"
#include "runtime/camera/gbuffer.h"
#include "runtime/frame/frame_config.h"
#include "runtime/lod/lod_sharing.h"
#include "runtime/trace/source/lod_source.h"

namespace packtrace {

/// Chooses the LOD cuts of a file for one view after another (docs/lod_runtime.md).
class DetailPlanner {
public:
  /// @param file with LOD levels; must outlive this object
  /// @param source a source of the same file; must outlive this object
  /// Throws as LodSharing does.
  DetailPlanner(const BakedFile& file, const PackedSource& source, const DetailConfig& config);

  /// Plans for a view.
  /// @param view camera with the traced image size
  /// @param seen G-buffer of the camera rays; null unless DetailConfig::cull_invisible
  /// @return whether source() was replaced, because the BLASes or their instances changed
  /// Throws as detail_view() does.
  bool plan(const PrimaryCamera& view, const GBuffer* seen);

  /// Moves an instance before the next plan. Throws as LodSharing::set_transform() does.
  void move_instance(uint32_t instance, const Affine& world_from_object);

  /// Lets an instance show another geometry from the next plan on.
  void set_geometry(uint32_t instance, uint32_t geometry);

  /// The clusters to trace, after the first plan().
  const LodSource& source() const { return *source_; }
  const LodPlan& current() const { return plan_; }
  const LodSharing& sharing() const { return *sharing_; }
  const std::vector<LodGeometry>& geometries() const { return geometries_; }
  const std::vector<LodInstance>& instances() const { return instances_; }
  double error_px() const { return *config_.error_px; }
  /// Number of instances to which SharingConfig::culled_error_scale applied.
  size_t culled() const { return culled_; }
  /// Wall times in seconds: reading the levels; the last plan; its source.
  double load_s() const { return load_s_; }
  double plan_s() const { return plan_s_; }
  double source_s() const { return source_s_; }

private:
  const BakedFile& file_;
  const PackedSource& packed_;
  DetailConfig config_;
  std::vector<LodGeometry> geometries_;
  std::vector<LodInstance> instances_;
  std::unique_ptr<LodSharing> sharing_;
  LodPlan plan_, next_;
  std::unique_ptr<LodSource> source_;
  bool regrouped_ = false; ///< instances_ have other geometries than sharing_
  size_t culled_ = 0;
  double load_s_ = 0.0, plan_s_ = 0.0, source_s_ = 0.0;
};

} // namespace packtrace
