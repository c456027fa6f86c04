#pragma once

#include <span>
#include <vector>

#include "compress/format/trees/box_tree.h"
#include "runtime/trace/movers.h"
#include "runtime/trace/packed/kernels/kernel_types.h"
#include "runtime/trace/packed/scene/top_tree_builder.h"
#include "runtime/trace/packed/scene/traced_trees.h"
#include "runtime/trace/ray_tracer.h"

namespace packtrace {

/// The placements of a scene's trees, and the tree over them.
class PlacedTrees {
public:
  /// Places all instances of a source.
  /// @param trees needed during this call only, unless there are movers or trees that change: then they must outlive
  /// this object
  /// @param bounds object-space bounds, by geometry of the source
  /// Throws Error(kInput) for transforms that are not finite, Error(kUsage) for movers that do not exist or whose
  /// geometry is part of the world tree.
  void place(const TracedTrees& trees, const SceneSource& source, std::span<const Bounds> bounds, const Movers& movers);

  /// As RayTracer::place_instances().
  void move(std::span<const uint32_t> instances, std::span<const Affine> world_from_object);

  /// Fits the boxes of a tree's placements to its current hull. Call rebuild_top() and fill_in() after all trees that
  /// changed.
  void refit(uint32_t tree);
  void rebuild_top() { build_top(); }

  /// Points a scene to the placements and to the tree over them.
  void fill_in(packed::KernelScene& scene) const;

  const UnitSpace& space() const { return space_; }
  /// Whether an instance can be hit: it has triangles and is not flat.
  bool is_placed(uint32_t instance) const { return slot_of_[instance] != baked::kNone && flat_[instance] == 0; }
  /// @param instance is placed
  const Placement& surface(uint32_t instance) const { return surfaces_[slot_of_[instance]]; }
  /// The instance of a placement; baked::kNone for the world tree.
  uint32_t instance_of(uint32_t placement) const { return instance_of_[placement]; }
  std::span<const uint32_t> flat_instances() const { return flat_instances_; }
  std::span<const Affine> world_from_object() const { return world_from_object_; }
  size_t count() const { return placements_.size(); }
  /// The tree over placements, root first; empty for a single one.
  std::span<const packed::TopNode> top_nodes() const { return top_; }
  /// Levels of nodes of the tree over placements if rays traverse it as streams, else 0.
  uint32_t stream_depth() const { return stream_depth_; }
  uint64_t bytes() const;

private:
  void give_slot(uint32_t instance);
  bool set_surface(uint32_t instance, const Affine& world_from_object, const DAffine& unit_from_grid);
  void list_placements();
  void add_placement(uint32_t instance, uint32_t example);
  void update_placement(uint32_t number, const DAffine& unit_from_grid);
  void prepare_moves(std::span<const uint32_t> instances, std::span<const Affine> world_from_object);
  DAffine unit_from_grid(uint32_t tree, const Affine& world_from_object) const;
  void build_top();
  void describe_top();

  const TracedTrees* trees_ = nullptr;
  UnitSpace space_;
  std::vector<uint32_t> tree_of_instance_; ///< baked::kNone without triangles
  std::vector<uint32_t> slot_of_;          ///< by instance: in surfaces_; baked::kNone for those never placed
  std::vector<Placement> surfaces_;        ///< with movers of all instances with triangles, else of the placed ones
  std::vector<uint8_t> flat_;              ///< by instance: 1 if it cannot be traced
  std::vector<uint32_t> flat_instances_;
  std::vector<packed::TracePlacement> placements_;
  std::vector<uint32_t> instance_of_; ///< by placement
  std::vector<uint32_t> example_of_;  ///< by placement: an instance at its place
  /// By placement: its box in unit space. With more than eight placements it is enlarged; see
  /// packed::KernelScene::top_pad_coordinate.
  std::vector<TreeBox> boxes_;
  std::vector<packed::TopNode> top_, parts_;
  packed::TracePlacement top_placement_{};
  float top_max_coordinate_ = 0.0f, top_pad_coordinate_ = 0.0f;
  uint32_t stream_depth_ = 0;

  // Empty without movers.
  std::vector<uint8_t> movable_;              ///< by instance
  std::vector<Affine> world_from_object_;     ///< by instance
  std::vector<uint32_t> placement_of_;        ///< by instance; baked::kNone for flat ones
  std::vector<DAffine> moved_unit_from_grid_; ///< by moved instance of the last move
  TopTreeBuilder builder_;
};

} // namespace packtrace
