#include "compress/format/trees/packed_trees.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include <tbb/parallel_for.h>

#include "compress/format/trees/node_tree.h"
#include "compress/format/trees/node_writer.h"
#include "compress/format/trees/stored_nodes.h"
#include "compress/format/trees/tree_grid.h"
#include "compress/format/trees/tree_validation.h"

namespace packtrace {
namespace {

constexpr size_t kChunkClusters = 64; // clusters per parallel task

/// A cluster to be put into a tree.
struct TreeCluster {
  uint32_t number = 0; ///< in the cluster section
  uint32_t geometry = 0;
  uint8_t ray_classes = 0;
};

/// Trees over chosen clusters live only as long as one view, so reinsertion is limited: moving all subtrees would take
/// ten times as long as the rest of building their nodes.
constexpr ReinsertionConfig kChosenTreeReinsertion{.passes = 1, .subtrees = 1 << 10, .search = 64};

/// Makes the leaf nodes of one cluster after another.
class LeafNodeBuilder {
public:
  LeafNodeBuilder(const BakedSections& sections, const TreeCosts& costs, const baked::TreeRecord& tree,
                  double typical_area)
      : sections_(sections), costs_(costs), tree_(tree), typical_area_(typical_area) {}

  /// Reuses the file's leaf nodes if they fit this tree's grid; otherwise makes new ones.
  void find(const TreeCluster& cluster, const StoredLeafNodes& stored, LeafNodes& out) {
    const size_t before = out.nodes.size();
    const std::span<const uint32_t> numbers = stored.of_cluster(cluster.number);
    if (numbers.empty()) return add(cluster, out);
    const NodeGridTransfer move(sections_.trees[stored.tree_of_cluster(cluster.number)], tree_);
    for (const uint32_t number : numbers) {
      out.nodes.push_back({});
      if (const std::optional<TreeGridBox> box = move.move(sections_.nodes[number], out.nodes.back())) {
        out.boxes.push_back(*box);
        continue;
      }
      out.nodes.resize(before), out.boxes.resize(before);
      return add(cluster, out);
    }
  }

  void add(const TreeCluster& cluster, LeafNodes& out) {
    const baked::GeometryRecord& geometry = sections_.geometries[cluster.geometry];
    const ClusterView view(geometry, sections_.clusters[cluster.number],
                           sections_.payload.data() + geometry.payload_offset);
    const std::span<const TreeGridBox> boxes = triangle_boxes(view, TreeGridMap(tree_, geometry), boxes_);
    leaf_nodes_.clear();
    find_leaf_nodes(boxes, costs_, typical_area_, leaf_nodes_);
    for (const LeafNode& leaves : leaf_nodes_) {
      out.nodes.push_back({});
      out.boxes.push_back(write_leaf_node(leaves, boxes, cluster.number, cluster.ray_classes, out.nodes.back()));
    }
  }

private:
  const BakedSections& sections_;
  const TreeCosts& costs_;
  const baked::TreeRecord& tree_;
  const double typical_area_;
  ClusterBoxes boxes_;
  std::vector<LeafNode> leaf_nodes_;
};

class TreeBuilder {
public:
  struct Tree {
    baked::TreeRecord record{};
    std::vector<baked::PackedNode> nodes;
  };

  TreeBuilder(const BakedSections& sections, const TreeCosts& costs) : sections_(sections), costs_(costs) {
    placed_ = sole_identity_instances(sections_);
  }

  PackedTrees run() {
    std::vector<uint32_t> world, others;
    find_world(world, others);
    const size_t first = world.empty() ? 0 : 1;
    std::vector<Tree> trees(first + others.size());
    tbb::parallel_for(size_t{0}, trees.size(), [&](size_t i) {
      trees[i] = i < first ? build(baked::kWorldTree, world) : build(others[i - first], {&others[i - first], 1});
    });
    return collect(trees);
  }

  static PackedTrees collect(std::span<Tree> trees) {
    PackedTrees out;
    for (Tree& tree : trees) {
      tree.record.first_node = out.nodes.size();
      out.trees.push_back(tree.record);
      out.nodes.insert(out.nodes.end(), tree.nodes.begin(), tree.nodes.end());
      tree = {};
    }
    return out;
  }

  bool may_join_world(uint32_t geometry) const {
    return (sections_.geometries[geometry].flags & baked::kWorldSpace) != 0 && placed_[geometry] != baked::kNone;
  }

