#include "runtime/trace/packed/scene/top_tree_builder.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <limits>
#include <utility>

#include <tbb/parallel_for.h>

namespace packtrace {
namespace {

constexpr uint32_t kBins = 16, kFewBins = 8;
constexpr uint32_t kFewBoxes = 32; // runs up to this size have kFewBins
/// Axes along which the centres are closer together than this share of the largest extent are not considered.
constexpr float kMinExtent = 0.25f;
constexpr uint32_t kParallelCount = 512; // smaller subtrees are built serially

using Float4 = float __attribute__((vector_size(16)));
using Int4 = int32_t __attribute__((vector_size(16)));

Float4 smaller(Float4 a, Float4 b) { return a < b ? a : b; }
Float4 larger(Float4 a, Float4 b) { return a > b ? a : b; }

float half_area(Float4 lo, Float4 hi) {
  const Float4 size = hi - lo;
  const Float4 faces = size * Float4{size[1], size[2], size[0], size[3]};
  return faces[0] + faces[1] + faces[2];
}

/// Maps doubled centres to bins.
struct BinScale {
  Float4 low, scale; ///< scale is 0 along axes that are not considered
  int32_t last;      ///< the last bin

  int32_t operator()(float centre, uint32_t axis) const {
    return std::min(static_cast<int32_t>((centre - low[axis]) * scale[axis]), last);
  }
};

} // namespace

TopTreeBuilder::Run TopTreeBuilder::Run::empty(uint32_t first) {
  constexpr float kInf = std::numeric_limits<float>::infinity();
  return {first, 0, Float4{kInf, kInf, kInf, kInf}, Float4{-kInf, -kInf, -kInf, -kInf}, 0.0f};
}

void TopTreeBuilder::Run::extend(Float4 box_lo, Float4 box_hi) { lo = smaller(lo, box_lo), hi = larger(hi, box_hi); }

void TopTreeBuilder::Run::finish() { area = half_area(lo, hi); }

/// Bounds and counts of the boxes in each bin of each axis.
struct TopTreeBuilder::Bins {
  Bins(std::span<const Box> boxes, const BinScale& bin_of) : bins(static_cast<uint32_t>(bin_of.last) + 1) {
    const Run none = Run::empty(0);
    for (uint32_t axis = 0; axis < 3; ++axis)
      for (uint32_t b = 0; b < bins; ++b) lo[axis][b] = none.lo, hi[axis][b] = none.hi, counts[axis][b] = 0;
    uint32_t axes[3], axis_count = 0;
    for (uint32_t axis = 0; axis < 3; ++axis)
      if (bin_of.scale[axis] > 0.0f) axes[axis_count++] = axis;
    for (const Box& box : boxes) {
      const Int4 bin = __builtin_convertvector((box.lo + box.hi - bin_of.low) * bin_of.scale, Int4);
      for (uint32_t i = 0; i < axis_count; ++i) {
        const uint32_t axis = axes[i];
        const int32_t b = std::min(bin[axis], bin_of.last);
        lo[axis][b] = smaller(lo[axis][b], box.lo), hi[axis][b] = larger(hi[axis][b], box.hi);
        ++counts[axis][b];
      }
    }
  }

  /// Improves the split at `cost`: the first bin on the right. Returns false if no split of the axis is better.
  bool improve(uint32_t axis, float& cost, uint32_t& first_right) const {
    std::array<float, kBins> above; // cost of bins b and above; negative if they are empty
    Run run = Run::empty(0);
    for (uint32_t b = bins; b-- > 1;) {
      add(run, axis, b);
      above[b] = run.count > 0 ? half_area(run.lo, run.hi) * static_cast<float>(run.count) : -1.0f;
    }
    bool better = false;
    run = Run::empty(0);
    for (uint32_t b = 1; b < bins; ++b) {
      add(run, axis, b - 1);
      if (run.count == 0 || above[b] < 0.0f) continue;
      const float sum = half_area(run.lo, run.hi) * static_cast<float>(run.count) + above[b];
      if (sum < cost) cost = sum, first_right = b, better = true;
    }
    return better;
  }

