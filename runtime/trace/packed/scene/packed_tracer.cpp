#include "runtime/trace/packed/scene/packed_tracer.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "compress/format/cluster/position_grid.h"
#include "compress/format/trees/box_tree.h"
#include "pbrt_import/base/error.h"
#include "pbrt_import/scene/bounds.h"
#include "runtime/trace/packed/scene/deformed_trees.h"
#include "runtime/trace/packed/scene/thread_memory.h"
#include "runtime/trace/packed/scene/top_tree.h"
#include "runtime/trace/packed/scene/trace_cluster.h"
#include "runtime/trace/placement.h"
#include "runtime/trace/source/alpha_filter.h"

namespace packtrace {
namespace {

static_assert(sizeof(Ray) == sizeof(packed::KernelRay) && offsetof(Ray, tfar) == offsetof(packed::KernelRay, tfar) &&
              offsetof(Ray, origin) == offsetof(packed::KernelRay, origin) &&
              offsetof(Ray, tnear) == offsetof(packed::KernelRay, tnear) &&
              offsetof(Ray, direction) == offsetof(packed::KernelRay, direction));
static_assert(sizeof(RayHit) == sizeof(packed::KernelHit) && offsetof(RayHit, t) == offsetof(packed::KernelHit, t) &&
              offsetof(RayHit, u) == offsetof(packed::KernelHit, u) &&
              offsetof(RayHit, v) == offsetof(packed::KernelHit, v) &&
              offsetof(RayHit, placement) == offsetof(packed::KernelHit, placement) &&
              offsetof(RayHit, part) == offsetof(packed::KernelHit, cluster) &&
              offsetof(RayHit, triangle) == offsetof(packed::KernelHit, triangle));
static_assert(baked::kVisibleToCamera == kCameraRays && baked::kVisibleToOcclusion == kOcclusionRays);

const packed::KernelRay* kernel_rays(std::span<const Ray> rays) {
  return reinterpret_cast<const packed::KernelRay*>(rays.data());
}
packed::KernelHit* kernel_hits(std::span<RayHit> hits) { return reinterpret_cast<packed::KernelHit*>(hits.data()); }

DAffine outer_from_grid(const baked::TreeRecord& tree) {
  const double step = PositionGrid{tree.step_mantissa, tree.step_exponent}.step();
  const DVec3 origin(static_cast<double>(tree.origin[0]), static_cast<double>(tree.origin[1]),
                     static_cast<double>(tree.origin[2]));
  return DAffine(DVec3(step, 0, 0), DVec3(0, step, 0), DVec3(0, 0, step), origin * step);
}

/// Whether the transform only scales along the axes and translates.
bool is_aligned(const DAffine& m) {
  return m[0].y == 0.0 && m[0].z == 0.0 && m[1].x == 0.0 && m[1].z == 0.0 && m[2].x == 0.0 && m[2].y == 0.0;
}

/// Maximum number of placements for which rays are tested against the boxes of parts (KernelScene::parts).
constexpr size_t kMaxPlacementsWithParts = baked::kNodeWidth;

/// Enlarges a box of the tree over many placements by the rounding errors of its planes: see
/// packed::KernelScene::top_pad_coordinate.
TreeBox grown(TreeBox box) {
  constexpr float kGrowth = 0x1p-20f;
  for (size_t axis = 0; axis < 3; ++axis) {
    box.lo[axis] = std::nextafter(box.lo[axis] - kGrowth * std::abs(box.lo[axis]), -INFINITY);
    box.hi[axis] = std::nextafter(box.hi[axis] + kGrowth * std::abs(box.hi[axis]), INFINITY);
  }
  return box;
}

/// Describes the tree over placements as a tree placed in unit space.
/// @param max_coordinate largest coordinate, in unit space, of the grids of aligned placements
void place_top(std::span<const TreeBox> boxes, float max_coordinate, packed::KernelScene& scene) {
  TreeBox all = boxes[0];
  for (const TreeBox& box : boxes) all.extend(box);
  scene.top = {};
  scene.top.aligned = 1;
  const bool parts = boxes.size() <= kMaxPlacementsWithParts; // boxes are not enlarged then
  scene.top_max_coordinate = max_coordinate;
  for (size_t axis = 0; axis < 3; ++axis) {
    scene.top.grid_from_unit[3 * axis + axis] = 1.0;
    scene.top.box_lo[axis] = all.lo[axis], scene.top.box_hi[axis] = all.hi[axis];
    scene.top_max_coordinate = std::max({scene.top_max_coordinate, std::abs(all.lo[axis]), std::abs(all.hi[axis])});
  }
  scene.top_pad_coordinate = (parts ? 1.0f : packed::kMinTopPad) * scene.top_max_coordinate;
}

} // namespace

struct PackedTracer::Tables : TracedTrees {
  DeformedTrees deformed;
  std::vector<packed::TracePlacement> placements;
  std::vector<TreeBox> boxes;           ///< by placement: its box in unit space, not grown()
  std::vector<uint32_t> instance_of;    ///< by placement; baked::kNone for the world tree
  std::vector<uint32_t> first_instance; ///< by the file's geometry; a LOD level has that of its base geometry
  std::vector<Placement> surfaces;      ///< by instance
  std::vector<packed::TopNode> top;
  std::vector<packed::TopNode> parts; ///< by placement; used if there are at most kMaxPlacementsWithParts
  packed::KernelScene scene{};
  uint32_t stream_depth = 0; ///< depth of top if rays traverse it as streams, else 0
  ThreadMemoryOwner memory;