  /// Divides the geometries with clusters into those of the world's tree and those with their own trees.
  void find_world(std::vector<uint32_t>& world, std::vector<uint32_t>& others) const {
    const auto& geometries = sections_.geometries;
    uint32_t mantissa = 0;
    int32_t coarsest = std::numeric_limits<int32_t>::min();
    for (uint32_t i = 0; i < geometries.size(); ++i)
      if (geometries[i].cluster_count > 0 && may_join_world(i)) {
        if (mantissa == 0) mantissa = geometries[i].step_mantissa;
        if (geometries[i].step_mantissa == mantissa) coarsest = std::max(coarsest, geometries[i].step_exponent);
      }
    for (uint32_t i = 0; i < geometries.size(); ++i)
      if (geometries[i].cluster_count > 0) {
        const bool joins = may_join_world(i) && geometries[i].step_mantissa == mantissa &&
                           coarsest - geometries[i].step_exponent <= kMaxTreeStepDoublings / 2;
        (joins ? world : others).push_back(i);
      }
  }

  Tree build(uint32_t name, std::span<const uint32_t> geometries) const {
    Tree tree;
    tree.record.geometry = name;
    std::vector<const baked::GeometryRecord*> records;
    for (const uint32_t g : geometries) records.push_back(&sections_.geometries[g]);
    choose_tree_grid(records, sections_.clusters, tree.record);
    const std::vector<TreeCluster> clusters = find_clusters(geometries);
    build_nodes(build_leaf_nodes(clusters, tree.record, find_typical_area(clusters, tree.record)), {}, tree);
    return tree;
  }

  /// Returns the clusters that some ray can hit.
  std::vector<TreeCluster> find_clusters(std::span<const uint32_t> geometries) const {
    std::vector<TreeCluster> clusters;
    for (const uint32_t g : geometries) {
      const baked::GeometryRecord& geometry = sections_.geometries[g];
      auto next = static_cast<uint32_t>(geometry.first_cluster);
      for (uint32_t c = 0; c < geometry.class_clusters.size(); ++c) {
        const uint8_t classes = ray_classes_of(c);
        const uint32_t end = next + geometry.class_clusters[c];
        if ((classes & (baked::kVisibleToCamera | baked::kVisibleToOcclusion)) != 0)
          for (uint32_t i = next; i < end; ++i) clusters.push_back({i, g, classes});
        next = end;
      }
    }
    return clusters;
  }

  /// Returns the 90th percentile of the typical leaf node area over all clusters. One value serves the whole tree, so
  /// that nodes are spent where they save most: the few clusters with large triangles are cut most finely.
  double find_typical_area(std::span<const TreeCluster> clusters, const baked::TreeRecord& tree) const {
    constexpr double kRecordBoxAreaFactor = 0.5; // boxes from records have about twice the area of exact boxes
    std::vector<double> areas;
    areas.reserve(clusters.size());
    for (const TreeCluster& of : clusters) {
      const baked::GeometryRecord& geometry = sections_.geometries[of.geometry];
      const baked::ClusterRecord& cluster = sections_.clusters[of.number];
      const LatticeBox box = box_of_record(geometry, cluster);
      std::array<double, 3> size;
      for (size_t axis = 0; axis < 3; ++axis)
        size[axis] =
            std::ldexp(static_cast<double>(box.hi[axis] - box.lo[axis]), geometry.step_exponent - tree.step_exponent);
      const double half_area = size[0] * size[1] + size[1] * size[2] + size[2] * size[0];
      areas.push_back(typical_node_area(kRecordBoxAreaFactor * half_area, cluster.triangle_count));
    }
    if (areas.empty()) return 0.0;
    const auto at = areas.begin() + static_cast<ptrdiff_t>((areas.size() - 1) * 9 / 10);
    std::nth_element(areas.begin(), at, areas.end());
    return *at;
  }