  /// Returns the bounds and the count of the boxes in bins [begin, end).
  Run merged(uint32_t axis, uint32_t begin, uint32_t end) const {
    Run run = Run::empty(0);
    for (uint32_t b = begin; b < end; ++b) add(run, axis, b);
    run.finish();
    return run;
  }

  const uint32_t bins;

private:
  void add(Run& run, uint32_t axis, uint32_t b) const {
    run.extend(lo[axis][b], hi[axis][b]);
    run.count += counts[axis][b];
  }

  Float4 lo[3][kBins], hi[3][kBins];
  uint32_t counts[3][kBins];
};

packed::TopNode top_node(std::span<const TreeBox> boxes) {
  packed::TopNode node{};
  for (uint32_t slot = 0; slot < boxes.size(); ++slot) {
    for (size_t axis = 0; axis < 3; ++axis)
      node.lo[axis][slot] = boxes[slot].lo[axis], node.hi[axis][slot] = boxes[slot].hi[axis];
    node.child[slot] = packed::kTopLeaf + slot;
    node.slots |= 1u << slot;
  }
  return node;
}

uint32_t TopTreeBuilder::build(std::span<const TreeBox> boxes, std::vector<packed::TopNode>& nodes) {
  assert(boxes.size() >= 2 && boxes.size() < uint64_t{1} << 31);
  const auto count = static_cast<uint32_t>(boxes.size());
  boxes_.resize(count);
  scattered_.resize(count);
  for (uint32_t i = 0; i < count; ++i) {
    const TreeBox& box = boxes[i];
    boxes_[i].lo = Float4{box.lo[0], box.lo[1], box.lo[2], 0.0f};
    boxes_[i].hi = Float4{box.hi[0], box.hi[1], box.hi[2], 0.0f};
    boxes_[i].number = i;
  }
  build_node(bounded(0, count), 0, packed::kMaxTopDepth);
  return gather(nodes);
}

/// Builds the subtree over a run, whose nodes are scattered_[place] and following.
/// @param levels maximum number of levels of nodes
void TopTreeBuilder::build_node(const Run& run, uint32_t place, uint32_t levels) {
  std::array<Run, baked::kNodeWidth> children;
  uint32_t child_count = 1;
  children[0] = run;
  // k levels hold 8^k boxes. If a child with levels - 1 levels might not hold all boxes, only halving is sure to keep
  // the limit.
  const bool by_area = static_cast<uint32_t>(std::bit_width(run.count - 1)) <= 3 * (levels - 1);
  const bool last = run.count <= baked::kNodeWidth;
  while (!last && child_count < baked::kNodeWidth) {
    const auto widest =
        std::max_element(children.begin(), children.begin() + child_count, [&](const Run& a, const Run& b) {
          if ((a.count > 1) != (b.count > 1)) return b.count > 1;
          return by_area ? a.area < b.area : a.count < b.count;
        });
    Run left, right;
    split(*widest, by_area, left, right);
    *widest = left;
    children[child_count++] = right;
  }
  if (last)
    for (child_count = 0; child_count < run.count; ++child_count)
      children[child_count] = bounded(run.first + child_count, 1);

  packed::TopNode& node = scattered_[place];
  node.slots = (1u << child_count) - 1;
  std::array<uint32_t, baked::kNodeWidth> places{};
  uint32_t next = place + 1;
  for (uint32_t slot = 0; slot < child_count; ++slot) {
    const Run& child = children[slot];
    for (uint32_t axis = 0; axis < 3; ++axis)
      node.lo[axis][slot] = child.lo[axis], node.hi[axis][slot] = child.hi[axis];
    node.child[slot] = child.count == 1 ? packed::kTopLeaf + boxes_[child.first].number : next;
    places[slot] = next;
    next += child.count - 1;
  }
  const auto build_child = [&](uint32_t slot) {
    if (children[slot].count > 1) build_node(children[slot], places[slot], levels - 1);
  };
  if (run.count >= kParallelCount)
    tbb::parallel_for(0u, child_count, build_child);
  else
    for (uint32_t slot = 0; slot < child_count; ++slot) build_child(slot);
}

void TopTreeBuilder::split(const Run& run, bool by_area, Run& left, Run& right) {
  if (!by_area || !split_by_area(run, left, right)) halve(run, left, right);
}

/// Returns false if no plane separates the centres of the boxes.
bool TopTreeBuilder::split_by_area(const Run& run, Run& left, Run& right) {
  const std::span boxes(boxes_.data() + run.first, run.count);
  if (run.count == 2) {
    left = bounded(run.first, 1), right = bounded(run.first + 1, 1);
    return true;
  }
  Run centres = Run::empty(0);
  for (const Box& box : boxes) centres.extend(box.lo + box.hi, box.lo + box.hi);
  BinScale bin_of{centres.lo, Float4{}, static_cast<int32_t>(run.count <= kFewBoxes ? kFewBins : kBins) - 1};
  const Float4 extents = centres.hi - centres.lo;
  const float least = kMinExtent * std::max({extents[0], extents[1], extents[2]});
  for (uint32_t axis = 0; axis < 3; ++axis) {
    const float extent = extents[axis];
    const float scale = extent > 0.0f && extent >= least ? static_cast<float>(bin_of.last + 1) / extent : 0.0f;
    bin_of.scale[axis] = scale <= std::numeric_limits<float>::max() ? scale : 0.0f;
  }
  const Bins bins(boxes, bin_of);
  float cost = std::numeric_limits<float>::infinity();
  uint32_t axis = 0, first_right = 0;
  for (uint32_t a = 0; a < 3; ++a)
    if (bin_of.scale[a] > 0.0f && bins.improve(a, cost, first_right)) axis = a;
  if (first_right == 0) return false;
  left = bins.merged(axis, 0, first_right), right = bins.merged(axis, first_right, bins.bins);
  std::partition(boxes.begin(), boxes.end(), [&](const Box& box) {
    return bin_of(box.lo[axis] + box.hi[axis], axis) < static_cast<int32_t>(first_right);
  });
  left.first = run.first, right.first = run.first + left.count;
  return true;
}

/// Moves the half with the lower centres along the longest axis to the left.
void TopTreeBuilder::halve(const Run& run, Run& left, Run& right) {
  uint32_t axis = 0;
  for (uint32_t a = 1; a < 3; ++a)
    if (run.hi[a] - run.lo[a] > run.hi[axis] - run.lo[axis]) axis = a;
  const auto key = [&](const Box& box) { return std::pair(box.lo[axis] + box.hi[axis], box.number); };
  const uint32_t count = run.count / 2;
  const auto first = boxes_.begin() + run.first;
  std::nth_element(first, first + count, first + run.count,
                   [&](const Box& a, const Box& b) { return key(a) < key(b); });
  left = bounded(run.first, count), right = bounded(run.first + count, run.count - count);
}

TopTreeBuilder::Run TopTreeBuilder::bounded(uint32_t first, uint32_t count) const {
  Run run = Run::empty(first);
  run.count = count;
  for (uint32_t i = first; i < first + count; ++i) run.extend(boxes_[i].lo, boxes_[i].hi);
  run.finish();
  return run;
}

/// Copies the scattered nodes without gaps, parents before children. Returns the levels of nodes.
uint32_t TopTreeBuilder::gather(std::vector<packed::TopNode>& nodes) {
  nodes.clear();
  waiting_.clear();
  waiting_.push_back({0, 0, 0, 1});
  uint32_t depth = 0;
  while (!waiting_.empty()) {
    const Waiting next = waiting_.back();
    waiting_.pop_back();
    const auto number = static_cast<uint32_t>(nodes.size());
    nodes.push_back(scattered_[next.scattered]);
    if (number > 0) nodes[next.parent].child[next.slot] = number;
    depth = std::max(depth, next.level);
    for (uint32_t slots = nodes[number].slots; slots != 0; slots &= slots - 1)
      if (const auto slot = static_cast<uint32_t>(std::countr_zero(slots));
          (nodes[number].child[slot] & packed::kTopLeaf) == 0)
        waiting_.push_back({nodes[number].child[slot], number, slot, next.level + 1});
  }
  return depth;
}

} // namespace packtrace
