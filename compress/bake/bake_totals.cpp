#include "compress/bake/bake_totals.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "pbrt_import/base/brief.h"

namespace packtrace {
namespace {

/// A bake warns if collapsed triangles exceed this fraction of the source area.
constexpr double kVisibleAreaShare = 1e-3;

/// Factor by which an instance scales areas, |det|^(2/3). Exact for uniform scale, otherwise an estimate.
double area_scale(const baked::InstanceRecord& instance) {
  const auto& m = instance.world_from_object;
  const DVec3 x(m[0], m[1], m[2]), y(m[3], m[4], m[5]), z(m[6], m[7], m[8]);
  return std::pow(std::abs(glm::dot(glm::cross(x, y), z)), 2.0 / 3.0);
}

void add_up_areas(const ScenePlan& plan, std::span<const PackedGeometry> packed, BakeReport& report,
                  Diagnostics& diagnostics) {
  for (const baked::InstanceRecord& instance : plan.instances) {
    const QuantizeStats& stats = packed[instance.geometry].stats;
    const double scale = area_scale(instance);
    report.source_area += scale * stats.source_area;
    report.collapsed_area += scale * stats.collapsed_area;
  }
  if (report.collapsed_area > kVisibleAreaShare * report.source_area)
    warn(std::to_string(report.collapsed_triangles) + " triangles with " +
             brief(100.0 * report.collapsed_area / report.source_area) +
             " % of the area are too small or thin for the grid's step and are left out; a finer precision keeps them",
         report, diagnostics);
  if (report.vanished_geometries > 0)
    warn("nothing is left of " + std::to_string(report.vanished_geometries) +
             " geometries, as all of their triangles are too small or thin for the grid's step",
         report, diagnostics);
}

/// Moving geometry has the normals of its faces.
void warn_of_dropped_normals(const Scene& scene, const ScenePlan& plan, std::span<const PackedGeometry> packed,
                             BakeReport& report, Diagnostics& diagnostics) {
  uint64_t count = 0;
  for (size_t g = 0; g < plan.geometries.size(); ++g) {
    if (!plan.geometries[g].deforms || packed[g].stats.normal_count > 0) continue;
    count += std::ranges::any_of(plan.geometries[g].parts,
                                 [&](const GeometryPart& part) { return !scene.meshes[part.mesh].normals.empty(); });
  }
  if (count > 0)
    warn("the vertex normals of " + std::to_string(count) +
             " geometries that deform are not stored: they are shaded with the normals of their faces",
         report, diagnostics);
}

} // namespace

void warn(std::string message, BakeReport& report, Diagnostics& diagnostics) {
  diagnostics.report(Severity::kWarning, {}, message);
  report.warnings.push_back(std::move(message));
}

void add_up(const Scene& scene, const ScenePlan& plan, std::span<const PackedGeometry> packed, BakeReport& report,
            Diagnostics& diagnostics) {
  QuantizeStats all;
  uint64_t coarse_uvs = 0;
  for (const PackedGeometry& p : packed) {
    const QuantizeStats& s = p.stats;
    report.source_vertices += s.source_vertices;
    report.merged_vertices += s.source_vertices - std::min(s.distinct_vertices, s.source_vertices);
    report.collapsed_triangles += s.collapsed_triangles;
    report.coinciding_triangles += s.coinciding_triangles;
    report.vanished_geometries +=
        s.collapsed_triangles > 0 && std::all_of(s.left.begin(), s.left.end(), [](uint64_t left) { return left == 0; });
    report.max_position_error = std::max(report.max_position_error, s.max_position_error);
    report.max_normal_error_degrees = std::max(report.max_normal_error_degrees, s.max_normal_error_degrees);
    report.max_uv_error = std::max(report.max_uv_error, s.max_uv_error);
    all.position_error_squares += s.position_error_squares;
    all.position_error_count += s.position_error_count;
    all.normal_error_sum += s.normal_error_sum;
    all.normal_count += s.normal_count;
    all.repaired_normals += s.repaired_normals;
    all.replaced_uvs += s.replaced_uvs;
    coarse_uvs += s.max_uv_error_texels > 0.5;
    report.max_uv_error_texels = std::max(report.max_uv_error_texels, s.max_uv_error_texels);
  }
  if (all.position_error_count > 0)
    report.rms_position_error = std::sqrt(all.position_error_squares / static_cast<double>(all.position_error_count));
  report.mean_normal_error_degrees = mean_normal_error(all);
  report.source_triangles = unique_triangle_count(scene);
  report.shared_shapes = plan.shared_shapes;
  report.instanced_shapes = plan.instanced_shapes;
  report.shared_objects = plan.shared_objects;
  report.unused_objects = plan.unused_objects;
  report.unused_triangles = plan.unused_triangles;
  if (all.repaired_normals > 0)
    warn(std::to_string(all.repaired_normals) + " normals have no direction; face normals took their place", report,
         diagnostics);
  if (all.replaced_uvs > 0)
    warn(std::to_string(all.replaced_uvs) + " texture coordinates are not finite; (0, 0) took their place", report,
         diagnostics);
  if (coarse_uvs > 0)
    warn("texture coordinates of " + std::to_string(coarse_uvs) + " geometries are up to " +
             brief(report.max_uv_error_texels) + " texels off; without an encoding of your own they stay within 1/32",
         report, diagnostics);
  add_up_areas(plan, packed, report, diagnostics);
  warn_of_dropped_normals(scene, plan, packed, report, diagnostics);
  if (plan.unused_objects > 0)
    warn(std::to_string(plan.unused_objects) + " objects with " + std::to_string(plan.unused_triangles) +
             " triangles are never instanced and not stored",
         report, diagnostics);
}

baked::SummaryRecord summary_of(const Scene& scene, const BakeConfig& config, const BakeReport& report,
                                const Bounds& bounds, const ClusterView::StreamBits& bits) {
  baked::SummaryRecord s{};
  s.source_triangles = report.source_triangles;
  s.dropped_triangles = scene.dropped_triangles;
  s.unused_triangles = report.unused_triangles;
  s.source_vertices = report.source_vertices;
  s.merged_vertices = report.merged_vertices;
  s.collapsed_triangles = report.collapsed_triangles;
  s.origin = {scene.origin.x, scene.origin.y, scene.origin.z};
  s.bounds_lo = {bounds.lo.x, bounds.lo.y, bounds.lo.z};
  s.bounds_hi = {bounds.hi.x, bounds.hi.y, bounds.hi.z};
  const PrecisionKind kind = config.precision_kind;
  s.precision_kind = static_cast<uint32_t>(kind == PrecisionKind::kPicture ? PrecisionKind::kEdgeFraction : kind);
  s.precision_value = config.precision;
  s.purpose = config.purpose | (uint32_t{config.keep_normals} << (baked::kKeepShift + baked::kNormals)) |
              (uint32_t{config.keep_uvs} << (baked::kKeepShift + baked::kUvs));
  s.left_out = report.left_out;
  s.coinciding_triangles = report.coinciding_triangles;
  s.source_area = report.source_area;
  s.collapsed_area = report.collapsed_area;
  s.stream_bits = {bits.indices, bits.positions, bits.normals, bits.uvs};
  return s;
}

} // namespace packtrace
