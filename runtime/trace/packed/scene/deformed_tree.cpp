#include "runtime/trace/packed/scene/deformed_tree.h"

#include <algorithm>
#include <atomic>
#include <limits>
#include <string>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "compress/format/layout/bit_fields.h"
#include "compress/format/trees/leaf_nodes.h"
#include "compress/format/trees/leaf_restorer.h"
#include "compress/format/trees/node_tree.h"
#include "compress/format/trees/node_writer.h"
#include "compress/format/trees/tree_validation.h"
#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

constexpr uint32_t kGrainClusters = 16;

/// The vertices that the file stores.
class StoredVertices final : public FrameVertices {
public:
  StoredVertices(const BakedFile& file, const DeformingGeometry& geometry) : file_(file), geometry_(geometry) {}

  void read(uint32_t cluster, std::span<FramePoint> out) const override {
    const ClusterView view = file_.cluster(geometry_.geometry, cluster);
    for (uint32_t v = 0; v < out.size(); ++v) {
      const LatticePoint q = view.lattice(v);
      for (size_t axis = 0; axis < 3; ++axis) {
        const int64_t offset = q[axis] - geometry_.range.lo[axis];
        out[v][axis] = static_cast<int32_t>(std::clamp<int64_t>(offset, -1, kMaxFrameExtent + 1));
      }
      out[v][3] = 0;
    }
  }

private:
  const BakedFile& file_;
  const DeformingGeometry& geometry_;
};

/// Sum of the areas of all nodes' boxes in units of the root's.
double area_of(std::span<const node_kernels::Box> boxes) {
  const auto half_area = [](const node_kernels::Box& box) {
    const auto size = [&](size_t axis) { return -static_cast<double>(box.minus_hi[axis]) - box.lo[axis]; };
    return size(0) * size(1) + size(1) * size(2) + size(2) * size(0);
  };
  double sum = 0.0;
  for (const node_kernels::Box& box : boxes) sum += half_area(box);
  const double root = boxes.empty() ? 0.0 : half_area(boxes[0]);
  return root > 0.0 ? sum / root : static_cast<double>(boxes.size());
}

uint32_t used_children(const baked::PackedNode& node) {
  uint32_t used = 0;
  while (used < baked::kNodeWidth && node.children[used] != baked::kNoChild) ++used;
  return used;
}

/// Decodes the boxes of a cluster's triangles, in tree coordinates.
std::span<const TreeGridBox> boxes_of(const packed::TraceCluster& cluster, const IndexLayout& layout,
                                      ClusterBoxes& room) {
  std::array<Triangle, kMaxClusterTriangles> triangles;
  decode_triangles(cluster.bits, layout, 0, triangles);
  for (uint32_t t = 0; t < layout.triangle_count; ++t)
    for (int corner = 0; corner < 3; ++corner) {
      const std::array<int32_t, 3> point = grid_point(cluster, triangles[t][corner]);
      corner == 0 ? static_cast<void>(room[t] = {point, point}) : room[t].extend({point, point});
    }
  return std::span(room).first(layout.triangle_count);
}

} // namespace

void DeformConfig::validate() const {
  if (!(max_growth >= 1.0 && max_growth <= 4.0))
    throw Error(ErrorKind::kUsage, "the growth of a tree's area before it is rebuilt must lie in 1 to 4");
}

DeformedTree::Grid DeformedTree::find_grid(const BakedFile& file, const DeformingGeometry& geometry,
                                           const baked::TreeRecord& tree) {
  const baked::GeometryRecord& record = file.geometries()[geometry.geometry];
  Grid grid;
  grid.record = tree;
  grid.record.first_node = 0;
  grid.record.step_exponent = record.step_exponent;
  for (size_t axis = 0; axis < 3; ++axis) {
    const int64_t lo = geometry.range.lo[axis], hi = geometry.range.hi[axis];
    const std::optional<int64_t> origin =
        lo <= hi ? tree_origin_of_frames(lo, static_cast<uint64_t>(hi) - static_cast<uint64_t>(lo)) : std::nullopt;
    if (!origin)
      throw Error(ErrorKind::kLimitExceeded,
                  "the frames of " + std::string(file.text(record.name)) +
                      " span more steps of its position grid than a tree can hold; choose a coarser precision");
    grid.record.origin[axis] = *origin;
    grid.low[axis] = static_cast<int32_t>(lo - *origin);
    grid.extent[axis] = static_cast<int32_t>(hi - lo);
  }
  return grid;
}

