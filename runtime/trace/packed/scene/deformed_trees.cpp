#include "runtime/trace/packed/scene/deformed_trees.h"

#include <algorithm>
#include <string>

#include "pbrt_import/base/error.h"

namespace packtrace {

DeformedTrees::DeformedTrees(const BakedFile& file, std::span<const DeformingGeometry> deforming,
                             const DeformConfig& config, const TracedTrees& traced) {
  config.validate();
  if (deforming.empty()) return;
  trees_.resize(traced.tree_of.size()), updates_.resize(trees_.size());
  for (const DeformingGeometry& one : deforming) {
    if (one.geometry >= trees_.size() || trees_[one.geometry] != nullptr)
      throw Error(ErrorKind::kInput,
                  "deforming geometry " + std::to_string(one.geometry) + " does not exist, or is given twice");
    const uint32_t number = traced.tree_of[one.geometry];
    if (number == baked::kNone || traced.records[number].geometry != one.geometry)
      throw Error(ErrorKind::kInput, "deforming geometry " + std::to_string(one.geometry) +
                                         " has no tree of its own: it is empty, or fixed in the world");
    const baked::GeometryRecord& geometry = file.geometries()[one.geometry];
    const baked::TreeRecord& record = traced.records[number];
    geometries_.push_back(one.geometry);
    trees_[one.geometry] = std::make_unique<DeformedTree>(
        file, one, record, traced.nodes.subspan(static_cast<size_t>(record.first_node), record.node_count),
        traced.clusters().subspan(static_cast<size_t>(geometry.first_cluster), geometry.cluster_count), config);
  }
}

const DeformedTree* DeformedTrees::find(uint32_t geometry) const {
  return geometry < trees_.size() ? trees_[geometry].get() : nullptr;
}

DeformStep DeformedTrees::update(const DeformedFrame& frame) {
  if (find(frame.geometry) == nullptr)
    throw Error(ErrorKind::kInput, "geometry " + std::to_string(frame.geometry) + " does not deform");
  ++updates_[frame.geometry];
  return trees_[frame.geometry]->update(*frame.vertices);
}

uint64_t DeformedTrees::bytes() const {
  uint64_t bytes = 0;
  for (const auto& tree : trees_)
    if (tree != nullptr) bytes += tree->bytes();
  return bytes;
}

void show_deformed(const DeformedTree& tree, uint32_t number, size_t first_cluster,
                   std::span<baked::TreeRecord> records, TracedTrees& traced) {
  records[number] = tree.record();
  if (!tree.nodes().empty()) {
    const TreeHull hull(tree.nodes().data());
    traced.trees[number] = trace_tree(tree.nodes(), hull);
    if (number < traced.hulls.size()) traced.hulls[number] = hull;
  }
  std::ranges::copy(tree.clusters(), traced.clusters().begin() + static_cast<ptrdiff_t>(first_cluster));
}

} // namespace packtrace
