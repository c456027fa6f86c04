#include "compress/bake/bake_scene.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <numeric>
#include <optional>

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>

#include "compress/bake/clusters/geometry_encoder.h"
#include "compress/bake/grid/geometry_measure.h"
#include "compress/bake/grid/grid_choice.h"
#include "compress/bake/grid/scene_measure.h"
#include "compress/bake/lod/lod_encoder.h"
#include "compress/bake/lod/shared_borders.h"
#include "compress/bake/plan/geometry_plan.h"
#include "compress/bake/plan/material_runs.h"
#include "compress/bake/write/file_sections.h"
#include "compress/bake/write/lod_store.h"
#include "compress/bake/write/requirement_table.h"
#include "compress/format/file/baked_image.h"
#include "compress/format/layout/bit_stream.h"
#include "compress/format/pages/page_encoder.h"
#include "pbrt_import/base/brief.h"
#include "pbrt_import/base/error.h"
#include "pbrt_import/base/output_file.h"

namespace packtrace {
namespace {

/// Triangles processed to build a geometry's LOD levels, relative to its own number of triangles: each level has half
/// as many as the one below.
constexpr uint64_t kLodWork = 2;

/// A bake warns if collapsed triangles exceed this fraction of the source area.
constexpr double kVisibleAreaShare = 1e-3;

double mean_normal_error(const QuantizeStats& stats) {
  return stats.normal_count > 0 ? stats.normal_error_sum / static_cast<double>(stats.normal_count) : 0.0;
}

/// Factor by which an instance scales areas, |det|^(2/3). Exact for uniform scale, otherwise an estimate.
double area_scale(const baked::InstanceRecord& instance) {
  const auto& m = instance.world_from_object;
  const DVec3 x(m[0], m[1], m[2]), y(m[3], m[4], m[5]), z(m[6], m[7], m[8]);
  return std::pow(std::abs(glm::dot(glm::cross(x, y), z)), 2.0 / 3.0);
}

/// Distance of neighbouring floats at a box's largest coordinate.
double float_spacing(const Bounds& box) {
  if (box.empty()) return 0.0;
  const DVec3 largest = glm::max(glm::abs(box.lo), glm::abs(box.hi));
  const auto furthest = static_cast<float>(std::max({largest.x, largest.y, largest.z}));
  return static_cast<double>(std::nextafter(furthest, HUGE_VALF) - furthest);
}

double stretch_of(const DAffine& map) {
  return std::sqrt(std::max({glm::dot(map[0], map[0]), glm::dot(map[1], map[1]), glm::dot(map[2], map[2])}));
}

/// Largest float_spacing() of a mesh, in world units where it is stretched most.
double largest_mesh_spacing(const Scene& scene) {
  std::vector<double> stretch(scene.meshes.size(), 0.0), of_object(scene.objects.size(), 0.0);
  const auto add = [&](const std::vector<Shape>& shapes, double factor) {
    for (const Shape& shape : shapes)
      stretch[shape.mesh] = std::max(stretch[shape.mesh], factor * stretch_of(shape.parent_from_mesh));
  };
  for (const Instance& instance : scene.instances)
    of_object[instance.object] = std::max(of_object[instance.object], stretch_of(DAffine(instance.world_from_object)));
  add(scene.shapes, 1.0);
  for (size_t i = 0; i < of_object.size(); ++i) add(scene.objects[i].shapes, of_object[i]);
  double largest = 0.0;
  for (size_t i = 0; i < stretch.size(); ++i)
    if (stretch[i] > 0.0) largest = std::max(largest, stretch[i] * float_spacing(bounds_of(scene.meshes[i].positions)));
  return largest;
}

class Baker {
public:
  Baker(const Scene& scene, const BakeConfig& config, Diagnostics& diagnostics, Progress& progress)
      : scene_(scene), config_(config), diagnostics_(diagnostics), progress_(progress), plan_(plan_scene(scene)),
        grids_(plan_.geometries.size()), packed_(plan_.geometries.size()) {}

