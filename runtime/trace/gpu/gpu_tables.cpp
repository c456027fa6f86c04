#include "runtime/trace/gpu/gpu_tables.h"

#include <algorithm>
#include <bit>

#include "pbrt_import/base/error.h"
#include "runtime/trace/packed/scene/placed_trees.h"
#include "runtime/trace/packed/scene/trace_cluster.h"
#include "runtime/trace/packed/scene/traced_trees.h"

namespace packtrace {
namespace {

// Of packed/kernels/triangle_test.h, which is compiled with the kernels only.
constexpr float kExactDifferences = 0x1p23f, kFineGrid = 0x1p21f;

gpu::ClusterRecord cluster_record(const packed::TraceCluster& cluster, const uint8_t* payload) {
  gpu::ClusterRecord record{};
  if (cluster.bits == nullptr) return record; // of a level of detail that is not traced
  record.word = static_cast<uint32_t>((cluster.bits - payload) / 4);
  std::copy(std::begin(cluster.base), std::end(cluster.base), record.base);
  record.position_bit =
      cluster.position_bit | uint32_t{cluster.position_bits[0]} << 16 | uint32_t{cluster.position_bits[1]} << 24;
  record.shifts = cluster.position_bits[2] | uint32_t{cluster.up} << 8 | uint32_t{cluster.down} << 16 |
                  uint32_t{cluster.triangle_count} << 24;
  record.flags = cluster.strip_count | uint32_t{cluster.flags} << 8;
  return record;
}

} // namespace

GpuTables::GpuTables(const BakedFile& file, const SceneSource& source, const PackedTracer& tracer,
                     GpuStructures structures)
    : file_(file), source_(source), tracer_(tracer), structures_(structures) {
  add_trees();
  add_clusters();
  if (structures == GpuStructures::kDriver) add_bottom_levels();
  update_placements();
}

void GpuTables::add_trees() {
  const TracedTrees& traced = tracer_.traced_trees();
  for (size_t i = 0; i < traced.trees.size(); ++i) {
    const packed::TraceTree& tree = traced.trees[i];
    gpu::TreeRecord record{};
    record.first_node = static_cast<uint32_t>(tree.nodes - traced.nodes.data());
    record.max_coordinate = tree.max_coordinate;
    record.flags = (tree.graded != 0 ? gpu::kGraded : 0u) |
                   (tree.max_coordinate > kExactDifferences ? gpu::kInexactDifferences : 0u) |
                   (tree.max_coordinate > kFineGrid ? gpu::kFineTree : 0u);
    trees_.push_back(record);
    levels_ = std::max(levels_, traced.records[i].depth);
  }
}

void GpuTables::add_clusters() {
  const std::span<const packed::TraceCluster> all = tracer_.traced_trees().clusters();
  const std::span<const uint8_t> payload = file_.sections().payload;
  for (uint32_t i = 0; i < all.size(); ++i) {
    if (all[i].bits != nullptr && (all[i].bits < payload.data() || all[i].bits >= payload.data() + payload.size()))
      throw Error(ErrorKind::kUnsupported, "backend gpu does not trace geometry that deforms; use --backend packed");
    gpu::ClusterRecord& record = clusters_.emplace_back(cluster_record(all[i], payload.data()));
    if (all[i].bits == nullptr) continue;
    if ((all[i].flags & packed::kNeedsWideDecode) != 0) add_exact_vertices(i, record);
    if ((all[i].flags & packed::kMasked) != 0) add_masked_cluster(i, record);
  }
}

/// Divides the clusters of each tree by the rays that hit them.
void GpuTables::add_bottom_levels() {
  const TracedTrees& traced = tracer_.traced_trees();
  for (uint32_t tree = 0; tree < traced.records.size(); ++tree) {
    const baked::TreeRecord& record = traced.records[tree];
    std::vector<uint32_t> clusters;
    for (const baked::PackedNode& node : traced.nodes.subspan(record.first_node, record.node_count))
      if (node.has_leaves() && node.children[0] != baked::kNoChild) clusters.push_back(node.cluster);
    std::ranges::sort(clusters);
    const auto repeated = std::ranges::unique(clusters);
    clusters.erase(repeated.begin(), repeated.end());
    for (const uint32_t classes : {kCameraRays, kOcclusionRays, kCameraRays | kOcclusionRays})
      add_bottom_level(tree, classes, clusters);
  }
}

/// Adds the structure of the clusters of a tree that exactly these rays hit, if there are any.
void GpuTables::add_bottom_level(uint32_t tree, uint32_t ray_classes, std::span<const uint32_t> clusters) {
  const std::span<const packed::TraceCluster> all = tracer_.traced_trees().clusters();
  const baked::TreeRecord& grid = tracer_.traced_trees().records[tree];
  gpu::BottomLevel level;
  level.tree = tree, level.ray_classes = ray_classes;
  StructureKey key = {ray_classes, grid.step_mantissa, static_cast<uint64_t>(grid.step_exponent)};
  for (const int64_t axis : grid.origin) key.push_back(static_cast<uint64_t>(axis));
  for (const bool masked : {false, true}) {
    gpu::BottomLevel::Part& part = level.parts[masked ? 1 : 0];
    part.first_range = static_cast<uint32_t>(ranges_.size());
    for (const uint32_t cluster : clusters) {
      const uint8_t flags = all[cluster].flags;
      if ((flags & (kCameraRays | kOcclusionRays)) != ray_classes || ((flags & packed::kMasked) != 0) != masked)
        continue;
      ranges_.push_back({static_cast<uint32_t>(part.triangles), cluster});
      part.triangles += all[cluster].triangle_count;
      key.push_back(cluster);
    }
    part.range_count = static_cast<uint32_t>(ranges_.size()) - part.first_range;
  }
  if (level.triangles() == 0) return;
  bottom_levels_.push_back(level);
  structure_keys_.push_back(std::move(key));
}

uint32_t GpuTables::geometry_of(uint32_t cluster) const {
  const auto geometries = file_.geometries();
  const auto next = std::ranges::upper_bound(geometries, uint64_t{cluster}, {}, &baked::GeometryRecord::first_cluster);
  return static_cast<uint32_t>(next - geometries.begin() - 1);
}

void GpuTables::add_exact_vertices(uint32_t cluster, gpu::ClusterRecord& record) {
  const uint32_t g = geometry_of(cluster);
  const baked::GeometryRecord& geometry = file_.geometries()[g];
  const TracedTrees& traced = tracer_.traced_trees();
  record.base[0] = static_cast<int32_t>(exact_vertices_.size() / 3);
  decode_vertices_exactly(traced.records[traced.grid_of[g]], geometry,
                          file_.cluster(g, static_cast<uint32_t>(cluster - geometry.first_cluster)), exact_vertices_);
}

/// Begins the mask buffer: materials of all instances.
void GpuTables::add_materials() {
  masks_.assign(1, 0); // word 0: no mask
  image_words_.assign(file_.sections().masks.size(), 0);
  const std::span<const Material> materials = source_.materials();
  for (const Material& material : materials)
    for (const uint32_t mask : {(material.flags & kAlphaMask) != 0 ? material.alpha_mask : kNoMask,
                                (material.flags & kShadowAlphaMask) != 0 ? material.shadow_alpha_mask : kNoMask})
      if (mask != kNoMask) image_word(mask);
  materials_word_ = static_cast<uint32_t>(masks_.size());
  for (uint32_t i = 0; i < source_.instances().size(); ++i) {
    instance_materials_.push_back(static_cast<uint32_t>(masks_.size()));
    for (const uint32_t number : file_.instance_materials(i)) {
      const Material& material = materials[number];
      const bool all_rays = (material.flags & kAlphaMask) != 0 && material.alpha_mask != kNoMask;
      const bool shadows = (material.flags & kShadowAlphaMask) != 0 && material.shadow_alpha_mask != kNoMask;
      masks_.push_back(all_rays ? image_word(material.alpha_mask) : 0);
      masks_.push_back(shadows ? image_word(material.shadow_alpha_mask) : 0);
    }
  }
}

uint32_t GpuTables::image_word(uint32_t mask) {
  uint32_t& word = image_words_[mask];
  if (word != 0) return word;
  word = static_cast<uint32_t>(masks_.size());
  const AlphaMaskView view = source_.mask(mask);
  const auto bits = [](float x) { return std::bit_cast<uint32_t>(x); };
  masks_.insert(masks_.end(), {view.width, view.height, static_cast<uint32_t>(view.wrap), 0u, bits(view.uv_scale.x),
                               bits(view.uv_scale.y), bits(view.uv_offset.x), bits(view.uv_offset.y)});
  masks_.insert(masks_.end(), view.words.begin(), view.words.end());
  return word;
}

void GpuTables::add_masked_cluster(uint32_t cluster, gpu::ClusterRecord& record) {
  if (masks_.empty()) add_materials();
  const uint32_t g = geometry_of(cluster);
  const ClusterView view = file_.cluster(g, static_cast<uint32_t>(cluster - file_.geometries()[g].first_cluster));
  const TracedTrees& traced = tracer_.traced_trees();
  uint32_t slot = view.material_slot();
  if (traced.records[traced.grid_of[g]].geometry == baked::kWorldTree)
    slot += (instance_materials_[tracer_.first_instance(g)] - materials_word_) / 2;
  record.mask = static_cast<uint32_t>(masks_.size());
  masks_.push_back(view.has_uvs() ? 1u : 0u);
  masks_.push_back(slot);
  if (!view.has_uvs()) return;
  for (uint32_t v = 0; v < view.vertex_count(); ++v) {
    const Vec2 uv = view.uv(v);
    masks_.push_back(std::bit_cast<uint32_t>(uv.x));
    masks_.push_back(std::bit_cast<uint32_t>(uv.y));
  }
}

void GpuTables::update_placements() {
  if (masks_.empty()) return;
  if (placements_word_ != 0) masks_.resize(placements_word_);
  placements_word_ = static_cast<uint32_t>(masks_.size());
  const PlacedTrees& placed = tracer_.placed_trees();
  for (uint32_t p = 0; p < placed.count(); ++p) {
    const uint32_t instance = placed.instance_of(p);
    masks_.push_back(instance == baked::kNone ? materials_word_ : instance_materials_[instance]);
  }
}

gpu::SceneTables GpuTables::view() const {
  const packed::KernelScene& scene = tracer_.kernel_scene();
  gpu::SceneTables out{};
  const bool packed_nodes = structures_ == GpuStructures::kPacked;
  if (packed_nodes) out.nodes = tracer_.traced_trees().nodes;
  out.trees = trees_;
  out.clusters = clusters_;
  out.payload = file_.sections().payload;
  out.placements = {scene.placements, scene.placement_count};
  out.top = scene.top;
  if (packed_nodes) out.top_nodes = tracer_.placed_trees().top_nodes();
  out.exact_vertices = exact_vertices_;
  out.masks = masks_;
  out.scene = {scene.placement_count, placements_word_, scene.top_max_coordinate, scene.top_pad_coordinate};
  out.tree_levels = std::max(levels_, 1u);
  return out;
}

} // namespace packtrace