  /// @param stored leaf nodes to reuse where possible; null: make all
  LeafNodes build_leaf_nodes(std::span<const TreeCluster> clusters, const baked::TreeRecord& tree, double typical_area,
                             const StoredLeafNodes* stored = nullptr) const {
    const size_t chunks = (clusters.size() + kChunkClusters - 1) / kChunkClusters;
    std::vector<LeafNodes> of_chunk(chunks);
    tbb::parallel_for(size_t{0}, chunks, [&](size_t i) {
      LeafNodeBuilder builder(sections_, costs_, tree, typical_area);
      const size_t first = i * kChunkClusters, count = std::min(kChunkClusters, clusters.size() - first);
      for (const TreeCluster& cluster : clusters.subspan(first, count))
        stored != nullptr ? builder.find(cluster, *stored, of_chunk[i]) : builder.add(cluster, of_chunk[i]);
    });
    LeafNodes all;
    for (LeafNodes& chunk : of_chunk) {
      all.nodes.insert(all.nodes.end(), chunk.nodes.begin(), chunk.nodes.end());
      all.boxes.insert(all.boxes.end(), chunk.boxes.begin(), chunk.boxes.end());
      chunk = {};
    }
    return all;
  }

  static void build_nodes(const LeafNodes& leaves, const ReinsertionConfig& moves, Tree& tree) {
    NodeTree built = build_node_tree(leaves, moves);
    tree.nodes = std::move(built.nodes);
    tree.record.node_count = static_cast<uint32_t>(tree.nodes.size());
    tree.record.depth = built.depth;
  }

private:
  const BakedSections& sections_;
  const TreeCosts& costs_;
  std::vector<uint32_t> placed_; // by geometry: its sole_identity_instances()
};

} // namespace

PackedTrees build_packed_trees(const BakedSections& sections, const TreeCosts& costs) {
  return TreeBuilder(sections, costs).run();
}

struct ChosenTreeBuilder::Tables {
  /// Leaf nodes of all clusters in one grid: the world's, or that of one geometry and its LOD levels.
  struct Grid {
    baked::TreeRecord record{};
    std::vector<TreeCluster> clusters; ///< clusters that some choice contains
    LeafNodes leaves;
  };
  struct Run {
    uint32_t first = 0, count = 0; ///< range in the leaves of its grid
  };

  const BakedSections& sections;
  std::span<const ChosenClusters> chosen;
  StoredLeafNodes stored;
  std::vector<Grid> grids;
  std::vector<uint32_t> grid_of; ///< by choice
  std::vector<Run> runs;         ///< by cluster

  uint64_t leaf_nodes(size_t tree) const {
    uint64_t count = 0;
    for (const uint32_t cluster : chosen[tree].clusters) count += runs[cluster].count;
    return count;
  }

  /// Returns the stored tree that holds exactly these clusters, translated to their grid; nothing if there is none.
  std::optional<TreeBuilder::Tree> stored_tree(size_t tree) const {
    uint32_t number = baked::kNone;
    uint64_t count = 0;
    for (const uint32_t cluster : chosen[tree].clusters) {
      const size_t nodes = stored.of_cluster(cluster).size();
      if (nodes == 0) continue;
      if (number == baked::kNone) number = stored.tree_of_cluster(cluster);
      if (number != stored.tree_of_cluster(cluster)) return std::nullopt;
      count += nodes;
    }
    if (number == baked::kNone || count != stored.count_of_tree(number)) return std::nullopt;
    const baked::TreeRecord& from = sections.trees[number];
    TreeBuilder::Tree out;
    out.record = grids[grid_of[tree]].record;
    out.record.node_count = from.node_count, out.record.depth = from.depth;
    out.nodes.resize(from.node_count);
    const NodeGridTransfer move(from, out.record);
    if (!move.exact()) return std::nullopt;
    for (uint32_t i = 0; i < from.node_count; ++i)
      if (!move.move(sections.nodes[static_cast<size_t>(from.first_node) + i], out.nodes[i])) return std::nullopt;
    return out;
  }

