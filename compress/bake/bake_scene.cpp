#include "compress/bake/bake_scene.h"

#include <algorithm>
#include <functional>
#include <numeric>
#include <optional>

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "compress/bake/bake_totals.h"
#include "compress/bake/geometry_packer.h"
#include "compress/bake/grid/geometry_measure.h"
#include "compress/bake/grid/grid_choice.h"
#include "compress/bake/grid/grid_warnings.h"
#include "compress/bake/grid/scene_measure.h"
#include "compress/bake/lod/shared_borders.h"
#include "compress/bake/plan/geometry_plan.h"
#include "compress/bake/plan/material_runs.h"
#include "compress/bake/proxies/build_proxies.h"
#include "compress/bake/sequence/sequence_baker.h"
#include "compress/bake/write/file_sections.h"
#include "compress/bake/write/lod_store.h"
#include "compress/bake/write/motion_packer.h"
#include "compress/bake/write/requirement_table.h"
#include "compress/format/file/baked_image.h"
#include "compress/format/pages/page_encoder.h"
#include "pbrt_import/base/brief.h"
#include "pbrt_import/base/error.h"
#include "pbrt_import/base/output_file.h"
#include "pbrt_import/scene/motion_pose.h"

namespace packtrace {
namespace {

class Baker {
public:
  Baker(const Scene& scene, const BakeConfig& config, Diagnostics& diagnostics, Progress& progress)
      : scene_(scene), config_(config), diagnostics_(diagnostics), progress_(progress), sequences_(scene, config),
        plan_(plan_scene(scene, sequences_.meshes(), config.level_chains)), grids_(plan_.geometries.size()),
        packed_(plan_.geometries.size()) {}

