#include "runtime/trace/packed/scene/packed_tracer.h"

#include <algorithm>
#include <cassert>
#include <utility>

#include "compress/format/deformation/deformation_view.h"
#include "pbrt_import/base/error.h"
#include "pbrt_import/scene/bounds.h"
#include "runtime/trace/packed/scene/deformed_trees.h"
#include "runtime/trace/packed/scene/placed_trees.h"
#include "runtime/trace/packed/scene/thread_memory.h"
#include "runtime/trace/packed/scene/trace_cluster.h"
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

void decode_triangle(const packed::Kernels& kernels, const packed::TraceCluster& cluster, uint32_t triangle,
                     Vec3 (&vertices)[3]) {
  float decoded[3][3];
  kernels.triangle(cluster, triangle, decoded);
  for (size_t corner = 0; corner < 3; ++corner)
    vertices[corner] = {decoded[corner][0], decoded[corner][1], decoded[corner][2]};
}

} // namespace

const packed::KernelRay* kernel_rays(std::span<const Ray> rays) {
  return reinterpret_cast<const packed::KernelRay*>(rays.data());
}

packed::KernelHit* kernel_hits(std::span<RayHit> hits) { return reinterpret_cast<packed::KernelHit*>(hits.data()); }

/// What deforms: geometries of this tracer's own, or those of another tracer.
struct PackedTracer::Deformation {
  std::span<const DeformingGeometry> geometries;
  DeformConfig config;
  std::shared_ptr<DeformedTrees> shared;

  bool any() const { return !geometries.empty() || (shared && !shared->geometries().empty()); }
};

struct PackedTracer::Tables : TracedTrees {
  std::shared_ptr<DeformedTrees> deformed;
  bool follows = false;                         ///< `deformed` is another tracer's
  bool shared = false;                          ///< nodes and clusters are another tracer's
  std::vector<baked::TreeRecord> records_shown; ///< of all trees, with the grids of the deforming ones
  struct DeformingTree {
    uint32_t geometry, tree; ///< geometry of the file
    uint64_t updates;        ///< DeformedTrees::updates() of what is shown
  };
  std::vector<DeformingTree> deforming; ///< those that have an instance
  PlacedTrees placed;
  std::vector<uint32_t> first_instance; ///< by the file's geometry; a LOD level has that of its base geometry
  packed::KernelScene scene{};
  ThreadMemoryOwner memory;

  packed::ThreadMemory& of_this_thread() const { return memory.of_this_thread(placed.stream_depth()); }
};

PackedTracer::PackedTracer(const BakedFile& file, const SceneSource& source, PackedIsa isa, const Movers& movers)
    : PackedTracer(file, source, nullptr, isa, movers, {}) {}

PackedTracer::PackedTracer(const BakedFile& file, const LodSource& source, PackedIsa isa, const Movers& movers)
    : PackedTracer(file, source, &source, isa, movers, {}) {}

PackedTracer::PackedTracer(const BakedFile& file, const SceneSource& source,
                           std::span<const DeformingGeometry> deforming, const DeformConfig& config, PackedIsa isa,
                           const Movers& movers)
    : PackedTracer(file, source, nullptr, isa, movers, {deforming, config, nullptr}) {}

PackedTracer::PackedTracer(const BakedFile& file, const LodSource& source, const PackedTracer& leader, PackedIsa isa,
                           const Movers& movers)
    : PackedTracer(file, source, &source, isa, movers, {{}, {}, leader.tables_->deformed}) {}

PackedTracer::PackedTracer(const BakedFile& file, const SceneSource& source, const LodSource* lod, PackedIsa isa,
                           const Movers& movers, const Deformation& deformation)
    : file_(file), source_(source), lod_(lod), kernels_(kernels_of(isa)), tables_(std::make_unique<Tables>()) {
  Tables& t = *tables_;
  t.deformed = deformation.shared, t.follows = t.deformed != nullptr;
  const std::span<const uint32_t> shown = t.deformed ? t.deformed->geometries() : std::span<const uint32_t>();
  static_cast<TracedTrees&>(t) = lod != nullptr ? chosen_trees(file, *lod, shown, lod_trees_) : whole_trees(file);
  if (!t.deformed) t.deformed = std::make_shared<DeformedTrees>(file, deformation.geometries, deformation.config, t);
  if (deformation.any()) find_deforming();
  finish(movers, !movers.instances.empty() || deformation.any() || !level_chains(file.sections().deformation).empty());
}

PackedTracer::PackedTracer(const PackedTracer& whole, const SceneSource& source)
    : file_(whole.file_), source_(source), lod_(nullptr), kernels_(whole.kernels_),
      tables_(std::make_unique<Tables>()) {
  if (whole.lod_ != nullptr || !whole.tables_->deformed->geometries().empty())
    throw Error(ErrorKind::kUsage, "trees of levels of detail and of deforming geometries are not shared");
  Tables& t = *tables_;
  static_cast<TracedTrees&>(t) = shared_trees(*whole.tables_);
  t.shared = true;
  t.deformed = std::make_shared<DeformedTrees>(file_, std::span<const DeformingGeometry>(), DeformConfig{}, t);
  finish({}, !level_chains(file_.sections().deformation).empty());
}