DeformedTree::DeformedTree(const BakedFile& file, const DeformingGeometry& geometry, const baked::TreeRecord& tree,
                           std::span<const baked::PackedNode> nodes, std::span<const packed::TraceCluster> clusters,
                           const DeformConfig& config)
    : file_(file), geometry_(geometry.geometry), config_(config), grid_(find_grid(file, geometry, tree)),
      nodes_(nodes.begin(), nodes.end()), boxes_(nodes.size()), ray_classes_(clusters.size()),
      now_(file, geometry.geometry, clusters, grid_.low), before_(file, geometry.geometry, clusters, grid_.low) {
  config.validate();
  const auto& class_clusters = file.geometries()[geometry_].class_clusters;
  for (uint32_t c = 0, next = 0; c < class_clusters.size(); ++c)
    for (const uint32_t end = next + class_clusters[c]; next < end; ++next) ray_classes_[next] = ray_classes_of(c);
  index_leaf_nodes();
  const StoredVertices stored(file, geometry);
  for (int both = 0; both < 2; ++both) { // now and before
    std::swap(now_, before_);
    write_clusters(stored);
  }
  refit();
  built_area_ = area_;
}

uint32_t DeformedTree::first_cluster() const {
  return static_cast<uint32_t>(file_.geometries()[geometry_].first_cluster);
}

void DeformedTree::index_leaf_nodes() {
  leaf_node_begins_.assign(size_t{now_.count()} + 2, 0);
  for (const baked::PackedNode& node : nodes_)
    if (node.has_leaves()) ++leaf_node_begins_[node.cluster - first_cluster() + size_t{2}];
  for (size_t c = 2; c < leaf_node_begins_.size(); ++c) leaf_node_begins_[c] += leaf_node_begins_[c - 1];
  leaf_nodes_.resize(leaf_node_begins_.back());
  for (uint32_t i = 0; i < nodes_.size(); ++i)
    if (nodes_[i].has_leaves()) leaf_nodes_[leaf_node_begins_[nodes_[i].cluster - first_cluster() + size_t{1}]++] = i;
  leaf_node_begins_.pop_back();
}

/// Rewrites one cluster after another: its position fields, then its leaf nodes.
class DeformedTree::ClusterWriter {
public:
  ClusterWriter(DeformedTree& tree, const FrameVertices& frame) : tree_(tree), frame_(frame) {}

  enum Result : uint8_t { kWritten, kNoRoom, kOutOfRange, kTooWide };

  /// @param bits receives the bits of the cluster's fields
  Result write(uint32_t cluster, uint64_t& bits) {
    const packed::TraceCluster& packed = tree_.now_.clusters()[cluster];
    const IndexLayout layout{packed.triangle_count,
                             tree_.file_.sections().clusters[tree_.first_cluster() + cluster].vertex_count,
                             packed.strip_count};
    const std::span<FramePoint> points = std::span(points_).first(layout.vertex_count);
    frame_.read(cluster, points);
    const DeformingClusters::Extent extent = DeformingClusters::extent_of(points);
    for (size_t axis = 0; axis < 3; ++axis)
      if (extent.lo[axis] < 0 || extent.hi[axis] > tree_.grid_.extent[axis]) return kOutOfRange;
    const uint32_t stride = DeformingClusters::stride_of(extent);
    bits = uint64_t{stride} * points.size();
    if (stride > kMaxFieldBits) return kTooWide;
    if (!tree_.now_.has_room(cluster, points.size(), extent)) return kNoRoom;
    tree_.now_.write(cluster, points, extent);
    write_leaf_nodes(cluster, points, packed.bits, layout);
    return kWritten;
  }

private:
  void write_leaf_nodes(uint32_t cluster, std::span<const FramePoint> points, const uint8_t* bits,
                        const IndexLayout& layout) {
    const uint32_t begin = tree_.leaf_node_begins_[cluster], end = tree_.leaf_node_begins_[cluster + size_t{1}];
    if (begin == end) return; // no ray sees it
    const std::span<node_kernels::Box> boxes = restorer_.vertex_boxes();
    for (size_t v = 0; v < points.size(); ++v)
      for (size_t lane = 0; lane < 4; ++lane) {
        const int32_t p = points[v][lane] + tree_.grid_.low[lane];
        boxes[v].lo[lane] = p, boxes[v].minus_hi[lane] = -p;
      }
    restorer_.begin_placed(bits, layout);
    for (uint32_t i = begin; i < end; ++i) {
      const uint32_t number = tree_.leaf_nodes_[i];
      baked::PackedNode& node = tree_.nodes_[number];
      const LeafNode leaves{node.first_triangle, used_children(node), node.children};
      tree_.boxes_[number] = restorer_.write(leaves, node.cluster, node.ray_classes, node);
    }
  }

