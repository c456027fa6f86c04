#include "compress/bake/geometry_packer.h"

#include <algorithm>

#include <tbb/task_group.h>

namespace packtrace {
namespace {

baked::GeometryRecord record_of(const GeometryPlan& plan, const QuantizedGeometry& q, double error_bound) {
  baked::GeometryRecord record{};
  record.origin = q.origin;
  record.max_position_error = q.stats.max_position_error;
  record.position_error_bound = error_bound;
  record.step_mantissa = q.grid.mantissa;
  record.step_exponent = q.grid.exponent;
  record.anchor_shift = q.anchor_shift;
  record.uv_exponent = stored_uv_exponent(q.uv_exponent);
  record.uv_encoding = static_cast<uint8_t>(q.uv_encoding);
  record.normal_encoding = static_cast<uint8_t>(q.normal_encoding);
  record.max_normal_error_degrees = static_cast<float>(q.stats.max_normal_error_degrees);
  record.mean_normal_error_degrees = static_cast<float>(mean_normal_error(q.stats));
  record.max_uv_error = static_cast<float>(q.stats.max_uv_error);
  record.flags = plan.world_space ? baked::kWorldSpace : uint16_t{0};
  record.slot_count = static_cast<uint32_t>(q.slot_class.size());
  return record;
}

/// The normals of frame 0 would be wrong in all others, so the faces' own are used. Normals on request stay, of all
/// triangles: those that are flat in frame 0 may bend later.
void leave_out_normals(GeometryNeeds& needs) {
  needs.infer_normals = false;
  for (PartNeeds& part : needs.parts)
    if (part.normals == baked::kForShading) part.normals = baked::kUnused;
}

} // namespace

double mean_normal_error(const QuantizeStats& stats) {
  return stats.normal_count > 0 ? stats.normal_error_sum / static_cast<double>(stats.normal_count) : 0.0;
}

GeometryPacker::GeometryPacker(const Scene& scene, const ScenePlan& plan, const SceneMeasure& measure,
                               std::span<const GeometryGrid> grids, const BakeConfig& config, Progress& progress)
    : scene_(scene), plan_(plan), measure_(measure), grids_(grids), config_(config), progress_(progress) {
  if (!config.resume.empty()) store_.emplace(config.resume);
}

PackedGeometry GeometryPacker::pack(size_t index, const SharedBorders* borders) {
  GeometryNeeds needs = analyse_requirements(scene_, plan_, plan_.geometries[index], config_);
  if (plan_.geometries[index].deforms) leave_out_normals(needs);
  Draft draft = pack_with(index, needs);
  if (borders != nullptr && !plan_.geometries[index].deforms &&
      draft.quantized.triangles.size() >= config_.lod_min_triangles) {
    // An encoding or error that the user asks for holds for all levels.
    LodLimits limits{config_.lod_levels + 1, {}, !config_.normals && !config_.normal_error_degrees};
    if (plan_.geometries[index].world_space) limits.locked = borders->locks(draft.quantized);
    draft.packed.lod = find_or_build_lod(draft, limits);
  }
  return std::move(draft.packed);
}

EncodedLod GeometryPacker::find_or_build_lod(Draft& draft, const LodLimits& limits) {
  QuantizedGeometry& geometry = draft.quantized;
  const GeometryClusters& clusters = draft.clusters;
  const LodKey key = store_ ? lod_key(geometry, clusters, limits) : LodKey{};
  if (store_)
    if (std::optional<EncodedLod> found =
            store_->find(key, {draft.packed.record, draft.packed.encoded, geometry.slot_class, limits.max_levels})) {
      ++resumed_;
      progress_.advance(kLodWork * clusters.triangles.size());
      return std::move(*found);
    }
  ClusterLod lod = build_cluster_lod(geometry, clusters, progress_, limits);
  EncodedLod encoded = encode_lod(geometry, lod, limits.coarser_normals);
  // If another geometry failed or the bake was cancelled, inner loops return early with incomplete levels.
  if (store_ && !tbb::is_current_task_group_canceling()) store_->keep(key, encoded);
  return encoded;
}

QuantizedGeometry GeometryPacker::quantize(size_t index, const GeometryNeeds& needs) const {
  GeometryMeasure measure = measure_.geometries[index];
  // The scene's step follows the scene's median edge. Small meshes use that edge if it is longer than their own;
  // otherwise their short edges would loosen the limit on their normals.
  if (plan_.geometries[index].world_space)
    measure.median_edge = std::max(measure.median_edge, measure_.world.median_edge);
  return quantize_geometry(scene_, plan_.geometries[index], needs, config_, grids_[index], measure);
}

GeometryPacker::Draft GeometryPacker::pack_with(size_t index, const GeometryNeeds& needs) const {
  const GeometryPlan& plan = plan_.geometries[index];
  const GeometryMeasure& measure = measure_.geometries[index];
  Draft draft;
  draft.quantized = quantize(index, needs);
  const QuantizedGeometry& q = draft.quantized;
  draft.clusters = split_geometry(q, config_.repeated_clusters);
  draft.packed = {record_of(plan, q, position_error_bound(grids_[index].coarsest_step(), measure.max_abs())),
                  encode_geometry(q, draft.clusters),
                  q.stats,
                  q.slots,
                  needs,
                  {},
                  measure.bounds};
  return draft;
}

} // namespace packtrace