  BakedScene run() {
    measure();
    choose_grids();
    place_instances();
    encode_textures();
    pack();
    BakedScene result;
    result.bytes = assemble();
    if (config_.codec != PageCodec::kNone) {
      progress_.begin("coding pages", 0);
      result.bytes = encode_paged_file(BakedFile::borrow_bytes(result.bytes, "bake result"), config_.codec);
    }
    // Reads the result back before it leaves the bake, so that a bake never returns a file that the reader rejects.
    const BakedFile file = BakedFile::borrow_bytes(result.bytes, "bake result");
    report_.file = summarize(file);
    measure_seams(file);
    result.report = std::move(report_);
    return result;
  }

private:
  struct Packed {
    baked::GeometryRecord record{};
    EncodedGeometry encoded;
    QuantizeStats stats;
    std::vector<uint32_t> slots; ///< slots of the plan that still have triangles
    GeometryNeeds needs;
    EncodedLod lod;

    size_t bytes() const { return encoded.payload.size() + encoded.clusters.size() * sizeof(baked::ClusterRecord); }
  };

  std::vector<std::byte> assemble() {
    progress_.begin("assembling the file", 0);
    remove_empty_slots();
    FileSections sections(scene_, textures_);
    RequirementTable requirements;
    for (size_t i = 0; i < packed_.size(); ++i) {
      packed_[i].record.requirements = requirements.add(scene_, plan_.geometries[i], packed_[i].needs, packed_[i].stats,
                                                        packed_[i].encoded.stream_bits);
      sections.add_geometry(packed_[i].record, packed_[i].encoded, plan_.geometries[i].name);
      packed_[i].encoded = {};
    }
    for (size_t i = 0; i < packed_.size(); ++i) {
      report_.lod_candidates += lod_wanted_[i] != 0;
      report_.lod_geometries += !packed_[i].lod.levels.empty();
      sections.add_lod(static_cast<uint32_t>(i), packed_[i].lod);
      packed_[i].lod = {};
    }
    sections.set_instances(plan_.instances);
    sections.set_material_slots(plan_.material_slots);
    sections.set_requirements(requirements.rows());
    if (config_.trees) {
      progress_.begin("building trees", 0);
      sections.build_trees();
    }
    add_up();
    return sections.assemble(summary(sections));
  }

  /// Removes slots without triangles from the plan; the packed geometries do not have them.
  void remove_empty_slots() {
    std::vector<std::vector<uint32_t>> left;
    for (Packed& packed : packed_) left.push_back(std::move(packed.slots));
    remove_material_slots(plan_, left);
  }

  void measure() {
    progress_.begin("measuring geometry", plan_.geometries.size());
    measure_ = measure_scene(scene_, plan_, progress_);
  }

  void choose_grids() {
    GridChoice choice = packtrace::choose_grids(scene_, plan_, measure_, config_, progress_);
    grids_ = std::move(choice.grids);
    report_.nested_geometries = choice.nested_geometries;
    report_.finer_geometries = choice.finer_geometries;
    for (const Shortfall& s : choice.shortfalls)
      report_.promise.push_back({plan_.geometries[s.geometry].name, std::string(name_of(s.bound)), s.wanted, s.step,
                                 world_scale(plan_.geometries[s.geometry]), s.float_limit});
    if (measure_.has_world_space) {
      world_grid_ = choice.world;
      report_.world_step = world_grid_.step();
      report_.world_median_edge = measure_.world.median_edge;
    }
    uint64_t coarse = 0, far = 0;
    for (size_t i = 0; i < grids_.size(); ++i) {
      const GeometryMeasure& measure = measure_.geometries[i];
      if (measure.bounds.empty()) continue;
      const double step = grids_[i].grid.step();
      coarse += measure.median_edge > 0.0 && step > measure.median_edge * kRoughEdge;
      far += measure.float_step() > step;
    }
    if (coarse > 0)
      warn(std::to_string(coarse) + " of " + std::to_string(grids_.size()) +
           " geometries have a step above an eighth of their median edge; surfaces will look rough");
    if (far > 0)
      warn(std::to_string(far) + " of " + std::to_string(grids_.size()) +
           " geometries lie so far from the origin that float positions are coarser than the step of their grid");
    warn_of_coarse_floats();
  }

