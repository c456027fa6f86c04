#include "compress/format/node_writer.h"

#include <cassert>

namespace packtrace {

void write_boxes(std::span<const TreeGridBox> boxes, baked::PackedNode& node) {
  assert(!boxes.empty() && boxes.size() <= baked::kNodeWidth);
  TreeGridBox whole = boxes[0];
  for (const TreeGridBox& box : boxes) whole.extend(box);
  node.origin = whole.lo;
  node.exponents = 0;
  for (uint32_t axis = 0; axis < 3; ++axis) {
    const auto above = [&](int32_t p) { return static_cast<uint32_t>(int64_t{p} - whole.lo[axis]); };
    uint32_t exponent = 0;
    while (above(whole.hi[axis]) > 255u << exponent) ++exponent; // at most 23
    node.exponents = static_cast<uint16_t>(node.exponents | exponent << (5 * axis));
    node.lo[axis].fill(255);
    node.hi[axis].fill(0);
    for (size_t child = 0; child < boxes.size(); ++child) {
      node.lo[axis][child] = static_cast<uint8_t>(above(boxes[child].lo[axis]) >> exponent);
      node.hi[axis][child] = static_cast<uint8_t>((above(boxes[child].hi[axis]) + (1u << exponent) - 1) >> exponent);
    }
  }
}

} // namespace packtrace