  TreeBuilder::Tree build(size_t tree) const {
    if (std::optional<TreeBuilder::Tree> whole = stored_tree(tree)) return std::move(*whole);
    const Grid& grid = grids[grid_of[tree]];
    const uint64_t count = leaf_nodes(tree);
    LeafNodes leaves;
    leaves.nodes.reserve(count), leaves.boxes.reserve(count);
    for (const uint32_t cluster : chosen[tree].clusters)
      for (uint32_t i = runs[cluster].first, end = i + runs[cluster].count; i < end; ++i) {
        leaves.nodes.push_back(grid.leaves.nodes[i]);
        leaves.boxes.push_back(grid.leaves.boxes[i]);
      }
    TreeBuilder::Tree out;
    out.record = grid.record;
    TreeBuilder::build_nodes(leaves, kChosenTreeReinsertion, out);
    return out;
  }
};

ChosenTreeBuilder::ChosenTreeBuilder(const BakedSections& sections, std::span<const ChosenClusters> chosen)
    : tables_(std::make_unique<Tables>(Tables{sections, chosen, StoredLeafNodes(sections), {}, {}, {}})) {
  Tables& t = *tables_;
  const TreeCosts costs;
  const TreeBuilder builder(sections, costs);
  std::vector<uint8_t> wanted(sections.clusters.size(), 0);
  std::vector<std::vector<uint32_t>> with_levels(sections.geometries.size()); // by geometry: itself and its LOD levels
  for (uint32_t g = 0; g < with_levels.size(); ++g)
    if ((sections.geometries[g].flags & baked::kLodLevel) == 0) with_levels[g].push_back(g);
  for (const baked::LodLevelRecord& level : sections.lod_levels)
    if (level.level > 0) with_levels[level.base].push_back(level.geometry);
  std::vector<uint32_t> grid_of_geometry(sections.geometries.size(), ~0u);
  std::vector<std::vector<uint32_t>> geometries; // by grid
  for (const ChosenClusters& choice : chosen) {
    for (const uint32_t cluster : choice.clusters) wanted[cluster] = 1;
    const bool world = choice.geometry == baked::kWorldTree;
    if (!world && grid_of_geometry[choice.geometry] != ~0u) {
      t.grid_of.push_back(grid_of_geometry[choice.geometry]);
      continue;
    }
    t.grid_of.push_back(static_cast<uint32_t>(geometries.size()));
    if (!world) {
      grid_of_geometry[choice.geometry] = static_cast<uint32_t>(geometries.size());
      geometries.push_back(with_levels[choice.geometry]);
      continue;
    }
    std::vector<uint32_t>& all = geometries.emplace_back();
    const std::vector<uint8_t> joins = joins_world(sections);
    for (uint32_t g = 0; g < joins.size(); ++g)
      if (joins[g] != 0) all.insert(all.end(), with_levels[g].begin(), with_levels[g].end());
  }
  t.grids.resize(geometries.size());
  tbb::parallel_for(size_t{0}, geometries.size(), [&](size_t i) {
    Tables::Grid& grid = t.grids[i];
    std::vector<const baked::GeometryRecord*> records;
    for (const uint32_t g : geometries[i])
      if (sections.geometries[g].cluster_count > 0) records.push_back(&sections.geometries[g]);
    if (records.empty()) return;
    choose_tree_grid(records, sections.clusters, grid.record);
    grid.clusters = builder.find_clusters(geometries[i]);
    // Computed from all clusters of the grid, so that leaf nodes do not depend on the choice. If the file stores leaf
    // nodes, only those that do not fit the grid are made, and the value 0 is used for them.
    const double typical_area = t.stored.empty() ? builder.find_typical_area(grid.clusters, grid.record) : 0.0;
    std::erase_if(grid.clusters, [&](const TreeCluster& cluster) { return wanted[cluster.number] == 0; });
    grid.leaves = builder.build_leaf_nodes(grid.clusters, grid.record, typical_area, &t.stored);
  });
  t.runs.resize(sections.clusters.size());
  for (const Tables::Grid& grid : t.grids)
    for (uint32_t i = 0; i < grid.leaves.nodes.size(); ++i) {
      Tables::Run& run = t.runs[grid.leaves.nodes[i].cluster];
      if (run.count++ == 0) run.first = i;
    }
}

ChosenTreeBuilder::~ChosenTreeBuilder() = default;

std::vector<uint8_t> ChosenTreeBuilder::joins_world(const BakedSections& sections) {
  std::vector<uint32_t> world, others;
  TreeBuilder(sections, TreeCosts{}).find_world(world, others);
  std::vector<uint8_t> joins(sections.geometries.size(), 0);
  for (const uint32_t g : world) joins[g] = 1;
  return joins;
}

PackedTrees ChosenTreeBuilder::build() const {
  std::vector<TreeBuilder::Tree> trees(tables_->chosen.size());
  tbb::parallel_for(size_t{0}, trees.size(), [&](size_t i) {
    trees[i] = tables_->build(i);
    trees[i].record.geometry = tables_->chosen[i].geometry;
  });
  return TreeBuilder::collect(trees);
}

uint64_t ChosenTreeBuilder::leaf_nodes(size_t tree) const { return tables_->leaf_nodes(tree); }

} // namespace packtrace
