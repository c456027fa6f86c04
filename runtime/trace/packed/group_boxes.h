#pragma once

#include "runtime/trace/packed/grid_ray.h"

/// A node's boxes against many rays of one octant, with all of a node's work done once.
namespace packtrace::packed {
namespace {

/// Near and far planes of a node's children, in the grid; which of lo and hi are near is the rays' octant's.
template <typename Lanes>
struct GroupBoxes {
  typename Lanes::F near[3], far[3];

  GroupBoxes(const baked::PackedNode& node, const uint32_t (&near_at)[3]) {
    const auto* bytes = reinterpret_cast<const uint8_t*>(&node);
    const uint8_t* bounds = bytes + offsetof(baked::PackedNode, lo);
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const uint32_t exponent_bits = (((uint32_t{node.exponents} >> (5 * axis)) & 31u) + 127u) << 23;
      float unit;
      __builtin_memcpy(&unit, &exponent_bits, sizeof unit);
      int32_t origin;
      __builtin_memcpy(&origin, bytes + 4 * axis, sizeof origin);
      const auto at = Lanes::set(static_cast<float>(origin)), units = Lanes::set(unit);
      near[axis] = Lanes::fma(Lanes::load_bytes(bounds + near_at[axis]), units, at);
      far[axis] = Lanes::fma(Lanes::load_bytes(bounds + 16 * axis + kBoundBytes - near_at[axis]), units, at);
    }
  }

  GroupBoxes(const TopNode& node, const uint32_t (&near_at)[3]) {
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const bool forward = near_at[axis] < kBoundBytes;
      near[axis] = Lanes::load(forward ? node.lo[axis] : node.hi[axis]);
      far[axis] = Lanes::load(forward ? node.hi[axis] : node.lo[axis]);
    }
  }
};

/// A ray against them: plane p is passed at p inverse + bias.
template <typename Lanes>
struct GroupRay {
  float inverse[3], near[3], far[3], tnear, tmax;

  void set(const GridRay& ray) {
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const float back = ray.origin[axis] * ray.inverse[axis];
      inverse[axis] = ray.inverse[axis];
      near[axis] = -back - ray.pad[axis];
      far[axis] = -back + ray.pad[axis];
    }
    tnear = ray.tnear;
    set_tmax(ray.tmax);
  }
  void set_tmax(float t) { tmax = t; }
};

/// By child of a node: the rays that pass its box, as bits.
template <typename Lanes>
struct ChildRays {
  uint64_t rays[baked::kNodeWidth] = {};

  void add(const GroupBoxes<Lanes>& boxes, const GroupRay<Lanes>& ray, uint32_t number) {
    using F = typename Lanes::F;
    F begin = Lanes::set(ray.tnear), end = Lanes::set(ray.tmax);
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const F inverse = Lanes::set(ray.inverse[axis]);
      begin = Lanes::max(begin, Lanes::fma(boxes.near[axis], inverse, Lanes::set(ray.near[axis])));
      end = Lanes::min(end, Lanes::fma(boxes.far[axis], inverse, Lanes::set(ray.far[axis])));
    }
    for (uint32_t hit = Lanes::less_equal(begin, end); hit != 0; hit &= hit - 1)
      rays[__builtin_ctz(hit)] |= uint64_t{1} << number;
  }

  /// Where a ray enters the boxes.
  static void enter(const GroupBoxes<Lanes>& boxes, const GroupRay<Lanes>& ray, float (&t)[baked::kNodeWidth]) {
    const auto at = [&](uint32_t axis) {
      return Lanes::fma(boxes.near[axis], Lanes::set(ray.inverse[axis]), Lanes::set(ray.near[axis]));
    };
    Lanes::store(t, Lanes::max(Lanes::max(at(0), at(1)), at(2)));
  }

  /// @return the children that any ray passes, as bits
  uint32_t read(uint64_t (&out)[baked::kNodeWidth]) const {
    uint32_t used = 0;
    for (uint32_t child = 0; child < baked::kNodeWidth; ++child) {
      out[child] = rays[child];
      used |= (rays[child] != 0 ? 1u : 0u) << child;
    }
    return used;
  }
};

} // namespace
} // namespace packtrace::packed
