#include "compress/format/trees/box_tree.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstring>
#include <utility>

#include <tbb/parallel_invoke.h>

#include "compress/format/trees/bin_kernels.h"

namespace packtrace {
namespace {

constexpr uint32_t kParallelCount = 2048; // smaller subtrees are built serially

/// Twice the centre of a box along an axis.
double centre(const TreeBox& box, size_t axis) { return double{box.lo[axis]} + box.hi[axis]; }

/// Splits runs of boxes in two.
class Splitter {
public:
  /// @param unit number of boxes per leaf: any count up to it costs as much as one leaf
  explicit Splitter(std::span<const TreeBox> boxes, uint32_t unit = 1) : boxes_(boxes), unit_(unit) {}

  /// Returns the bounds of the boxes' centres. `whole` receives the bounds of the boxes.
  TreeBox measure(std::span<uint32_t> order, TreeBox& whole) const {
    bin_kernels::RunBounds bounds;
    kernels_.measure(run(order), bounds);
    TreeBox centres;
    static_assert(sizeof whole == sizeof bounds.boxes && sizeof centres == sizeof bounds.centres);
    std::memcpy(&whole, bounds.boxes, sizeof whole);
    std::memcpy(&centres, bounds.centres, sizeof centres);
    return centres;
  }

  /// Partitions the boxes into left and right; returns the number on the left, 1 .. count - 1.
  uint32_t split(std::span<uint32_t> order, const TreeBox& centres, uint32_t levels) const {
    const auto count = static_cast<uint32_t>(order.size());
    // A subtree of k levels holds up to 2^(k - 1) boxes. If a child with levels - 1 levels might not hold all boxes but
    // one, only halving is sure to keep the depth limit.
    const bool must_halve = static_cast<uint32_t>(std::bit_width(count - 1)) + 1 >= levels;
    if (!must_halve) {
      bin_kernels::Bins bins;
      bins.count = std::min(bin_kernels::kMaxBins, 2 * count);
      for (size_t axis = 0; axis < 3; ++axis) {
        bins.low[axis] = 2.0 * centres.lo[axis];
        const double extent = 2.0 * (double{centres.hi[axis]} - centres.lo[axis]);
        bins.scale[axis] = extent > 0.0 ? bins.count / extent : 0.0;
      }
      if (const uint32_t left = kernels_.split(run(order), bins, unit_); left > 0) return left;
    }
    halve(order, centres);
    return count / 2;
  }

private:
  bin_kernels::Run run(std::span<uint32_t> order) const {
    static_assert(sizeof(TreeBox) == 6 * sizeof(float));
    return {reinterpret_cast<const float*>(boxes_.data()), order.data(), static_cast<uint32_t>(order.size())};
  }

  /// Moves the half with the lower centres along the longest axis to the left.
  void halve(std::span<uint32_t> order, const TreeBox& centres) const {
    size_t axis = 0;
    for (size_t a = 1; a < 3; ++a)
      if (double{centres.hi[a]} - centres.lo[a] > double{centres.hi[axis]} - centres.lo[axis]) axis = a;
    const auto key = [&](uint32_t i) { return std::pair(centre(boxes_[i], axis), i); };
    std::nth_element(order.begin(), order.begin() + static_cast<ptrdiff_t>(order.size() / 2), order.end(),
                     [&](uint32_t a, uint32_t b) { return key(a) < key(b); });
  }

  std::span<const TreeBox> boxes_;
  const bin_kernels::Kernels& kernels_ = bin_kernels::kernels();
  const uint32_t unit_;
};

class Builder {
public:
  Builder(std::span<const TreeBox> boxes, BoxTree& tree) : splitter_(boxes), tree_(tree) {}

  /// Builds the subtree at `node` over order[first .. first + count), with at most `levels` levels.
  void build(uint32_t node, uint32_t first, uint32_t count, uint32_t levels) {
    BoxTreeNode& out = tree_.nodes[node];
    out.first = first, out.count = count, out.right = 0;
    const std::span<uint32_t> order = std::span(tree_.order).subspan(first, count);
    const TreeBox centres = splitter_.measure(order, out.box);
    if (count == 1) return;
    const uint32_t left = splitter_.split(order, centres, levels);
    const uint32_t right = out.right = node + 2 * left;
    const auto build_left = [=, this] { build(node + 1, first, left, levels - 1); };
    const auto build_right = [=, this] { build(right, first + left, count - left, levels - 1); };
    if (count >= kParallelCount) {
      tbb::parallel_invoke(build_left, build_right);
    } else {
      build_left();
      build_right();
    }
  }

private:
  const Splitter splitter_;
  BoxTree& tree_;
};

std::vector<uint32_t> counted(size_t count) {
  std::vector<uint32_t> order(count);
  for (uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  return order;
}

/// Cuts boxes into subtrees of a limited size.
class Cutter {
public:
  Cutter(std::span<const TreeBox> boxes, uint32_t max_count, std::vector<uint32_t>& order)
      : splitter_(boxes, max_count), max_count_(max_count), order_(order) {}

  /// Appends the ends of the subtrees of order[first .. first + count) to `ends`.
  void cut(uint32_t first, uint32_t count, uint32_t levels, std::vector<uint32_t>& ends) const {
    if (count <= max_count_) return ends.push_back(first + count);
    const std::span<uint32_t> numbers = std::span(order_).subspan(first, count);
    TreeBox whole;
    const TreeBox centres = splitter_.measure(numbers, whole);
    const uint32_t left = splitter_.split(numbers, centres, levels);
    const auto cut_left = [&] { cut(first, left, levels - 1, ends); };
    if (count < kParallelCuts) {
      cut_left();
      return cut(first + left, count - left, levels - 1, ends);
    }
    std::vector<uint32_t> right_ends;
    tbb::parallel_invoke(cut_left, [&] { cut(first + left, count - left, levels - 1, right_ends); });
    ends.insert(ends.end(), right_ends.begin(), right_ends.end());
  }

private:
  static constexpr uint32_t kParallelCuts = 1u << 14; // smaller runs are cut serially
  const Splitter splitter_;
  const uint32_t max_count_;
  std::vector<uint32_t>& order_;
};

} // namespace

BoxTree build_box_tree(std::span<const TreeBox> boxes, uint32_t max_depth) {
  assert(boxes.size() < uint64_t{1} << 31 && max_depth >= 33);
  BoxTree tree;
  if (boxes.empty()) return tree;
  tree.nodes.resize(2 * boxes.size() - 1);
  tree.order = counted(boxes.size());
  Builder(boxes, tree).build(0, 0, static_cast<uint32_t>(boxes.size()), max_depth);
  return tree;
}

std::vector<uint32_t> cut_boxes(std::span<const TreeBox> boxes, uint32_t max_count, std::vector<uint32_t>& order) {
  assert(boxes.size() < uint64_t{1} << 31 && max_count > 0);
  order = counted(boxes.size());
  std::vector<uint32_t> ends;
  if (!boxes.empty())
    Cutter(boxes, max_count, order).cut(0, static_cast<uint32_t>(boxes.size()), kDefaultTreeDepth, ends);
  return ends;
}

} // namespace packtrace