/// Places the instances and describes all for the kernels.
/// @param keep_hulls whether placements may change
void PackedTracer::finish(const Movers& movers, bool keep_hulls) {
  Tables& t = *tables_;
  find_first_instances();
  place_all(movers);
  if (!keep_hulls) t.hulls = {};
  t.scene.clusters = t.clusters().data();
  t.scene.trees = t.trees.data();
  set_callbacks();
}

void PackedTracer::place_all(const Movers& movers) {
  std::vector<Bounds> bounds;
  for (uint32_t g = 0; g < source_.geometry_count(); ++g) bounds.push_back(bounds_of(g));
  if (lod_ == nullptr)
    for (const baked::LevelChainRecord& chain : level_chains(file_.sections().deformation)) {
      const std::span<const uint32_t> geometries = std::span(chain.geometry).first(chain.level_count);
      Bounds all;
      for (const uint32_t g : geometries) all.extend(bounds[g]);
      for (const uint32_t g : geometries) bounds[g] = all;
    }
  tables_->placed = {};
  tables_->placed.place(*tables_, source_, bounds, movers);
  tables_->placed.fill_in(tables_->scene);
}

void PackedTracer::replace_instances(const Movers& movers) { place_all(movers); }

/// Lists the trees of deforming geometries and shows them.
void PackedTracer::find_deforming() {
  Tables& t = *tables_;
  t.records_shown.assign(t.records.begin(), t.records.end());
  t.records = t.records_shown;
  for (uint32_t g = 0; g < source_.geometry_count(); ++g) {
    const uint32_t geometry = file_geometry(g);
    if (t.tree_of[g] == baked::kNone || t.deformed->find(geometry) == nullptr) continue;
    t.deforming.push_back({geometry, t.tree_of[g], t.deformed->updates(geometry)});
    show_deforming(geometry, t.tree_of[g]);
  }
}

void PackedTracer::show_deforming(uint32_t geometry, uint32_t tree) {
  const auto first = static_cast<size_t>(file_.geometries()[geometry].first_cluster);
  show_deformed(*tables_->deformed->find(geometry), tree, first, tables_->records_shown, *tables_);
}

/// The file's number of a geometry of the source.
uint32_t PackedTracer::file_geometry(uint32_t geometry) const {
  return lod_ != nullptr ? lod_->base_geometry(geometry) : geometry;
}

void PackedTracer::set_callbacks() {
  Tables& t = *tables_;
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
  if (const DeformedTree* tree = tables_->deformed->find(file_geometry(geometry))) return tree->object_bounds();
  if (lod_ != nullptr) return lod_->bounds(geometry);
  return object_bounds(file_.geometries()[geometry]);
}

Bounds PackedTracer::current_bounds(uint32_t geometry) const {
  if (const DeformedTree* tree = tables_->deformed->find(geometry)) return tree->current_bounds();
  return object_bounds(file_.geometries()[geometry]);
}

/// The instance that a cluster of a placement belongs to.
uint32_t PackedTracer::instance_of(uint32_t placement, uint32_t cluster) const {
  const uint32_t placed = tables_->placed.instance_of(placement);
  return placed != baked::kNone ? placed : tables_->first_instance[geometry_of_cluster(cluster)];
}

/// The source's number of a cluster's triangle.
uint32_t PackedTracer::triangle_of(uint32_t cluster, uint32_t instance, uint32_t triangle) const {
  if (lod_ != nullptr) return lod_->triangle_number(lod_->instances()[instance].geometry, cluster, triangle);
  return file_.sections().clusters[cluster].first_triangle + triangle;
}

void PackedTracer::place_instances(std::span<const uint32_t> instances, std::span<const Affine> world_from_object) {
  tables_->placed.move(instances, world_from_object);
  tables_->placed.fill_in(tables_->scene);
}

const UnitSpace& PackedTracer::space() const { return tables_->placed.space(); }

std::span<const Affine> PackedTracer::world_from_object() const { return tables_->placed.world_from_object(); }

std::span<const uint32_t> PackedTracer::flat_instances() const { return tables_->placed.flat_instances(); }

std::array<DVec3, 3> PackedTracer::object_vertices(const RayHit&, const HitSurface& surface) const {
  const uint32_t tree = tables_->tree_of[surface.geometry];
  const DAffine object_from_grid = tables_->object_from_grid(tree);
  std::array<DVec3, 3> vertices;
  for (size_t i = 0; i < 3; ++i) vertices[i] = transform_point(object_from_grid, DVec3(surface.vertices[i]));
  return vertices;
}

uint32_t PackedTracer::geometry_of_cluster(uint32_t cluster) const {
  const auto geometries = file_.geometries();
  const auto next = std::upper_bound(geometries.begin(), geometries.end(), cluster,
                                     [](uint32_t c, const baked::GeometryRecord& g) { return c < g.first_cluster; });
  return static_cast<uint32_t>(next - geometries.begin() - 1);
}