  DeformedTree& tree_;
  const FrameVertices& frame_;
  LeafRestorer restorer_;
  std::array<FramePoint, kMaxClusterVertices> points_;
};

void DeformedTree::write_clusters(const FrameVertices& frame) {
  std::vector<uint64_t> wanted(now_.count(), 0); // by cluster without room: bits of its fields
  std::atomic<uint32_t> crowded{0}, bad{std::numeric_limits<uint32_t>::max()}, wide{bad.load()};
  const auto note = [](std::atomic<uint32_t>& least, uint32_t cluster) { // so that messages do not depend on threads
    for (uint32_t seen = least; cluster < seen && !least.compare_exchange_weak(seen, cluster);) {
    }
  };
  const auto pass = [&](bool only_crowded) {
    tbb::parallel_for(tbb::blocked_range<uint32_t>(0, now_.count(), kGrainClusters), [&](const auto& range) {
      ClusterWriter writer(*this, frame);
      for (uint32_t c = range.begin(); c < range.end(); ++c) {
        if (only_crowded && wanted[c] == 0) continue;
        uint64_t bits = 0;
        switch (writer.write(c, bits)) {
        case ClusterWriter::kWritten:
          break;
        case ClusterWriter::kNoRoom:
          wanted[c] = bits, ++crowded;
          break;
        case ClusterWriter::kOutOfRange:
          note(bad, c);
          break;
        case ClusterWriter::kTooWide:
          note(wide, c);
          break;
        }
      }
    });
  };
  pass(false);
  if (bad == std::numeric_limits<uint32_t>::max() && wide == bad && crowded > 0) {
    now_.make_room(wanted);
    pass(true);
  }
  const std::string name(file_.text(file_.geometries()[geometry_].name));
  if (bad != std::numeric_limits<uint32_t>::max())
    throw Error(ErrorKind::kInput, "cluster " + std::to_string(bad) + " of " + name +
                                       " has a vertex outside the box that was given for all frames");
  if (wide != std::numeric_limits<uint32_t>::max())
    throw Error(ErrorKind::kLimitExceeded, "cluster " + std::to_string(wide) + " of " + name +
                                               " spans too many steps of the position grid: its fields would take "
                                               "more than " +
                                               std::to_string(kMaxFieldBits) +
                                               " bits per vertex; choose a coarser precision");
}

/// From the last node to the first, because children lie behind their parents.
void DeformedTree::refit() {
  const node_kernels::Kernels& kernels = node_kernels::kernels();
  for (size_t i = nodes_.size(); i-- > 0;) {
    if (nodes_[i].has_leaves()) continue;
    const uint32_t first = nodes_[i].first_child, count = used_children(nodes_[i]);
    boxes_[i] = restore_inner_node(kernels, first, std::span(nodes_).subspan(first, count),
                                   std::span(boxes_).subspan(first, count), nodes_[i]);
  }
  area_ = area_of(boxes_);
}

DeformStep DeformedTree::update(const FrameVertices& frame) {
  std::swap(now_, before_);
  write_clusters(frame);
  refit();
  DeformStep step;
  step.growth = built_area_ > 0.0 ? area_ / built_area_ : 1.0;
  step.rebuilt = step.growth > config_.max_growth;
  if (step.rebuilt) rebuild();
  return step;
}

