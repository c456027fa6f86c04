#include "runtime/trace/packed/scene/traced_trees.h"

#include <algorithm>
#include <cmath>

#include "compress/format/cluster/position_grid.h"
#include "runtime/stopwatch.h"
#include "runtime/trace/packed/scene/trace_cluster.h"

namespace packtrace {
namespace {

uint8_t ray_classes(uint32_t material_class) {
  return static_cast<uint8_t>(((material_class & 1u) == 0 ? baked::kVisibleToCamera : 0) |
                              ((material_class & 2u) == 0 ? baked::kVisibleToOcclusion : 0) |
                              ((material_class & baked::kMaskedClass) != 0 ? baked::kMaskedLeaves : 0));
}

/// Whether a common pad for all boxes would be so large, compared with leaf nodes, that rays would often hit boxes that
/// they miss. Decided by the median size of a sample of leaf nodes.
bool needs_graded_pads(std::span<const baked::PackedNode> nodes, float max_coordinate) {
  constexpr size_t kSample = 256;
  constexpr float kVisiblePad = 0x1p-24f * 24.0f * 32.0f; // 32 times kBoxPad
  std::vector<float> sizes;
  for (size_t i = 0; i < kSample; ++i) {
    const baked::PackedNode& node = nodes[i * nodes.size() / kSample];
    if (!node.has_leaves()) continue;
    float size = 0.0f;
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const int extent = *std::ranges::max_element(node.hi[axis]) - *std::ranges::min_element(node.lo[axis]);
      size = std::max(size, std::ldexp(static_cast<float>(extent), static_cast<int>(node.exponent(axis))));
    }
    sizes.push_back(size);
  }
  if (sizes.empty()) return false;
  const auto middle = sizes.begin() + static_cast<ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  return kVisiblePad * max_coordinate > *middle;
}

std::span<const baked::PackedNode> nodes_of(const TracedTrees& t, uint32_t number) {
  const baked::TreeRecord& record = t.records[number];
  return t.nodes.subspan(static_cast<size_t>(record.first_node), record.node_count);
}

void add_tree(TracedTrees& t, uint32_t number) {
  const std::span<const baked::PackedNode> nodes = nodes_of(t, number);
  if (!nodes.empty()) t.hulls[number].emplace(nodes.data());
  t.trees.push_back(nodes.empty() ? packed::TraceTree{nodes.data(), 1.0f, 0} : trace_tree(nodes, *t.hulls[number]));
}

/// Fills in the clusters of geometry g.
/// @param number tree in whose grid the clusters are decoded
void add_clusters(TracedTrees& t, const BakedFile& file, uint32_t number, uint32_t g) {
  const baked::TreeRecord& tree = t.records[number];
  const baked::GeometryRecord& geometry = file.geometries()[g];
  t.grid_of[g] = number;
  uint32_t next = 0;
  for (uint32_t c = 0; c < geometry.class_clusters.size(); ++c)
    for (const uint32_t end = next + geometry.class_clusters[c]; next < end; ++next)
      t.clusters()[geometry.first_cluster + next] =
          trace_cluster(tree, geometry, file.cluster(g, next), ray_classes(c));
}

/// Returns trees with the arrays that are indexed by geometry or cluster allocated.
TracedTrees make_room(const BakedFile& file, uint32_t geometry_count) {
  TracedTrees t;
  t.cluster_table = std::make_shared<std::vector<packed::TraceCluster>>(file.sections().clusters.size());
  t.tree_of.assign(geometry_count, baked::kNone);
  t.grid_of.assign(file.geometries().size(), baked::kNone);
  return t;
}

void add_trees(TracedTrees& t) {
  t.hulls.resize(t.records.size());
  for (uint32_t i = 0; i < t.records.size(); ++i) add_tree(t, i);
}

} // namespace

DAffine TracedTrees::object_from_grid(uint32_t tree) const {
  const baked::TreeRecord& record = records[tree];
  const double step = PositionGrid{record.step_mantissa, record.step_exponent}.step();
  const DVec3 origin(static_cast<double>(record.origin[0]), static_cast<double>(record.origin[1]),
                     static_cast<double>(record.origin[2]));
  return DAffine(DVec3(step, 0, 0), DVec3(0, step, 0), DVec3(0, 0, step), origin * step);
}

packed::TraceTree trace_tree(std::span<const baked::PackedNode> nodes, const TreeHull& hull) {
  const DVec3 far = glm::max(glm::abs(hull.lo()), glm::abs(hull.hi()));
  packed::TraceTree tree{nodes.data(), 1.0f, 0};
  tree.max_coordinate =
      std::max({1.0f, static_cast<float>(far.x), static_cast<float>(far.y), static_cast<float>(far.z)});
  tree.graded = needs_graded_pads(nodes, tree.max_coordinate) ? 1 : 0;
  return tree;
}

