#include "compress/format/trees/box_tree.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <limits>
#include <utility>

#include <tbb/parallel_invoke.h>

namespace packtrace {
namespace {

constexpr uint32_t kMaxBins = 64;
constexpr uint32_t kParallelCount = 2048; // smaller subtrees are built serially

TreeBox empty_box() {
  constexpr float kInf = std::numeric_limits<float>::infinity();
  return {{kInf, kInf, kInf}, {-kInf, -kInf, -kInf}};
}

/// Twice the centre of a box along an axis.
double centre(const TreeBox& box, size_t axis) { return double{box.lo[axis]} + box.hi[axis]; }

struct Split {
  double cost = std::numeric_limits<double>::infinity();
  size_t axis = 0;
  uint32_t bin = 0; ///< the first bin on the right
};

/// Maps centres along one axis to bins.
struct BinAxis {
  double low = 0.0, scale = 0.0; ///< scale is 0 if all centres are equal
  uint32_t bins = 0;

  uint32_t operator()(double place) const {
    const auto bin = static_cast<uint32_t>((place - low) * scale); // not negative
    return std::min(bin, bins - 1);
  }
};

/// Splits runs of boxes in two.
class Splitter {
public:
  /// @param unit number of boxes per leaf: any count up to it costs as much as one leaf
  explicit Splitter(std::span<const TreeBox> boxes, uint32_t unit = 1) : boxes_(boxes), unit_(unit) {}

  /// Returns the bounds of the boxes' centres. `whole` receives the bounds of the boxes.
  TreeBox measure(std::span<const uint32_t> order, TreeBox& whole) const {
    whole = empty_box();
    TreeBox centres = empty_box();
    for (const uint32_t i : order) {
      const TreeBox& box = boxes_[i];
      whole.extend(box);
      for (size_t axis = 0; axis < 3; ++axis) {
        const auto place = static_cast<float>(0.5 * centre(box, axis));
        centres.lo[axis] = std::min(centres.lo[axis], place), centres.hi[axis] = std::max(centres.hi[axis], place);
      }
    }
    return centres;
  }

  /// Partitions the boxes into left and right; returns the number on the left, 1 .. count - 1.
  uint32_t split(std::span<uint32_t> order, const TreeBox& centres, uint32_t levels) const {
    const auto count = static_cast<uint32_t>(order.size());
    // A subtree of k levels holds up to 2^(k - 1) boxes. If a child with levels - 1 levels might not hold all boxes but
    // one, only halving is sure to keep the depth limit.
    const bool must_halve = static_cast<uint32_t>(std::bit_width(count - 1)) + 1 >= levels;
    if (!must_halve) {
      std::array<BinAxis, 3> axes;
      for (size_t axis = 0; axis < 3; ++axis) {
        axes[axis].bins = std::min(kMaxBins, 2 * count);
        axes[axis].low = 2.0 * centres.lo[axis];
        const double extent = 2.0 * (double{centres.hi[axis]} - centres.lo[axis]);
        axes[axis].scale = extent > 0.0 ? axes[axis].bins / extent : 0.0;
      }
      Split best;
      for (size_t axis = 0; axis < 3; ++axis)
        if (axes[axis].scale > 0.0) find_split(order, axes[axis], axis, best);
      if (best.bin > 0) {
        const auto middle = std::partition(order.begin(), order.end(), [&](uint32_t i) {
          return axes[best.axis](rounded_centre(boxes_[i], best.axis)) < best.bin;
        });
        return static_cast<uint32_t>(middle - order.begin());
      }
    }
    halve(order, centres);
    return count / 2;
  }

private:
  static double rounded_centre(const TreeBox& box, size_t axis) {
    return 2.0 * double{static_cast<float>(0.5 * centre(box, axis))};
  }

  void find_split(std::span<const uint32_t> order, const BinAxis& bins, size_t axis, Split& best) const {
    std::array<TreeBox, kMaxBins> boxes;
    std::array<uint32_t, kMaxBins> counts;
    std::fill_n(counts.begin(), bins.bins, 0u);
    for (uint32_t b = 0; b < bins.bins; ++b) boxes[b] = empty_box();
    for (const uint32_t i : order) {
      const uint32_t b = bins(rounded_centre(boxes_[i], axis));
      boxes[b].extend(boxes_[i]);
      ++counts[b];
    }
    std::array<double, kMaxBins> right_cost; // of bins b and above, for b > 0
    TreeBox box = empty_box();
    for (uint32_t b = bins.bins, n = 0; b-- > 1;) {
      if (counts[b] > 0) box.extend(boxes[b]), n += counts[b];
      right_cost[b] = n > 0 ? box.half_area() * units(n) : -1.0;
    }
    box = empty_box();
    for (uint32_t b = 1, n = 0; b < bins.bins; ++b) {
      if (counts[b - 1] > 0) box.extend(boxes[b - 1]), n += counts[b - 1];
      if (n == 0 || right_cost[b] < 0.0) continue;
      const double cost = box.half_area() * units(n) + right_cost[b];
      if (cost < best.cost) best = {cost, axis, b};
    }
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

  double units(uint32_t count) const { return unit_ == 1 ? count : (count + unit_ - 1) / unit_; }

  std::span<const TreeBox> boxes_;
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
} // namespace

BoxTree build_box_tree(std::span<const TreeBox> boxes, uint32_t max_depth) {
  assert(boxes.size() <= uint64_t{1} << 31 && max_depth >= 33);
  BoxTree tree;
  if (boxes.empty()) return tree;
  tree.nodes.resize(2 * boxes.size() - 1);
  tree.order = counted(boxes.size());
  Builder(boxes, tree).build(0, 0, static_cast<uint32_t>(boxes.size()), max_depth);
  return tree;
}

std::vector<uint32_t> cut_boxes(std::span<const TreeBox> boxes, uint32_t max_count, std::vector<uint32_t>& order) {
  assert(boxes.size() <= uint64_t{1} << 31 && max_count > 0);
  struct Run {
    uint32_t first, count, levels;
  };
  order = counted(boxes.size());
  std::vector<uint32_t> ends;
  std::vector<Run> waiting;
  if (!boxes.empty()) waiting.push_back({0, static_cast<uint32_t>(boxes.size()), kDefaultTreeDepth});
  const Splitter splitter(boxes, max_count);
  while (!waiting.empty()) {
    const Run run = waiting.back();
    waiting.pop_back();
    if (run.count <= max_count) {
      ends.push_back(run.first + run.count);
      continue;
    }
    const std::span<uint32_t> numbers = std::span(order).subspan(run.first, run.count);
    TreeBox whole;
    const TreeBox centres = splitter.measure(numbers, whole);
    const uint32_t left = splitter.split(numbers, centres, run.levels);
    waiting.push_back({run.first + left, run.count - left, run.levels - 1});
    waiting.push_back({run.first, left, run.levels - 1});
  }
  return ends;
}

} // namespace packtrace