  /// Positions that are hit are floats in world space, for every backend, and so are those of meshes in their own
  /// space.
  void warn_of_coarse_floats() {
    constexpr double kMaxSpacing = 1.0 / 512.0; // of the scene's diagonal; pictures are right to 0.002 AO at half of it
    const Bounds world = world_bounds(scene_);
    if (world.empty()) return;
    const double spacing = std::max(float_spacing(world), largest_mesh_spacing(scene_)), diagonal = world.diagonal();
    if (diagonal > 0.0 && spacing > kMaxSpacing * diagonal)
      warn("the scene lies so far from the origin that floats are " + brief(spacing) + " apart there, " +
           brief(100.0 * spacing / diagonal) + " % of its diagonal; move it closer, or pictures will be wrong");
  }

  /// Leaves out instances that exceed the float range.
  void place_instances() {
    std::vector<uint32_t> uses(plan_.geometries.size());
    for (baked::InstanceRecord& instance : plan_.instances) {
      if (instance.geometry == baked::kNone) continue;
      const uint32_t geometry = instance.geometry;
      if (const Bounds box = placed_box(instance, measure_.geometries[geometry].bounds);
          !box.empty() && !within_float_range(box)) {
        plan_.left_out.push_back(beyond_float_range("an instance of " + plan_.geometries[geometry].name, box));
        instance.geometry = baked::kNone;
        continue;
      }
      ++uses[geometry];
    }
    report_left_out(uses);
  }

  /// Finds instances that touch geometry on another grid and warns of the gaps that may open there.
  void measure_seams(const BakedFile& file) {
    report_.seams = InstanceSeams(file).summary();
    const SeamSummary& seams = report_.seams;
    if (seams.touching > 0)
      warn("instanced geometry keeps a grid of its own: the boxes of " + std::to_string(seams.touching) + " of " +
           std::to_string(seams.instances) + " instances touch other geometry, where seams may gape by up to " +
           brief(seams.largest_gap) + ", half a step of both grids" +
           (report_.lod_geometries > 0 ? ", and in coarser levels by the errors of both" : ""));
  }

