#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "compress/bake/bake_config.h"
#include "compress/bake/clusters/geometry_encoder.h"
#include "compress/bake/clusters/quantized_geometry.h"
#include "compress/bake/grid/geometry_grid.h"
#include "compress/bake/grid/scene_measure.h"
#include "compress/bake/lod/lod_encoder.h"
#include "compress/bake/lod/shared_borders.h"
#include "compress/bake/plan/geometry_plan.h"
#include "compress/bake/plan/requirements.h"
#include "compress/bake/write/lod_store.h"
#include "pbrt_import/base/progress.h"
#include "pbrt_import/scene/bounds.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// Triangles processed to build a geometry's LOD levels, relative to its own number of triangles: each level has half
/// as many as the one below.
inline constexpr uint64_t kLodWork = 2;

/// One geometry as written to a file.
struct PackedGeometry {
  baked::GeometryRecord record{};
  EncodedGeometry encoded;
  QuantizeStats stats;
  std::vector<uint32_t> slots; ///< slots of the plan that still have triangles
  GeometryNeeds needs;
  EncodedLod lod;
  Bounds frames{}; ///< of all frames, geometry space, if the geometry deforms

  size_t bytes() const { return encoded.payload.size() + encoded.clusters.size() * sizeof(baked::ClusterRecord); }
};

/// Mean normal error in degrees; 0 without normals.
double mean_normal_error(const QuantizeStats& stats);

/// Packs the geometries of a plan. Functions may be called concurrently. The arguments of the constructor must outlive
/// the packer.
class GeometryPacker {
public:
  /// @param grids by geometry
  /// Throws Error(kIo) if config.resume cannot be used.
  GeometryPacker(const Scene& scene, const ScenePlan& plan, const SceneMeasure& measure,
                 std::span<const GeometryGrid> grids, const BakeConfig& config, Progress& progress);

  /// Puts a geometry on its grid. Throws like quantize_geometry().
  QuantizedGeometry quantize(size_t index, const GeometryNeeds& needs) const;

  /// Throws like quantize(), encode_geometry() and build_cluster_lod().
  /// @param borders positions that LOD levels of world-space geometries must not move; null: no LOD levels
  PackedGeometry pack(size_t index, const SharedBorders* borders);

  /// Number of geometries whose LOD levels came from an interrupted bake.
  uint64_t resumed() const { return resumed_; }

private:
  /// A geometry as quantised, as clusters and as packed.
  struct Draft {
    QuantizedGeometry quantized;
    GeometryClusters clusters;
    PackedGeometry packed;
  };

  Draft pack_with(size_t index, const GeometryNeeds& needs) const;
  /// @param draft its quantised geometry is consumed
  EncodedLod find_or_build_lod(Draft& draft, const LodLimits& limits);

  const Scene& scene_;
  const ScenePlan& plan_;
  const SceneMeasure& measure_;
  std::span<const GeometryGrid> grids_;
  const BakeConfig& config_;
  Progress& progress_;
  std::optional<LodStore> store_;
  std::atomic<uint64_t> resumed_{0};
};

} // namespace packtrace
