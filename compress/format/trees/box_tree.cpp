#include "compress/format/trees/box_tree.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstring>
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

using Float4 = float __attribute__((vector_size(16)));
using Double4 = double __attribute__((vector_size(32)));
using Int4 = int32_t __attribute__((vector_size(16)));

/// A TreeBox in two overlapping vectors of its six floats, which extend without a loop over the axes.
struct BoxLanes {
  Float4 front; ///< low ends, then the first high end, which is not used
  Float4 back;  ///< the last low end, which is not used, then high ends

  BoxLanes() = default; // undefined, because most bins of short runs are never used
  explicit BoxLanes(const TreeBox& box) {
    static_assert(sizeof(TreeBox) == 24);
    const auto* const floats = reinterpret_cast<const char*>(&box);
    std::memcpy(&front, floats, sizeof front);
    std::memcpy(&back, floats + sizeof box - sizeof back, sizeof back);
  }
  void extend(const BoxLanes& other) {
    front = other.front < front ? other.front : front;
    back = other.back > back ? other.back : back;
  }
  TreeBox box() const {
    float floats[8];
    std::memcpy(floats, &front, sizeof front);
    std::memcpy(floats + 4, &back, sizeof back);
    return {{floats[0], floats[1], floats[2]}, {floats[5], floats[6], floats[7]}};
  }
  /// The centre along each axis, rounded to floats; the fourth lane is not used.
  Float4 centre() const {
    const Float4 high = __builtin_shufflevector(back, back, 1, 2, 3, 3);
    return __builtin_convertvector(
        (__builtin_convertvector(front, Double4) + __builtin_convertvector(high, Double4)) * 0.5, Float4);
  }
};

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
    BoxLanes all(empty_box());
    constexpr float kInf = std::numeric_limits<float>::infinity();
    Float4 lowest{kInf, kInf, kInf, kInf}, highest = -lowest;
    for (const uint32_t i : order) {
      const BoxLanes box(boxes_[i]);
      all.extend(box);
      const Float4 place = box.centre();
      lowest = place < lowest ? place : lowest;
      highest = place > highest ? place : highest;
    }
    whole = all.box();
    TreeBox centres;
    std::memcpy(centres.lo.data(), &lowest, sizeof centres.lo);
    std::memcpy(centres.hi.data(), &highest, sizeof centres.hi);
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
      const Split best = find_split(order, axes);
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

  /// Boxes of one axis by their bins.
  struct Bins {
    std::array<BoxLanes, kMaxBins> boxes;
    std::array<uint32_t, kMaxBins> counts;
  };

  Split find_split(std::span<const uint32_t> order, const std::array<BinAxis, 3>& axes) const {
    std::array<Bins, 3> bins;
    const BoxLanes empty(empty_box());
    for (size_t axis = 0; axis < 3; ++axis) {
      std::fill_n(bins[axis].boxes.begin(), axes[axis].bins, empty);
      std::fill_n(bins[axis].counts.begin(), axes[axis].bins, 0u);
    }
    const Double4 low{axes[0].low, axes[1].low, axes[2].low}, scale{axes[0].scale, axes[1].scale, axes[2].scale};
    for (const uint32_t i : order) {
      const BoxLanes box(boxes_[i]);
      const Double4 place = __builtin_convertvector(box.centre(), Double4) * 2.0;
      const Int4 number = __builtin_convertvector((place - low) * scale, Int4); // as BinAxis computes it
      std::array<int32_t, 4> numbers;
      std::memcpy(numbers.data(), &number, sizeof number);
      for (size_t axis = 0; axis < 3; ++axis) {
        const uint32_t b = std::min(static_cast<uint32_t>(numbers[axis]), axes[axis].bins - 1);
        bins[axis].boxes[b].extend(box);
        ++bins[axis].counts[b];
      }
    }
    Split best;
    for (size_t axis = 0; axis < 3; ++axis)
      if (axes[axis].scale > 0.0) sweep(bins[axis], axes[axis].bins, axis, best);
    return best;
  }

  /// Replaces `best` by the cheapest split between bins of an axis if that is cheaper.
  void sweep(const Bins& bins, uint32_t count, size_t axis, Split& best) const {
    std::array<double, kMaxBins> right_cost; // of bins b and above, for b > 0
    BoxLanes box(empty_box());
    for (uint32_t b = count, n = 0; b-- > 1;) {
      if (bins.counts[b] > 0) box.extend(bins.boxes[b]), n += bins.counts[b];
      right_cost[b] = n > 0 ? box.box().half_area() * units(n) : -1.0;
    }
    box = BoxLanes(empty_box());
    for (uint32_t b = 1, n = 0; b < count; ++b) {
      if (bins.counts[b - 1] > 0) box.extend(bins.boxes[b - 1]), n += bins.counts[b - 1];
      if (n == 0 || right_cost[b] < 0.0) continue;
      const double cost = box.box().half_area() * units(n) + right_cost[b];
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
  order = counted(boxes.size());
  std::vector<uint32_t> ends;
  if (!boxes.empty())
    Cutter(boxes, max_count, order).cut(0, static_cast<uint32_t>(boxes.size()), kDefaultTreeDepth, ends);
  return ends;
}

} // namespace packtrace