uint32_t PackedTracer::preferred_rays_per_call() const {
  return tables_->placed.stream_depth() > 0 ? packed::kStreamRays : RayTracer::preferred_rays_per_call();
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

const packed::KernelScene& PackedTracer::kernel_scene() const { return tables_->scene; }

const TracedTrees& PackedTracer::traced_trees() const { return *tables_; }

const PlacedTrees& PackedTracer::placed_trees() const { return tables_->placed; }

uint32_t PackedTracer::first_instance(uint32_t geometry) const { return tables_->first_instance[geometry]; }

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
  surface.placement = &t.placed.surface(instance);
  surface.geometry = source_.instances()[instance].geometry;
  surface.triangle = triangle_of(hit.part, instance, hit.triangle);
  if (const packed::TraceCluster& cluster = t.clusters()[hit.part]; (cluster.flags & packed::kNeedsWideDecode) == 0) {
    decode_triangle(kernels_, cluster, hit.triangle, surface.vertices);
    return surface;
  }
  packed::DecodedBatch batch;
  t.scene.decode_wide(this, hit.part, hit.triangle, 1, batch);
  for (int corner = 0; corner < 3; ++corner)
    for (int axis = 0; axis < 3; ++axis) surface.vertices[corner][axis] = batch.vertex[axis][corner][0];
  return surface;
}

void PackedTracer::deform(std::span<const DeformedFrame> frames, std::span<DeformStep> steps) {
  assert(steps.size() == frames.size());
  for (size_t i = 0; i < frames.size(); ++i) steps[i] = tables_->deformed->update(frames[i]);
  follow();
}

void PackedTracer::follow() {
  Tables& t = *tables_;
  bool changed = false;
  for (Tables::DeformingTree& one : t.deforming) {
    const uint64_t updates = t.deformed->updates(one.geometry);
    if (std::exchange(one.updates, updates) == updates) continue;
    show_deforming(one.geometry, one.tree);
    t.placed.refit(one.tree);
    changed = true;
  }
  if (!changed) return;
  t.placed.rebuild_top();
  t.placed.fill_in(t.scene);
  t.memory.forget_batches();
}

DeformStep PackedTracer::deform(uint32_t geometry, const FrameVertices& frame) {
  const DeformedFrame one{geometry, &frame};
  DeformStep step;
  deform({&one, 1}, {&step, 1});
  return step;
}

void PackedTracer::previous_vertices(const RayHit& hit, Vec3 (&vertices)[3]) const {
  const Tables& t = *tables_;
  const uint32_t geometry = geometry_of_cluster(hit.part);
  if (const DeformedTree* tree = t.deformed->find(geometry)) {
    const auto first = static_cast<uint32_t>(file_.geometries()[geometry].first_cluster);
    decode_triangle(kernels_, tree->previous_clusters()[hit.part - first], hit.triangle, vertices);
    return;
  }
  const HitSurface surface = resolve(hit);
  std::copy(std::begin(surface.vertices), std::end(surface.vertices), std::begin(vertices));
}

std::optional<DVec3> PackedTracer::previous_position(uint32_t instance, uint32_t triangle,
                                                     glm::dvec2 barycentrics) const {
  const Tables& t = *tables_;
  const uint32_t number = source_.instances()[instance].geometry, geometry = file_geometry(number);
  const DeformedTree* tree = t.deformed->find(geometry);
  if (tree == nullptr) return std::nullopt;
  const uint32_t cluster = file_.cluster_of_triangle(geometry, triangle);
  Vec3 v[3];
  decode_triangle(kernels_, tree->previous_clusters()[cluster],
                  triangle - file_.clusters(geometry)[cluster].first_triangle, v);
  const DVec3 a(v[0]), point = a + (DVec3(v[1]) - a) * barycentrics.x + (DVec3(v[2]) - a) * barycentrics.y;
  return transform_point(t.object_from_grid(t.tree_of[number]), point);
}

std::vector<ResidentPart> PackedTracer::resident() const {
  const Tables& t = *tables_;
  uint64_t hull_bytes = 0;
  for (const std::optional<TreeHull>& hull : t.hulls) hull_bytes += hull ? hull->bytes() : 0;
  return {{"file", file_.file_bytes(), true},
          {"nodes built", t.built && !t.shared ? t.built->nodes.size() * sizeof(baked::PackedNode) : 0},
          {"deforming geometry", t.follows ? 0 : t.deformed->bytes()},
          {"cluster table", t.shared ? 0 : t.clusters().size() * sizeof(packed::TraceCluster)},
          {"placements", t.placed.bytes() + hull_bytes +
                             (t.tree_of.size() + t.grid_of.size() + t.first_instance.size()) * sizeof(uint32_t)},
          {"thread memory", ThreadMemoryOwner::bytes_of_all_threads(), true}};
}

} // namespace packtrace
