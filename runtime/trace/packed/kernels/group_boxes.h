#pragma once

#include "runtime/trace/packed/kernels/ray_group.h"

/// Tests a node's boxes against rays of one octant; the node is unpacked once for all of them.
namespace packtrace::packed {
namespace {

constexpr uint32_t kBoundBytes = 24; ///< size of PackedNode::lo, and of PackedNode::hi, which follows it

inline float float_of_bits(uint32_t bits) {
  float x;
  __builtin_memcpy(&x, &bits, sizeof x);
  return x;
}

/// A node's planes along one axis: coordinate = origin + unit q for 8-bit q in near and far.
struct NodeAxis {
  float origin, unit;
  const uint8_t *near, *far;

  /// @param backward whether the rays move towards smaller coordinates: then near planes are in hi
  NodeAxis(const baked::PackedNode& node, uint32_t axis, bool backward) {
    const auto* bytes = reinterpret_cast<const uint8_t*>(&node);
    int32_t lattice;
    __builtin_memcpy(&lattice, bytes + 4 * axis, sizeof lattice);
    origin = static_cast<float>(lattice);
    unit = float_of_bits((((uint32_t{node.exponents} >> (5 * axis)) & 31u) + 127u) << 23);
    const uint8_t* bounds = bytes + offsetof(baked::PackedNode, lo) + 8 * axis;
    near = bounds + (backward ? kBoundBytes : 0);
    far = bounds + (backward ? 0 : kBoundBytes);
  }
};

/// Near and far planes of a node's children, in the tree's grid. The octant of the rays decides whether lo or hi is
/// near.
template <typename Lanes>
struct GroupBoxes {
  typename Lanes::F near[3], far[3];

  [[gnu::always_inline]] GroupBoxes(const baked::PackedNode& node, uint32_t octant) {
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const NodeAxis at(node, axis, ((octant >> axis) & 1u) != 0);
      const auto origin = Lanes::set(at.origin), unit = Lanes::set(at.unit);
      near[axis] = Lanes::fma(Lanes::load_bytes(at.near), unit, origin);
      far[axis] = Lanes::fma(Lanes::load_bytes(at.far), unit, origin);
    }
  }

  /// Moves all planes outwards.
  void enlarge(float pad, uint32_t octant) {
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const auto by = Lanes::set(((octant >> axis) & 1u) != 0 ? -pad : pad);
      near[axis] = Lanes::sub(near[axis], by);
      far[axis] = Lanes::add(far[axis], by);
    }
  }

  [[gnu::always_inline]] GroupBoxes(const TopNode& node, uint32_t octant) {
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const bool backward = ((octant >> axis) & 1u) != 0;
      near[axis] = Lanes::load(backward ? node.hi[axis] : node.lo[axis]);
      far[axis] = Lanes::load(backward ? node.lo[axis] : node.hi[axis]);
    }
  }
};

/// Ray/box tests with one child box per lane.
template <typename Lanes>
struct ChildRays {
  /// @param out output, per child: mask of those of `rays` that hit its box
  /// @return mask of the children that any ray hits
  [[gnu::always_inline]] static uint32_t pass(const GroupBoxes<Lanes>& boxes, const BoxRays& group, uint64_t rays,
                                              uint64_t (&out)[baked::kNodeWidth]) {
    typename Lanes::Masks masks;
    for (; rays != 0; rays &= rays - 1) {
      const auto ray = static_cast<uint32_t>(__builtin_ctzll(rays));
      // Negated ends, so that nothing that is read has to be negated.
      F begin = Lanes::set(group.limits[ray][0]), minus_end = Lanes::set(group.limits[ray][1]);
      for (uint32_t axis = 0; axis < 3; ++axis) {
        const F inverse = Lanes::set(group.inverse[axis][ray]);
        begin = Lanes::max(begin, Lanes::fma(boxes.near[axis], inverse, Lanes::set(group.bias[axis][ray][0])));
        minus_end = Lanes::max(minus_end, Lanes::fnma(boxes.far[axis], inverse, Lanes::set(group.bias[axis][ray][1])));
      }
      masks.add_less_equal(begin, Lanes::negate(minus_end), ray);
    }
    return masks.read(out);
  }

  /// Computes the t at which a ray enters each box.
  static void enter(const GroupBoxes<Lanes>& boxes, const BoxRays& group, uint32_t ray, float (&t)[baked::kNodeWidth]) {
    const auto at = [&](uint32_t axis) {
      return Lanes::fma(boxes.near[axis], Lanes::set(group.inverse[axis][ray]), Lanes::set(group.bias[axis][ray][0]));
    };
    Lanes::store(t, Lanes::max(Lanes::max(at(0), at(1)), at(2)));
  }

private:
  using F = typename Lanes::F;
};

} // namespace
} // namespace packtrace::packed