  packed::ThreadMemory& of_this_thread() const { return memory.of_this_thread(stream_depth); }
};

PackedTracer::PackedTracer(const BakedFile& file, const SceneSource& source, PackedIsa isa)
    : PackedTracer(file, source, nullptr, {}, {}, isa) {}

PackedTracer::PackedTracer(const BakedFile& file, const LodSource& source, PackedIsa isa)
    : PackedTracer(file, source, &source, {}, {}, isa) {}

PackedTracer::PackedTracer(const BakedFile& file, const SceneSource& source,
                           std::span<const DeformingGeometry> deforming, const DeformConfig& config, PackedIsa isa)
    : PackedTracer(file, source, nullptr, deforming, config, isa) {}

PackedTracer::PackedTracer(const BakedFile& file, const SceneSource& source, const LodSource* lod,
                           std::span<const DeformingGeometry> deforming, const DeformConfig& config, PackedIsa isa)
    : file_(file), source_(source), lod_(lod), kernels_(kernels_of(isa)), tables_(std::make_unique<Tables>()) {
  Tables& t = *tables_;
  static_cast<TracedTrees&>(t) = lod != nullptr ? chosen_trees(file, *lod, lod_trees_) : whole_trees(file);
  t.deformed = DeformedTrees(file, deforming, config, t);
  find_first_instances();
  place();
  t.hulls = {};
  t.scene.clusters = t.clusters.data();
  t.scene.trees = t.trees.data();
  t.scene.placements = t.placements.data();
  t.scene.placement_count = static_cast<uint32_t>(t.placements.size());
  build_top();
  t.scene.owner = this;
  t.scene.decode_wide = [](const void* owner, uint32_t cluster, uint32_t first, uint32_t count,
                           packed::DecodedBatch& out) {
    const auto& tracer = *static_cast<const PackedTracer*>(owner);
    const uint32_t g = tracer.geometry_of_cluster(cluster);
    const baked::GeometryRecord& geometry = tracer.file_.geometries()[g];
    return decode_batch_exactly(tracer.tables_->records[tracer.tables_->grid_of[g]], geometry,
                                tracer.file_.cluster(g, static_cast<uint32_t>(cluster - geometry.first_cluster)), first,
                                count, out);
  };
  t.scene.present = [](const void* owner, uint32_t placement, uint32_t cluster, uint32_t triangle, float u, float v,
                       uint32_t ray_class) {
    const auto& tracer = *static_cast<const PackedTracer*>(owner);
    const uint32_t instance = tracer.instance_of(placement, cluster);
    return surface_present(tracer.source_, instance, tracer.triangle_of(cluster, instance, triangle), Vec2(u, v),
                           ray_class == kOcclusionRays);
  };
}

PackedTracer::~PackedTracer() = default;

/// Builds the tree over placements from their boxes.
void PackedTracer::build_top() {
  Tables& t = *tables_;
  if (t.placements.size() < 2) return;
  float aligned_max_coordinate = 0.0f; // in unit space, of the grids of aligned placements
  for (const packed::TracePlacement& placement : t.placements)
    if (placement.aligned != 0)
      for (size_t axis = 0; axis < 3; ++axis)
        aligned_max_coordinate =
            std::max(aligned_max_coordinate, static_cast<float>(t.trees[placement.tree].max_coordinate /
                                                                std::abs(placement.grid_from_unit[3 * axis + axis])));
  const bool parts = t.placements.size() <= kMaxPlacementsWithParts;
  std::vector<TreeBox> boxes = t.boxes;
  if (!parts) std::ranges::transform(boxes, boxes.begin(), grown);
  t.top = build_top_tree(boxes);
  t.scene.top_nodes = t.top.data();
  t.stream_depth = t.top.size() > 1 ? top_tree_depth(t.top) : 0;
  if (parts) t.scene.parts = t.parts.data();
  place_top(boxes, aligned_max_coordinate, t.scene);
}

void PackedTracer::find_first_instances() {
  Tables& t = *tables_;
  const std::span<const baked::InstanceRecord> instances = file_.instances();
  t.first_instance.assign(file_.geometries().size(), baked::kNone);
  for (uint32_t i = static_cast<uint32_t>(instances.size()); i-- > 0;) t.first_instance[instances[i].geometry] = i;
  for (const baked::LodLevelRecord& level : file_.sections().lod_levels)
    t.first_instance[level.geometry] = t.first_instance[level.base];
}

/// Bounds of a geometry in object space; empty if it has no triangles.
Bounds PackedTracer::bounds_of(uint32_t geometry) const {
  if (lod_ != nullptr) return lod_->bounds(geometry);
  if (const DeformedTree* tree = tables_->deformed.find(geometry)) return tree->object_bounds();
  return object_bounds(file_.geometries()[geometry]);
}

/// The instance that a cluster of a placement belongs to.
uint32_t PackedTracer::instance_of(uint32_t placement, uint32_t cluster) const {
  const uint32_t placed = tables_->instance_of[placement];
  return placed != baked::kNone ? placed : tables_->first_instance[geometry_of_cluster(cluster)];
}

/// The source's number of a cluster's triangle.
uint32_t PackedTracer::triangle_of(uint32_t cluster, uint32_t instance, uint32_t triangle) const {
  if (lod_ != nullptr) return lod_->triangle_number(lod_->instances()[instance].geometry, cluster, triangle);
  return file_.sections().clusters[cluster].first_triangle + triangle;
}

void PackedTracer::place() {
  Tables& t = *tables_;
  const std::span<const PlacedGeometry> instances = source_.instances();
  std::vector<Bounds> bounds;
  for (uint32_t g = 0; g < source_.geometry_count(); ++g) bounds.push_back(bounds_of(g));
  space_ = UnitSpace(placed_bounds(source_, bounds));

  t.surfaces.resize(instances.size());
  bool world_placed = false;
  for (uint32_t i = 0; i < instances.size(); ++i) {
    const uint32_t tree = t.tree_of[instances[i].geometry];
    if (tree == baked::kNone) continue;
    const DAffine world_from_object(instances[i].world_from_object);
    const std::optional<DAffine> unit_from_grid = invertible_placement(
        compose(compose(space_.unit_from_outer(), world_from_object), outer_from_grid(t.records[tree])));
    if (!unit_from_grid) {
      flat_instances_.push_back(i);
      continue;
    }
    t.surfaces[i] = instanced_placement(i, world_from_object, *unit_from_grid);
    // Rays are transformed in doubles and rounded once, in the grid.
    t.surfaces[i].moved_linear = glm::dmat3(0.0);
    t.surfaces[i].moved_offset = DVec3(0.0);
    const bool in_world = t.records[tree].geometry == baked::kWorldTree;
    if (in_world && world_placed) continue;
    world_placed |= in_world;
    add_placement(tree, in_world ? baked::kNone : i, *unit_from_grid);
  }
}

/// @param instance baked::kNone for the world tree
void PackedTracer::add_placement(uint32_t tree, uint32_t instance, const DAffine& unit_from_grid) {
  Tables& t = *tables_;
  if (t.records[tree].node_count == 0) return;
  const DAffine grid_from_unit = inverse(unit_from_grid);
  packed::TracePlacement placement{};
  for (int column = 0; column < 4; ++column)
    for (int axis = 0; axis < 3; ++axis) placement.grid_from_unit[3 * column + axis] = grid_from_unit[column][axis];
  placement.tree = tree;
  placement.aligned = is_aligned(grid_from_unit) ? 1 : 0;
  placement.ray_classes = t.trees[tree].nodes[0].ray_classes;
  t.boxes.emplace_back();
  if (t.parts.size() < kMaxPlacementsWithParts) t.parts.emplace_back();
  t.placements.push_back(placement);
  t.instance_of.push_back(instance);
  fit_placement(t.placements.size() - 1, *t.hulls[tree], unit_from_grid);
}

/// Sets the boxes of a placement.
void PackedTracer::fit_placement(size_t number, const TreeHull& hull, const DAffine& unit_from_grid) {
  Tables& t = *tables_;
  packed::TracePlacement& placement = t.placements[number];
  for (int axis = 0; axis < 3; ++axis)
    placement.box_lo[axis] = hull.lo()[axis], placement.box_hi[axis] = hull.hi()[axis];
  t.boxes[number] = hull.placed(unit_from_grid);
  if (number < t.parts.size()) t.parts[number] = top_node(hull.placed_parts(unit_from_grid, placement.aligned != 0));
}

void PackedTracer::deform(std::span<const DeformedFrame> frames, std::span<DeformStep> steps) {
  assert(steps.size() == frames.size());
  Tables& t = *tables_;
  for (size_t i = 0; i < frames.size(); ++i) {
    steps[i] = t.deformed.update(frames[i], t);
    const uint32_t tree = t.tree_of[frames[i].geometry];
    if (t.records[tree].node_count == 0) continue;
    const TreeHull hull(t.trees[tree].nodes);
    for (size_t p = 0; p < t.placements.size(); ++p)
      if (t.placements[p].tree == tree) fit_placement(p, hull, t.surfaces[t.instance_of[p]].unit_from_surface);
  }
  build_top();
  t.memory.forget_batches();
}

DeformStep PackedTracer::deform(uint32_t geometry, const FrameVertices& frame) {
  const DeformedFrame one{geometry, &frame};
  DeformStep step;
  deform({&one, 1}, {&step, 1});
  return step;
}

uint32_t PackedTracer::geometry_of_cluster(uint32_t cluster) const {
  const auto geometries = file_.geometries();
  const auto next = std::upper_bound(geometries.begin(), geometries.end(), cluster,
                                     [](uint32_t c, const baked::GeometryRecord& g) { return c < g.first_cluster; });
  return static_cast<uint32_t>(next - geometries.begin() - 1);
}

uint32_t PackedTracer::preferred_rays_per_call() const {
  return tables_->stream_depth > 0 ? packed::kStreamRays : RayTracer::preferred_rays_per_call();
}

void PackedTracer::closest_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder, std::span<RayHit> hits) const {
  assert(hits.size() == rays.size());
  kernels_.closest(tables_->scene, tables_->of_this_thread(), kernel_rays(rays), rays.size(), ray_class,
                   kernel_hits(hits), nullptr);
}

