#pragma once

#include <cstddef>
#include <cstdint>

#include "compress/format/layout/packed_node.h"

namespace packtrace::packed {
namespace {

/// PackedNode::children as one 64-bit integer; byte i is slot i.
struct NodeChildren {
  uint64_t bytes;

  explicit NodeChildren(const baked::PackedNode& node) {
    __builtin_memcpy(&bytes, reinterpret_cast<const uint8_t*>(&node) + offsetof(baked::PackedNode, children),
                     sizeof bytes);
  }
  bool leaves() const { return (bytes & 0xffu) != baked::kInnerChild; }
  /// Bit mask of the slots in use; used slots come first.
  uint32_t slots() const { return bytes == 0 ? 0u : 0xffu >> (static_cast<uint32_t>(__builtin_clzll(bytes)) / 8); }
  /// Byte i of the result: number of triangles in the leaves of slots 0 to i - 1; at most 128.
  uint64_t leaf_begins() const { return bytes * 0x0101010101010100u; }
};

inline uint32_t byte_of(uint64_t word, uint32_t slot) { return static_cast<uint32_t>(word >> (8 * slot)) & 0xffu; }

} // namespace
} // namespace packtrace::packed