  BakedScene run() {
    measure();
    choose_grids();
    place_instances();
    encode_textures();
    pack();
    BakedScene result;
    result.bytes = assemble();
    if (config_.proxy.use != ProxyUse::kOff) add_proxies(result.bytes);
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
  std::vector<std::byte> assemble() {
    progress_.begin("assembling the file", 0);
    remove_empty_slots();
    check_level_chains();
    FileSections sections(scene_, textures_);
    if (config_.purpose == baked::kShading) sections.add_shading(scene_);
    reserve(sections);
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
    pack_motion(sections);
    sections.set_material_slots(plan_.material_slots);
    sections.set_requirements(requirements.rows());
    sections.set_deformation(write_deformations(deformations_, plan_.chains));
    if (config_.trees) {
      progress_.begin("building trees", 0);
      sections.build_trees();
    }
    report_.resumed_geometries = packer_->resumed();
    add_up(scene_, plan_, packed_, report_, diagnostics_);
    return sections.assemble(summary(sections));
  }

  void reserve(FileSections& sections) const {
    size_t clusters = 0, bytes = 0;
    const auto count = [&](const EncodedGeometry& encoded) {
      clusters += encoded.clusters.size(), bytes += encoded.payload.size();
    };
    for (const PackedGeometry& packed : packed_) {
      count(packed.encoded);
      for (const EncodedLod::Level& level : packed.lod.levels) count(level.encoded);
    }
    sections.reserve(clusters, bytes);
  }

  /// Builds proxies from the geometries as they are packed.
  void add_proxies(std::vector<std::byte>& bytes) {
    const BakedFile file = BakedFile::borrow_bytes(bytes, "bake result");
    const std::vector<Proxy> proxies = build_proxies(file, config_.proxy, config_.memory, progress_,
                                                     [this](std::string message) { warn(std::move(message)); });
    if (!proxies.empty()) bytes = with_proxies(file, proxies);
  }

  /// Packs the motion of instances and cameras. Bounds of the file are those of what the packed motion does.
  void pack_motion(FileSections& sections) {
    if (scene_.motion.empty()) return;
    std::vector<MovingBox> boxes;
    for (const InstanceMotion& moving : scene_.motion.instances) {
      const baked::InstanceRecord& record = plan_.instances[moving.instance];
      const baked::GeometryRecord& g = sections.geometries()[record.geometry];
      boxes.push_back({Affine(placement_of(record)), box_of(g), g.position_error_bound});
      const Bounds swept = swept_bounds(scene_.motion, moving, boxes.back().placement, boxes.back().box);
      if (constexpr double kFar = 0x1p100; // poses and products of poses stay in the range of floats
          !swept.empty() && !(glm::length(swept.lo) < kFar && glm::length(swept.hi) < kFar))
        throw Error(ErrorKind::kInput, "the motion of " + plan_.geometries[record.geometry].name +
                                           " leaves the float range; bake with --motion off, or move it less");
    }
    PackedMotion packed = packtrace::pack_motion(scene_.motion, boxes, progress_);
    for (size_t i = 0; i < packed.motion.instances.size(); ++i)
      motion_bounds_.extend(swept_bounds(packed.motion, packed.motion.instances[i], boxes[i].placement, boxes[i].box));
    sections.set_rigid_motion(std::move(packed.bytes));
  }

  static Bounds box_of(const baked::GeometryRecord& g) {
    Bounds box;
    if (g.cluster_count == 0) return box;
    box.lo = DVec3(g.bounds_lo[0], g.bounds_lo[1], g.bounds_lo[2]);
    box.hi = DVec3(g.bounds_hi[0], g.bounds_hi[1], g.bounds_hi[2]);
    return box;
  }

  /// Removes slots without triangles from the plan; the packed geometries do not have them.
  void remove_empty_slots() {
    std::vector<std::vector<uint32_t>> left;
    for (PackedGeometry& packed : packed_) left.push_back(std::move(packed.slots));
    remove_material_slots(plan_, left);
  }

  /// All levels of a chain keep triangles of the same materials.
  void check_level_chains() const {
    for (const baked::LevelChainRecord& chain : plan_.chains)
      for (uint32_t level = 0; level < chain.level_count; ++level) {
        const GeometryPlan& plan = plan_.geometries[chain.geometry[level]];
        if (plan.slot_class.empty() || plan.slot_class != plan_.geometries[chain.geometry[0]].slot_class)
          throw Error(ErrorKind::kInput, "levels by distance: " + plan.name +
                                             " has lost all triangles of a material on its position grid; choose a "
                                             "finer precision");
      }
  }

  void measure() {
    progress_.begin("measuring geometry", plan_.geometries.size());
    measure_ = measure_scene(scene_, plan_, progress_);
    sequences_.measure(plan_, measure_, progress_);
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
    if (choice.false_lattices > 0)
      warn(std::to_string(choice.false_lattices) +
           " meshes have positions off the lattice that they state; it is ignored");
    for (std::string& warning : grid_warnings(scene_, measure_, grids_)) warn(std::move(warning));
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
    for (const baked::LevelChainRecord& chain : plan_.chains)
      for (uint32_t level = 0; level < chain.level_count; ++level) ++uses[chain.geometry[level]];
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
    packer_.emplace(scene_, plan_, measure_, grids_, config_, progress_);
    find_shared_borders();
    uint64_t triangles = 0;
    for (size_t i = 0; i < packed_.size(); ++i) triangles += (lod_wanted_[i] != 0 ? 1 + kLodWork : 1) * triangles_of(i);
    progress_.begin(config_.lod == LodUse::kOff ? "packing geometry" : "packing geometry and its levels", triangles);
    tbb::parallel_for(size_t{0}, packed_.size(), [&](size_t i) {
      progress_.check_cancelled();
      packed_[i] = packer_->pack(i, lod_wanted_[i] != 0 ? &shared_borders_ : nullptr);
      progress_.advance(triangles_of(i));
    });
    deformations_ = sequences_.pack(plan_, grids_, packed_, progress_);
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
      finder.add(i, packer_->quantize(world[i], {std::vector<PartNeeds>(plan.parts.size()), {}, {}, true}));
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

  /// World-space bounds of all instances at all times, from the bounds of their geometries.
  Bounds placed_bounds(const FileSections& sections) const {
    Bounds bounds = motion_bounds_;
    for (const baked::InstanceRecord& instance : plan_.instances)
      bounds.extend(placed_box(instance, box_of(sections.geometries()[instance.geometry])));
    return bounds;
  }

  baked::SummaryRecord summary(const FileSections& sections) const {
    baked::SummaryRecord s = summary_of(scene_, config_, report_, placed_bounds(sections), sections.stream_bits());
    if (report_.world_step > 0.0)
      s.world_step_mantissa = world_grid_.mantissa, s.world_step_exponent = world_grid_.exponent;
    return s;
  }

  void warn(std::string message) { packtrace::warn(std::move(message), report_, diagnostics_); }

  const Scene& scene_;
  const BakeConfig& config_;
  Diagnostics& diagnostics_;
  Progress& progress_;
  SequenceBaker sequences_;
  ScenePlan plan_;
  SceneMeasure measure_;
  PositionGrid world_grid_;
  std::vector<GeometryGrid> grids_;
  std::vector<PackedGeometry> packed_;
  std::vector<uint8_t> lod_wanted_; // per geometry
  SharedBorders shared_borders_;
  MemoryReservation memory_{config_.memory};
  std::optional<GeometryPacker> packer_;
  Bounds motion_bounds_; // of moving instances at all times
  std::vector<EncodedDeformation> deformations_;
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
    warn(std::string("levels of an interrupted bake stay: ") + error.what(), report, diagnostics);
  }
}

} // namespace packtrace