void PackedTracer::any_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder,
                            std::span<uint8_t> occluded) const {
  assert(occluded.size() == rays.size());
  kernels_.any(tables_->scene, tables_->of_this_thread(), kernel_rays(rays), rays.size(), ray_class, occluded.data(),
               nullptr);
}

void PackedTracer::set_tree_search(void (*search)(const void*, const packed::TreeSearch&), const void* searcher) {
  tables_->scene.search_tree = search;
  tables_->scene.searcher = searcher;
}

std::span<const baked::TreeRecord> PackedTracer::tree_records() const { return tables_->records; }

std::span<const packed::TraceTree> PackedTracer::trees() const { return tables_->trees; }

void PackedTracer::count_closest(std::span<const Ray> rays, uint32_t ray_class, std::span<RayHit> hits,
                                 packed::KernelCounters& counters) const {
  kernels_.closest(tables_->scene, tables_->of_this_thread(), kernel_rays(rays), rays.size(), ray_class,
                   kernel_hits(hits), &counters);
}

void PackedTracer::count_any(std::span<const Ray> rays, uint32_t ray_class, std::span<uint8_t> occluded,
                             packed::KernelCounters& counters) const {
  kernels_.any(tables_->scene, tables_->of_this_thread(), kernel_rays(rays), rays.size(), ray_class, occluded.data(),
               &counters);
}

