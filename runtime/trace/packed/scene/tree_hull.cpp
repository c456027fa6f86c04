#include "runtime/trace/packed/scene/tree_hull.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace packtrace {
namespace {

using Double2 = double __attribute__((vector_size(16)));

Double2 load(const double* values) {
  Double2 result;
  std::memcpy(&result, values, sizeof(result));
  return result;
}

struct Child {
  DVec3 lo, hi;
  uint32_t node; ///< number of the node; 0 for a leaf
};

std::vector<Child> children(const baked::PackedNode& node) {
  std::vector<Child> result;
  for (uint32_t slot = 0; slot < baked::kNodeWidth && node.children[slot] != baked::kNoChild; ++slot) {
    Child child;
    child.node = node.has_leaves() ? 0 : node.first_child + slot;
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const double unit = std::ldexp(1.0, static_cast<int>(node.exponent(axis)));
      child.lo[static_cast<int>(axis)] = node.origin[axis] + node.lo[axis][slot] * unit;
      child.hi[static_cast<int>(axis)] = node.origin[axis] + node.hi[axis][slot] * unit;
    }
    result.push_back(child);
  }
  return result;
}

} // namespace

TreeHull::TreeHull(const baked::PackedNode* nodes)
    : lo_(std::numeric_limits<double>::infinity()), hi_(-std::numeric_limits<double>::infinity()) {
  for (const Child& child : children(nodes[0])) {
    lo_ = glm::min(lo_, child.lo), hi_ = glm::max(hi_, child.hi);
    const std::vector<Child> boxes = child.node == 0 ? std::vector{child} : children(nodes[child.node]);
    for (const Child& box : boxes)
      for (int axis = 0; axis < 3; ++axis) {
        centre_[axis].push_back(0.5 * (box.lo[axis] + box.hi[axis]));
        half_[axis].push_back(0.5 * (box.hi[axis] - box.lo[axis]));
      }
    ends_.push_back(centre_[0].size());
  }
}

double TreeHull::pad() const {
  // Rays have errors of up to 2^-22 of the largest coordinate in the grid (ray_group.h); this is four times that.
  const DVec3 far = glm::max(glm::abs(lo_), glm::abs(hi_));
  return 0x1p-20 * std::max({far.x, far.y, far.z});
}

TreeBox TreeHull::placed(const DAffine& unit_from_grid) const {
  return placed(unit_from_grid, pad(), 0, centre_[0].size());
}

std::vector<TreeBox> TreeHull::placed_parts(const DAffine& unit_from_grid, bool aligned) const {
  std::vector<TreeBox> parts;
  size_t begin = 0;
  for (const size_t end : ends_) {
    parts.push_back(placed(unit_from_grid, aligned ? 0.0 : pad(), begin, end));
    begin = end;
  }
  return parts;
}

TreeBox TreeHull::placed(const DAffine& unit_from_grid, double pad, size_t begin, size_t end) const {
  constexpr double kInf = std::numeric_limits<double>::infinity();
  Double2 lo[3], hi[3]; // by axis, of every other box each
  std::fill_n(lo, 3, Double2{kInf, kInf});
  std::fill_n(hi, 3, Double2{-kInf, -kInf});
  const glm::dmat3 linear(unit_from_grid), size(glm::abs(linear[0]), glm::abs(linear[1]), glm::abs(linear[2]));
  for (size_t i = begin; i < end; i += 2) {
    const auto two = [&](const std::vector<double>& of) { // the last of an odd number counts twice
      return i + 1 < end ? load(&of[i]) : Double2{of[i], of[i]};
    };
    const Double2 centre[3] = {two(centre_[0]), two(centre_[1]), two(centre_[2])};
    const Double2 half[3] = {two(half_[0]), two(half_[1]), two(half_[2])};
    for (int axis = 0; axis < 3; ++axis) {
      const Double2 middle = linear[0][axis] * centre[0] + linear[1][axis] * centre[1] + linear[2][axis] * centre[2];
      const Double2 reach = size[0][axis] * half[0] + size[1][axis] * half[1] + size[2][axis] * half[2];
      const Double2 low = middle - reach, high = middle + reach;
      lo[axis] = low < lo[axis] ? low : lo[axis];
      hi[axis] = high > hi[axis] ? high : hi[axis];
    }
  }
  TreeBox box;
  for (int axis = 0; axis < 3; ++axis) {
    const double offset = unit_from_grid[3][axis], beyond = pad * (size[0][axis] + size[1][axis] + size[2][axis]);
    box.lo[static_cast<size_t>(axis)] =
        std::nextafter(static_cast<float>(offset + std::min(lo[axis][0], lo[axis][1]) - beyond), -INFINITY);
    box.hi[static_cast<size_t>(axis)] =
        std::nextafter(static_cast<float>(offset + std::max(hi[axis][0], hi[axis][1]) + beyond), INFINITY);
  }
  return box;
}

} // namespace packtrace