void DeformedTree::rebuild() {
  const TreeCosts costs;
  std::vector<LeafNodes> of_cluster(now_.count());
  const auto layout = [&](uint32_t c) {
    const packed::TraceCluster& cluster = now_.clusters()[c];
    return IndexLayout{cluster.triangle_count, file_.sections().clusters[first_cluster() + c].vertex_count,
                       cluster.strip_count};
  };
  const auto seen = [&](uint32_t c) {
    return (ray_classes_[c] & (baked::kVisibleToCamera | baked::kVisibleToOcclusion)) != 0;
  };
  std::vector<double> typical(now_.count(), -1.0);
  const auto each_cluster = [&](const auto& body) {
    tbb::parallel_for(tbb::blocked_range<uint32_t>(0, now_.count(), kGrainClusters), [&](const auto& range) {
      ClusterBoxes room;
      for (uint32_t c = range.begin(); c < range.end(); ++c)
        if (seen(c)) body(c, boxes_of(now_.clusters()[c], layout(c), room));
    });
  };
  each_cluster([&](uint32_t c, std::span<const TreeGridBox> boxes) {
    TreeGridBox whole = boxes[0];
    for (const TreeGridBox& box : boxes) whole.extend(box);
    const auto size = [&](size_t axis) { return static_cast<double>(whole.hi[axis]) - whole.lo[axis]; };
    typical[c] = typical_node_area(size(0) * size(1) + size(1) * size(2) + size(2) * size(0),
                                   static_cast<uint32_t>(boxes.size()));
  });
  std::erase_if(typical, [](double area) { return area < 0.0; });
  if (typical.empty()) return;
  const auto at = typical.begin() + static_cast<ptrdiff_t>((typical.size() - 1) * 9 / 10); // as in packed_trees.cpp
  std::nth_element(typical.begin(), at, typical.end());
  each_cluster([&](uint32_t c, std::span<const TreeGridBox> boxes) {
    std::vector<LeafNode> leaf_nodes;
    find_leaf_nodes(boxes, costs, *at, leaf_nodes);
    for (const LeafNode& leaves : leaf_nodes) {
      of_cluster[c].nodes.push_back({});
      of_cluster[c].boxes.push_back(
          write_leaf_node(leaves, boxes, first_cluster() + c, ray_classes_[c], of_cluster[c].nodes.back()));
    }
  });
  LeafNodes all;
  for (const LeafNodes& one : of_cluster) {
    all.nodes.insert(all.nodes.end(), one.nodes.begin(), one.nodes.end());
    all.boxes.insert(all.boxes.end(), one.boxes.begin(), one.boxes.end());
  }
  NodeTree built = build_node_tree(all, config_.reinsertion);
  nodes_ = std::move(built.nodes);
  grid_.record.node_count = static_cast<uint32_t>(nodes_.size());
  grid_.record.depth = built.depth;
  boxes_.resize(nodes_.size());
  for (size_t i = 0; i < boxes_.size(); ++i) {
    const TreeGridBox& box = built.boxes[i];
    boxes_[i] = {{box.lo[0], box.lo[1], box.lo[2], 0}, {-box.hi[0], -box.hi[1], -box.hi[2], 0}};
  }
  index_leaf_nodes();
  area_ = built_area_ = area_of(boxes_);
}

/// Object-space bounds of a box in tree coordinates.
Bounds DeformedTree::bounds_between(const FramePoint& lo, const FramePoint& hi) const {
  const double step = PositionGrid{grid_.record.step_mantissa, grid_.record.step_exponent}.step();
  Bounds bounds;
  for (size_t axis = 0; axis < 3; ++axis) {
    const auto at = static_cast<int>(axis);
    bounds.lo[at] = static_cast<double>(from_lattice(grid_.record.origin[axis] + lo[axis], step));
    bounds.hi[at] = static_cast<double>(from_lattice(grid_.record.origin[axis] + hi[axis], step));
  }
  return bounds;
}

Bounds DeformedTree::object_bounds() const {
  FramePoint high = grid_.low;
  for (size_t axis = 0; axis < 3; ++axis) high[axis] += grid_.extent[axis];
  return bounds_between(grid_.low, high);
}

Bounds DeformedTree::current_bounds() const {
  const node_kernels::Box& root = boxes_[0];
  return bounds_between({root.lo[0], root.lo[1], root.lo[2]},
                        {-root.minus_hi[0], -root.minus_hi[1], -root.minus_hi[2]});
}

uint64_t DeformedTree::bytes() const {
  return now_.bytes() + before_.bytes() + nodes_.size() * sizeof nodes_[0] + boxes_.size() * sizeof boxes_[0] +
         (leaf_node_begins_.size() + leaf_nodes_.size()) * sizeof(uint32_t) + ray_classes_.size();
}

} // namespace packtrace