HitSurface PackedTracer::resolve(const RayHit& hit) const {
  const Tables& t = *tables_;
  HitSurface surface;
  const uint32_t instance = instance_of(hit.placement, hit.part);
  surface.placement = &t.surfaces[instance];
  surface.geometry = source_.instances()[instance].geometry;
  surface.triangle = triangle_of(hit.part, instance, hit.triangle);
  if (const packed::TraceCluster& cluster = t.clusters[hit.part]; (cluster.flags & packed::kNeedsWideDecode) == 0) {
    decode_vertices(cluster, hit.triangle, surface.vertices);
    return surface;
  }
  packed::DecodedBatch batch;
  t.scene.decode_wide(this, hit.part, hit.triangle, 1, batch);
  for (int corner = 0; corner < 3; ++corner)
    for (int axis = 0; axis < 3; ++axis) surface.vertices[corner][axis] = batch.vertex[axis][corner][0];
  return surface;
}

void PackedTracer::previous_vertices(const RayHit& hit, Vec3 (&vertices)[3]) const {
  const Tables& t = *tables_;
  const uint32_t geometry = geometry_of_cluster(hit.part);
  if (const DeformedTree* tree = t.deformed.find(geometry)) {
    const auto first = static_cast<uint32_t>(file_.geometries()[geometry].first_cluster);
    decode_vertices(tree->previous_clusters()[hit.part - first], hit.triangle, vertices);
    return;
  }
  const HitSurface surface = resolve(hit);
  std::copy(std::begin(surface.vertices), std::end(surface.vertices), std::begin(vertices));
}

std::vector<ResidentPart> PackedTracer::resident() const {
  const Tables& t = *tables_;
  return {{"file", file_.file_bytes(), true},
          {"nodes built", t.built.nodes.size() * sizeof(baked::PackedNode)},
          {"deforming geometry", t.deformed.bytes()},
          {"cluster table", t.clusters.size() * sizeof(packed::TraceCluster)},
          {"placements", t.placements.size() * (sizeof(packed::TracePlacement) + sizeof(TreeBox) + sizeof(uint32_t)) +
                             t.surfaces.size() * sizeof(Placement) +
                             (t.top.size() + t.parts.size()) * sizeof(packed::TopNode) +
                             (t.tree_of.size() + t.grid_of.size() + t.first_instance.size()) * sizeof(uint32_t)},
          {"thread memory", ThreadMemoryOwner::bytes_of_all_threads(), true}};
}

} // namespace packtrace