  /// Points left-out instances at an empty geometry, and empties geometries that no instance uses any more.
  void report_left_out(const std::vector<uint32_t>& uses) {
    report_.left_out = plan_.left_out.size();
    if (report_.left_out == 0) return;
    if (config_.strict) throw Error(ErrorKind::kInput, plan_.left_out.front());
    for (const std::string& what : plan_.left_out) diagnostics_.report(Severity::kError, {}, what + "; it is left out");
    for (size_t i = 0; i < uses.size(); ++i)
      if (uses[i] == 0) {
        plan_.geometries[i] = {plan_.geometries[i].name, {}, {}, {}, plan_.geometries[i].world_space, 1.0};
        measure_.geometries[i] = {};
      }
    const auto empty = static_cast<uint32_t>(plan_.geometries.size());
    plan_.geometries.push_back({"left out", {}, {}, {}, false, 1.0});
    measure_.geometries.emplace_back(), grids_.emplace_back(), packed_.emplace_back();
    for (baked::InstanceRecord& instance : plan_.instances)
      if (instance.geometry == baked::kNone) instance = {{1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, empty, 0};
  }

  void encode_textures() {
    if (!config_.textures) return;
    progress_.begin("encoding textures", scene_.textures.size());
    textures_.resize(scene_.textures.size());
    for (const AlbedoTexture& texture : scene_.textures)
      if (texture.width == 0 || texture.height == 0 ||
          texture.rgb.size() != uint64_t{3} * texture.width * texture.height)
        throw Error(ErrorKind::kInput, "invalid scene: the size of texture " + texture.name);
    tbb::parallel_for(size_t{0}, textures_.size(), [&](size_t i) {
      progress_.check_cancelled();
      textures_[i] = encode_texture(scene_.textures[i], config_.texture_codec, config_.min_texture_psnr_db);
      progress_.advance();
    });
  }

  void pack() {
    lod_wanted_ = choose_lod();
    reserve_memory();
    find_shared_borders();
    if (!config_.resume.empty()) store_.emplace(config_.resume);
    uint64_t triangles = 0;
    for (size_t i = 0; i < packed_.size(); ++i) triangles += (lod_wanted_[i] != 0 ? 1 + kLodWork : 1) * triangles_of(i);
    progress_.begin(config_.lod == LodUse::kOff ? "packing geometry" : "packing geometry and its levels", triangles);
    tbb::parallel_for(size_t{0}, packed_.size(), [&](size_t i) {
      progress_.check_cancelled();
      packed_[i] = pack_one(i);
      progress_.advance(triangles_of(i));
    });
  }

  /// Finds the borders where world-space geometries touch. All LOD levels must keep these borders unchanged.
  void find_shared_borders() {
    std::vector<size_t> world;
    bool wanted = false;
    for (size_t i = 0; i < packed_.size(); ++i)
      if (plan_.geometries[i].world_space && !plan_.geometries[i].parts.empty())
        world.push_back(i), wanted |= lod_wanted_[i] != 0;
    if (!wanted || world.size() < 2) return;
    progress_.begin("finding shared borders", world.size());
    SharedBorderFinder finder(world.size());
    tbb::parallel_for(size_t{0}, world.size(), [&](size_t i) {
      progress_.check_cancelled();
      const GeometryPlan& plan = plan_.geometries[world[i]];
      finder.add(i, quantize(world[i], {std::vector<PartNeeds>(plan.parts.size()), {}, {}, true}));
      progress_.advance();
    });
    shared_borders_ = finder.finish();
  }

  /// Reserves memory before anything large is allocated: for all packed geometries and the trees and file made of them,
  /// and for the working sets of the largest geometries, one per thread. Bytes per triangle were measured on large
  /// meshes and rounded up.
  void reserve_memory() {
    constexpr uint64_t kPackedBytes = 48, kWorkingBytes = 144, kLodWorkingBytes = 192; // per triangle
    uint64_t triangles = 0;
    std::vector<uint64_t> working;
    for (size_t i = 0; i < packed_.size(); ++i) {
      triangles += (lod_wanted_[i] != 0 ? 2 : 1) * triangles_of(i);
      working.push_back(triangles_of(i) * (lod_wanted_[i] != 0 ? kLodWorkingBytes : kWorkingBytes));
    }
    const auto threads = static_cast<size_t>(tbb::this_task_arena::max_concurrency());
    const auto largest = working.begin() + static_cast<std::ptrdiff_t>(std::min(threads, working.size()));
    std::partial_sort(working.begin(), largest, working.end(), std::greater<>());
    const uint64_t bytes = std::accumulate(working.begin(), largest, triangles * kPackedBytes);
    memory_.resize(bytes, "packing " + std::to_string(unique_triangle_count(scene_)) + " triangles");
  }

  uint64_t triangles_of(size_t geometry) const {
    uint64_t triangles = 0;
    for (const GeometryPart& part : plan_.geometries[geometry].parts)
      triangles += scene_.meshes[part.mesh].triangles.size();
    return triangles;
  }

  /// Returns, per geometry, whether it gets LOD levels.
  std::vector<uint8_t> choose_lod() const {
    std::vector<uint8_t> wanted(packed_.size());
    if (config_.lod == LodUse::kOff) return wanted;
    std::vector<uint32_t> uses(packed_.size());
    for (const baked::InstanceRecord& instance : plan_.instances) ++uses[instance.geometry];
    for (size_t i = 0; i < wanted.size(); ++i)
      wanted[i] = (config_.lod == LodUse::kAll || uses[i] > 1) && triangles_of(i) >= config_.lod_min_triangles;
    return wanted;
  }

  /// A geometry as quantised, as clusters and as packed.
  struct Draft {
    QuantizedGeometry quantized;
    GeometryClusters clusters;
    Packed packed;
  };

  Packed pack_one(size_t index) {
    GeometryNeeds needs = analyse_requirements(scene_, plan_, plan_.geometries[index], config_);
    Draft draft = pack_with(index, needs);
    // Flat triangles need clusters of their own. If only some triangles are flat, those clusters may cost more than the
    // normals they save, so try both.
    const bool mixed = draft.packed.stats.flat_triangles > 0 && draft.packed.encoded.stream_bits.normals > 0;
    needs.infer_normals = false;
    if (mixed)
      if (Draft other = pack_with(index, needs); other.packed.bytes() < draft.packed.bytes()) draft = std::move(other);
    if (lod_wanted_[index] != 0 && draft.quantized.triangles.size() >= config_.lod_min_triangles) {
      LodLimits limits{config_.lod_levels + 1, {}};
      if (plan_.geometries[index].world_space) limits.locked = shared_borders_.locks(draft.quantized);
      draft.packed.lod = find_or_build_lod(draft, limits);
    }
    return std::move(draft.packed);
  }

  /// @param draft its quantised geometry is consumed
  EncodedLod find_or_build_lod(Draft& draft, const LodLimits& limits) {
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
    EncodedLod encoded = encode_lod(geometry, lod);
    // If another geometry failed or the bake was cancelled, inner loops return early with incomplete levels.
    if (store_ && !tbb::is_current_task_group_canceling()) store_->keep(key, encoded);
    return encoded;
  }

  QuantizedGeometry quantize(size_t index, const GeometryNeeds& needs) const {
    GeometryMeasure measure = measure_.geometries[index];
    // The scene's step follows the scene's median edge. Small meshes use that edge if it is longer than their own;
    // otherwise their short edges would loosen the limit on their normals.
    if (plan_.geometries[index].world_space)
      measure.median_edge = std::max(measure.median_edge, measure_.world.median_edge);
    return quantize_geometry(scene_, plan_.geometries[index], needs, config_, grids_[index], measure);
  }

  Draft pack_with(size_t index, const GeometryNeeds& needs) const {
    const GeometryPlan& plan = plan_.geometries[index];
    const GeometryMeasure& measure = measure_.geometries[index];
    Draft draft;
    draft.quantized = quantize(index, needs);
    const QuantizedGeometry& q = draft.quantized;
    draft.clusters = split_geometry(q);
    draft.packed = {record_of(plan, q, position_error_bound(grids_[index].coarsest_step(), measure.max_abs())),
                    encode_geometry(q, draft.clusters),
                    q.stats,
                    q.slots,
                    needs,
                    {}};
    return draft;
  }

  static baked::GeometryRecord record_of(const GeometryPlan& plan, const QuantizedGeometry& q, double error_bound) {
    baked::GeometryRecord record{};
    record.origin = q.origin;
    record.max_position_error = q.stats.max_position_error;
    record.position_error_bound = error_bound;
    record.step_mantissa = q.grid.mantissa;
    record.step_exponent = q.grid.exponent;
    record.anchor_shift = q.anchor_shift;
    record.uv_exponent = q.uv_exponent;
    record.uv_encoding = static_cast<uint32_t>(q.uv_encoding);
    record.normal_encoding = static_cast<uint32_t>(q.normal_encoding);
    record.max_normal_error_degrees = static_cast<float>(q.stats.max_normal_error_degrees);
    record.mean_normal_error_degrees = static_cast<float>(mean_normal_error(q.stats));
    record.max_uv_error = static_cast<float>(q.stats.max_uv_error);
    record.flags = plan.world_space ? baked::kWorldSpace : 0;
    record.slot_count = static_cast<uint32_t>(q.slot_class.size());
    return record;
  }

  /// World-space bounds of all instances, from the bounds of their geometries.
  Bounds placed_bounds(const FileSections& sections) const {
    Bounds bounds;
    for (const baked::InstanceRecord& instance : plan_.instances) {
      const baked::GeometryRecord& g = sections.geometries()[instance.geometry];
      if (g.cluster_count == 0) continue;
      Bounds box;
      box.lo = DVec3(g.bounds_lo[0], g.bounds_lo[1], g.bounds_lo[2]);
      box.hi = DVec3(g.bounds_hi[0], g.bounds_hi[1], g.bounds_hi[2]);
      bounds.extend(placed_box(instance, box));
    }
    return bounds;
  }

  /// Fills in the report's totals over the scene.
  void add_up() {
    QuantizeStats all;
    uint64_t coarse_uvs = 0;
    for (const Packed& p : packed_) {
      const QuantizeStats& s = p.stats;
      report_.source_vertices += s.source_vertices;
      report_.merged_vertices += s.source_vertices - std::min(s.distinct_vertices, s.source_vertices);
      report_.collapsed_triangles += s.collapsed_triangles;
      report_.coinciding_triangles += s.coinciding_triangles;
      report_.vanished_geometries += s.collapsed_triangles > 0 &&
                                     std::all_of(s.left.begin(), s.left.end(), [](uint64_t left) { return left == 0; });
      report_.max_position_error = std::max(report_.max_position_error, s.max_position_error);
      report_.max_normal_error_degrees = std::max(report_.max_normal_error_degrees, s.max_normal_error_degrees);
      report_.max_uv_error = std::max(report_.max_uv_error, s.max_uv_error);
      all.position_error_squares += s.position_error_squares;
      all.position_error_count += s.position_error_count;
      all.normal_error_sum += s.normal_error_sum;
      all.normal_count += s.normal_count;
      all.repaired_normals += s.repaired_normals;
      all.replaced_uvs += s.replaced_uvs;
      coarse_uvs += s.max_uv_error_texels > 0.5;
      report_.max_uv_error_texels = std::max(report_.max_uv_error_texels, s.max_uv_error_texels);
    }
    if (all.position_error_count > 0)
      report_.rms_position_error =
          std::sqrt(all.position_error_squares / static_cast<double>(all.position_error_count));
    report_.mean_normal_error_degrees = mean_normal_error(all);
    report_.source_triangles = unique_triangle_count(scene_);
    report_.resumed_geometries = resumed_;
    report_.shared_shapes = plan_.shared_shapes;
    report_.instanced_shapes = plan_.instanced_shapes;
    report_.shared_objects = plan_.shared_objects;
    report_.unused_objects = plan_.unused_objects;
    report_.unused_triangles = plan_.unused_triangles;
    if (all.repaired_normals > 0)
      warn(std::to_string(all.repaired_normals) + " normals have no direction; face normals took their place");
    if (all.replaced_uvs > 0)
      warn(std::to_string(all.replaced_uvs) + " texture coordinates are not finite; (0, 0) took their place");
    if (coarse_uvs > 0)
      warn("texture coordinates of " + std::to_string(coarse_uvs) + " geometries are up to " +
           brief(report_.max_uv_error_texels) + " texels off; without an encoding of your own they stay within 1/32");
    add_up_areas();
    if (plan_.unused_objects > 0)
      warn(std::to_string(plan_.unused_objects) + " objects with " + std::to_string(plan_.unused_triangles) +
           " triangles are never instanced and not stored");
  }

  void add_up_areas() {
    for (const baked::InstanceRecord& instance : plan_.instances) {
      const QuantizeStats& stats = packed_[instance.geometry].stats;
      const double scale = area_scale(instance);
      report_.source_area += scale * stats.source_area;
      report_.collapsed_area += scale * stats.collapsed_area;
    }
    if (report_.collapsed_area > kVisibleAreaShare * report_.source_area)
      warn(std::to_string(report_.collapsed_triangles) + " triangles with " +
           brief(100.0 * report_.collapsed_area / report_.source_area) +
           " % of the area are too small or thin for the grid's step and are left out; a finer precision keeps them");
    if (report_.vanished_geometries > 0)
      warn("nothing is left of " + std::to_string(report_.vanished_geometries) +
           " geometries, as all of their triangles are too small or thin for the grid's step");
  }

  baked::SummaryRecord summary(const FileSections& sections) const {
    baked::SummaryRecord s{};
    s.source_triangles = report_.source_triangles;
    s.dropped_triangles = scene_.dropped_triangles;
    s.unused_triangles = report_.unused_triangles;
    s.source_vertices = report_.source_vertices;
    s.merged_vertices = report_.merged_vertices;
    s.collapsed_triangles = report_.collapsed_triangles;
    const Bounds bounds = placed_bounds(sections);
    s.origin = {scene_.origin.x, scene_.origin.y, scene_.origin.z};
    s.bounds_lo = {bounds.lo.x, bounds.lo.y, bounds.lo.z};
    s.bounds_hi = {bounds.hi.x, bounds.hi.y, bounds.hi.z};
    const PrecisionKind kind = config_.precision_kind;
    s.precision_kind = static_cast<uint32_t>(kind == PrecisionKind::kPicture ? PrecisionKind::kEdgeFraction : kind);
    s.precision_value = config_.precision;
    s.purpose = config_.purpose | (uint32_t{config_.keep_normals} << (baked::kKeepShift + baked::kNormals)) |
                (uint32_t{config_.keep_uvs} << (baked::kKeepShift + baked::kUvs));
    if (report_.world_step > 0.0)
      s.world_step_mantissa = world_grid_.mantissa, s.world_step_exponent = world_grid_.exponent;
    const ClusterView::StreamBits& bits = sections.stream_bits();
    s.left_out = report_.left_out;
    s.coinciding_triangles = report_.coinciding_triangles;
    s.source_area = report_.source_area;
    s.collapsed_area = report_.collapsed_area;
    s.stream_bits = {bits.indices, bits.positions, bits.normals, bits.uvs};
    return s;
  }

  void warn(std::string message) {
    diagnostics_.report(Severity::kWarning, {}, message);
    report_.warnings.push_back(std::move(message));
  }

  const Scene& scene_;
  const BakeConfig& config_;
  Diagnostics& diagnostics_;
  Progress& progress_;
  ScenePlan plan_;
  SceneMeasure measure_;
  PositionGrid world_grid_;
  std::vector<GeometryGrid> grids_;
  std::vector<Packed> packed_;
  std::vector<uint8_t> lod_wanted_; // per geometry
  SharedBorders shared_borders_;
  MemoryReservation memory_{config_.memory};
  std::optional<LodStore> store_;
  std::atomic<uint64_t> resumed_{0};
  std::vector<EncodedTexture> textures_; // in the scene's order; empty if textures are not stored
  BakeReport report_;
};

} // namespace

BakedScene bake_to_bytes(const Scene& scene, const BakeConfig& config, Diagnostics& diagnostics, Progress& progress) {
  config.validate();
  return Baker(scene, config, diagnostics, progress).run();
}

BakeReport bake_scene(const Scene& scene, const BakeConfig& config, const std::filesystem::path& output, bool force,
                      Diagnostics& diagnostics, Progress& progress) {
  config.validate();
  OutputFile file(output, force);
  BakedScene baked = bake_to_bytes(scene, config, diagnostics, progress);
  progress.begin("writing the file", 0);
  file.write(baked.bytes);
  file.commit();
  forget_resumed_levels(config, baked.report, diagnostics);
  return std::move(baked.report);
}

void forget_resumed_levels(const BakeConfig& config, BakeReport& report, Diagnostics& diagnostics) {
  if (config.resume.empty()) return;
  try {
    LodStore(config.resume).clear();
  } catch (const Error& error) {
    report.warnings.push_back(std::string("levels of an interrupted bake stay: ") + error.what());
    diagnostics.report(Severity::kWarning, {}, report.warnings.back());
  }
}

} // namespace packtrace