TracedTrees whole_trees(const BakedFile& file) {
  TracedTrees t = make_room(file, file.base_geometry_count());
  t.records = file.sections().trees;
  t.nodes = file.sections().nodes;
  if (t.records.empty()) {
    BakedSections sections = file.sections();
    sections.geometries = sections.geometries.first(file.base_geometry_count());
    t.built = std::make_shared<const PackedTrees>(build_packed_trees(sections));
    t.records = t.built->trees;
    t.nodes = t.built->nodes;
  }
  uint32_t world = baked::kNone;
  for (uint32_t i = 0; i < t.records.size(); ++i) {
    const uint32_t g = t.records[i].geometry;
    if (g == baked::kWorldTree)
      world = i;
    else if (g < t.tree_of.size()) // otherwise the tree of a coarser LOD level
      t.tree_of[g] = i;
  }
  for (uint32_t g = 0; g < t.tree_of.size(); ++g) {
    if (file.geometries()[g].cluster_count == 0) continue;
    if (t.tree_of[g] == baked::kNone) t.tree_of[g] = world;
    add_clusters(t, file, t.tree_of[g], g);
  }
  add_trees(t);
  return t;
}

TracedTrees shared_trees(const TracedTrees& trees) {
  TracedTrees t = trees;
  t.hulls.assign(t.records.size(), std::nullopt);
  for (uint32_t i = 0; i < t.records.size(); ++i)
    if (const std::span<const baked::PackedNode> nodes = nodes_of(t, i); !nodes.empty())
      t.hulls[i].emplace(nodes.data());
  return t;
}

TracedTrees chosen_trees(const BakedFile& file, const LodSource& source, std::span<const uint32_t> without,
                         LodTrees& cost) {
  TracedTrees t = make_room(file, source.geometry_count());
  const BakedSections& sections = file.sections();
  const std::vector<uint8_t> joins = ChosenTreeBuilder::joins_world(sections);
  std::vector<ChosenClusters> chosen;
  std::vector<uint32_t> blas_of; // by index in `chosen`
  uint32_t world = baked::kNone;
  const auto next_tree = [&](uint32_t geometry, uint32_t blas) {
    chosen.push_back({geometry, {}});
    blas_of.push_back(blas);
    return static_cast<uint32_t>(chosen.size()) - 1;
  };
  for (uint32_t b = 0; b < source.geometry_count(); ++b) {
    const uint32_t base = source.base_geometry(b);
    if (source.clusters(b).empty()) continue;
    if (joins[base] != 0 && world == baked::kNone) world = next_tree(baked::kWorldTree, kNoGeometry);
    const uint32_t tree = joins[base] != 0 ? world : next_tree(base, b);
    t.tree_of[b] = tree;
    if (std::ranges::find(without, base) != without.end()) continue;
    for (const BlasCluster& c : source.clusters(b))
      chosen[tree].clusters.push_back(static_cast<uint32_t>(file.geometries()[c.geometry].first_cluster + c.cluster));
  }
  if (world != baked::kNone)
    // The clusters of coarser levels follow those of level 0 of all geometries.
    std::ranges::sort(chosen[world].clusters);
  const Stopwatch making_clusters;
  const ChosenTreeBuilder builder(sections, chosen);
  cost.clusters_s = making_clusters.seconds();
  const Stopwatch building;
  t.built = std::make_shared<const PackedTrees>(builder.build());
  t.records = t.built->trees;
  t.nodes = t.built->nodes;
  cost.trees_s = building.seconds();
  for (uint32_t i = 0; i < chosen.size(); ++i) {
    const uint64_t leaves = builder.leaf_nodes(i);
    cost.trees.push_back({blas_of[i], (leaves > 0 ? 2 * leaves - 1 : 0) * sizeof(baked::PackedNode),
                          t.records[i].node_count * sizeof(baked::PackedNode)});
  }
  for (uint32_t b = 0; b < source.geometry_count(); ++b) {
    const uint32_t base = source.base_geometry(b);
    if (t.tree_of[b] == baked::kNone || t.grid_of[base] != baked::kNone) continue;
    add_clusters(t, file, t.tree_of[b], base);
    for (const baked::LodLevelRecord& level : file.lod(base).levels)
      if (level.level > 0) add_clusters(t, file, t.tree_of[b], level.geometry);
  }
  add_trees(t);
  return t;
}

} // namespace packtrace
