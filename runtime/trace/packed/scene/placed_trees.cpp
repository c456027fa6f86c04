#include "runtime/trace/packed/scene/placed_trees.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <string>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "pbrt_import/base/error.h"
#include "runtime/trace/placement.h"

namespace packtrace {
namespace {

/// Whether the transform only scales along the axes and translates.
bool is_aligned(const DAffine& m) {
  return m[0].y == 0.0 && m[0].z == 0.0 && m[1].x == 0.0 && m[1].z == 0.0 && m[2].x == 0.0 && m[2].y == 0.0;
}

/// Maximum number of placements for which rays are tested against the boxes of parts (KernelScene::parts).
constexpr size_t kMaxPlacementsWithParts = baked::kNodeWidth;

/// Number of moved instances per task.
constexpr size_t kMovesPerTask = 64;

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

template <typename Work>
void for_moves(size_t count, const Work& work) {
  tbb::parallel_for(tbb::blocked_range<size_t>(0, count, kMovesPerTask), [&](const tbb::blocked_range<size_t>& range) {
    for (size_t i = range.begin(); i != range.end(); ++i) work(i);
  });
}

} // namespace

void PlacedTrees::place(const TracedTrees& trees, const SceneSource& source, std::span<const Bounds> bounds,
                        const Movers& movers) {
  trees_ = &trees;
  const std::span<const PlacedGeometry> instances = source.instances();
  movable_ = movable_instances(movers, instances.size());
  space_ = UnitSpace(bounds_of_motion(source, bounds, movers));
  slot_of_.assign(instances.size(), baked::kNone);
  flat_.assign(instances.size(), 0);
  for (uint32_t i = 0; i < instances.size(); ++i) {
    const uint32_t tree = trees.tree_of[instances[i].geometry];
    tree_of_instance_.push_back(tree);
    if (!movable_.empty()) world_from_object_.push_back(instances[i].world_from_object);
    if (tree == baked::kNone) continue;
    if (!movable_.empty() && movable_[i] != 0 && trees.records[tree].geometry == baked::kWorldTree)
      throw Error(ErrorKind::kUsage, "instance " + std::to_string(i) +
                                         " cannot move: it shares a tree with all other geometry in world space");
    if (!movable_.empty()) give_slot(i); // places come and go
    flat_[i] =
        set_surface(i, instances[i].world_from_object, unit_from_grid(tree, instances[i].world_from_object)) ? 0 : 1;
  }
  surfaces_.shrink_to_fit();
  list_placements();
  build_top();
  if (movable_.empty()) builder_ = {}; // its memory is needed again only if trees change
}

DAffine PlacedTrees::unit_from_grid(uint32_t tree, const Affine& world_from_object) const {
  return compose(compose(space_.unit_from_outer(), DAffine(world_from_object)), trees_->object_from_grid(tree));
}

void PlacedTrees::give_slot(uint32_t instance) {
  slot_of_[instance] = static_cast<uint32_t>(surfaces_.size());
  surfaces_.emplace_back();
}

/// Returns false if the instance is flat.
bool PlacedTrees::set_surface(uint32_t instance, const Affine& world_from_object, const DAffine& unit_from_grid) {
  const std::optional<DAffine> placed = invertible_placement(unit_from_grid);
  if (!placed) return false;
  if (slot_of_[instance] == baked::kNone) give_slot(instance);
  surfaces_[slot_of_[instance]] = exactly_instanced_placement(instance, DAffine(world_from_object), *placed);
  return true;
}

/// Lists the placements of all instances that are not flat, and their boxes.
void PlacedTrees::list_placements() {
  placements_.clear(), instance_of_.clear(), example_of_.clear(), boxes_.clear(), parts_.clear(),
      flat_instances_.clear();
  if (!movable_.empty()) placement_of_.assign(tree_of_instance_.size(), baked::kNone);
  bool world_placed = false;
  for (uint32_t i = 0; i < tree_of_instance_.size(); ++i) {
    const uint32_t tree = tree_of_instance_[i];
    if (tree == baked::kNone) continue;
    if (flat_[i] != 0) {
      flat_instances_.push_back(i);
      continue;
    }
    const bool in_world = trees_->records[tree].geometry == baked::kWorldTree;
    if (in_world && world_placed) continue;
    world_placed |= in_world;
    if (trees_->records[tree].node_count > 0) add_placement(in_world ? baked::kNone : i, i);
  }
  if (placements_.size() > kMaxPlacementsWithParts) std::ranges::transform(boxes_, boxes_.begin(), grown);
}

/// @param instance baked::kNone for the world tree
/// @param example an instance of the tree at this place
void PlacedTrees::add_placement(uint32_t instance, uint32_t example) {
  const uint32_t tree = tree_of_instance_[example];
  packed::TracePlacement placement{};
  const TreeHull& hull = *trees_->hulls[tree];
  for (int axis = 0; axis < 3; ++axis)
    placement.box_lo[axis] = hull.lo()[axis], placement.box_hi[axis] = hull.hi()[axis];
  placement.tree = tree;
  placement.ray_classes = trees_->trees[tree].nodes[0].ray_classes;
  const auto number = static_cast<uint32_t>(placements_.size());
  placements_.push_back(placement);
  instance_of_.push_back(instance);
  example_of_.push_back(example);
  boxes_.emplace_back();
  if (parts_.size() < kMaxPlacementsWithParts) parts_.emplace_back();
  if (!movable_.empty()) placement_of_[example] = number;
  update_placement(number, surface(example).unit_from_surface);
}

/// Computes what depends on a placement's transform. Its box is not enlarged.
void PlacedTrees::update_placement(uint32_t number, const DAffine& unit_from_grid) {
  packed::TracePlacement& placement = placements_[number];
  const DAffine grid_from_unit = inverse(unit_from_grid);
  for (int column = 0; column < 4; ++column)
    for (int axis = 0; axis < 3; ++axis) placement.grid_from_unit[3 * column + axis] = grid_from_unit[column][axis];
  placement.aligned = is_aligned(grid_from_unit) ? 1 : 0;
  const TreeHull& hull = *trees_->hulls[placement.tree];
  boxes_[number] = hull.placed(unit_from_grid);
  if (number < parts_.size()) parts_[number] = top_node(hull.placed_parts(unit_from_grid, placement.aligned != 0));
}

void PlacedTrees::refit(uint32_t tree) {
  const bool enlarged = placements_.size() > kMaxPlacementsWithParts;
  for (uint32_t p = 0; p < placements_.size(); ++p) {
    if (placements_[p].tree != tree) continue;
    const TreeHull& hull = *trees_->hulls[tree];
    for (int axis = 0; axis < 3; ++axis)
      placements_[p].box_lo[axis] = hull.lo()[axis], placements_[p].box_hi[axis] = hull.hi()[axis];
    update_placement(p, surface(example_of_[p]).unit_from_surface);
    if (enlarged) boxes_[p] = grown(boxes_[p]);
  }
}

void PlacedTrees::move(std::span<const uint32_t> instances, std::span<const Affine> world_from_object) {
  check_moves(movable_, instances, world_from_object);
  if (instances.empty()) return;
  prepare_moves(instances, world_from_object);
  std::atomic<bool> relist{false};
  const bool enlarged = placements_.size() > kMaxPlacementsWithParts;
  for_moves(instances.size(), [&](size_t m) {
    const uint32_t i = instances[m];
    world_from_object_[i] = world_from_object[m];
    if (tree_of_instance_[i] == baked::kNone) return;
    const uint8_t flat = set_surface(i, world_from_object[m], moved_unit_from_grid_[m]) ? 0 : 1;
    if (flat != flat_[i]) relist.store(true, std::memory_order_relaxed);
    flat_[i] = flat;
    const uint32_t placement = placement_of_[i];
    if (flat != 0 || placement == baked::kNone) return;
    update_placement(placement, surface(i).unit_from_surface);
    if (enlarged) boxes_[placement] = grown(boxes_[placement]);
  });
  if (relist.load()) list_placements();
  build_top();
}

/// Computes moved_unit_from_grid_. Throws Error(kUsage) for the first instance that would leave the traced space.
void PlacedTrees::prepare_moves(std::span<const uint32_t> instances, std::span<const Affine> world_from_object) {
  moved_unit_from_grid_.resize(instances.size());
  std::atomic<size_t> outside{instances.size()};
  for_moves(instances.size(), [&](size_t m) {
    const uint32_t tree = tree_of_instance_[instances[m]];
    if (tree == baked::kNone) return;
    moved_unit_from_grid_[m] = unit_from_grid(tree, world_from_object[m]);
    const std::optional<TreeHull>& hull = trees_->hulls[tree];
    if (!hull || within_traced_space(moved_unit_from_grid_[m], hull->lo(), hull->hi())) return;
    size_t first = outside.load();
    while (m < first && !outside.compare_exchange_weak(first, m)) {
    }
  });
  if (outside.load() < instances.size()) throw_out_of_space(instances[outside.load()]);
}

void PlacedTrees::build_top() {
  top_.clear();
  stream_depth_ = 0;
  if (placements_.size() < 2) return;
  stream_depth_ = builder_.build(boxes_, top_);
  if (top_.size() == 1) stream_depth_ = 0;
  describe_top();
}

/// Describes the tree over placements as a tree placed in unit space.
void PlacedTrees::describe_top() {
  float max_coordinate = 0.0f; // of the grids of aligned placements
  for (size_t p = 0; p < placements_.size(); ++p) {
    if (placements_[p].aligned == 0) continue;
    const double in_grid = trees_->trees[placements_[p].tree].max_coordinate;
    const DAffine& unit_from_grid = surface(example_of_[p]).unit_from_surface;
    for (int axis = 0; axis < 3; ++axis)
      max_coordinate = std::max(max_coordinate, static_cast<float>(in_grid * std::abs(unit_from_grid[axis][axis])));
  }
  TreeBox all = boxes_[0];
  for (const TreeBox& box : boxes_) all.extend(box);
  top_placement_ = {};
  top_placement_.aligned = 1;
  for (size_t axis = 0; axis < 3; ++axis) {
    top_placement_.grid_from_unit[3 * axis + axis] = 1.0;
    top_placement_.box_lo[axis] = all.lo[axis], top_placement_.box_hi[axis] = all.hi[axis];
    max_coordinate = std::max({max_coordinate, std::abs(all.lo[axis]), std::abs(all.hi[axis])});
  }
  top_max_coordinate_ = max_coordinate;
  const bool parts = boxes_.size() <= kMaxPlacementsWithParts; // boxes are not enlarged then
  top_pad_coordinate_ = (parts ? 1.0f : packed::kMinTopPad) * max_coordinate;
}

void PlacedTrees::fill_in(packed::KernelScene& scene) const {
  scene.placements = placements_.data();
  scene.placement_count = static_cast<uint32_t>(placements_.size());
  scene.top_nodes = top_.empty() ? nullptr : top_.data();
  scene.parts = !top_.empty() && placements_.size() <= kMaxPlacementsWithParts ? parts_.data() : nullptr;
  scene.top = top_placement_;
  scene.top_max_coordinate = top_max_coordinate_;
  scene.top_pad_coordinate = top_pad_coordinate_;
}

uint64_t PlacedTrees::bytes() const {
  return placements_.size() * (sizeof(packed::TracePlacement) + sizeof(TreeBox) + 2 * sizeof(uint32_t)) +
         surfaces_.size() * sizeof(Placement) + tree_of_instance_.size() * (2 * sizeof(uint32_t) + sizeof(uint8_t)) +
         (top_.size() + parts_.size()) * sizeof(packed::TopNode) + movable_.size() * sizeof(uint8_t) +
         world_from_object_.size() * sizeof(Affine) + placement_of_.size() * sizeof(uint32_t) +
         moved_unit_from_grid_.capacity() * sizeof(DAffine) + builder_.bytes();
}

} // namespace packtrace
