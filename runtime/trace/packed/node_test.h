#pragma once

#include "runtime/trace/packed/grid_ray.h"

namespace packtrace::packed {
namespace {

/// Parameters at which a node's planes are passed: of near and far plane q along an axis, q scale + bias.
struct NodePlanes {
  float scale[3], near[3], far[3];
};

inline NodePlanes node_planes(const baked::PackedNode& node, const GridRay& ray) {
  NodePlanes planes;
  for (uint32_t axis = 0; axis < 3; ++axis) {
    const uint32_t exponent = ((uint32_t{node.exponents} >> (5 * axis)) & 31u) + 127u;
    const uint32_t power_bits = exponent << 23;
    float power;
    __builtin_memcpy(&power, &power_bits, sizeof power);
    int32_t origin;
    __builtin_memcpy(&origin, reinterpret_cast<const uint8_t*>(&node) + 4 * axis, sizeof origin);
    const float at = (static_cast<float>(origin) - ray.origin[axis]) * ray.inverse[axis];
    planes.scale[axis] = power * ray.inverse[axis];
    planes.near[axis] = at - ray.pad[axis];
    planes.far[axis] = at + ray.pad[axis];
  }
  return planes;
}

/// Which boxes the ray passes between tnear and tmax, as bits; where it enters them. Without a look at the children.
template <typename Lanes>
inline uint32_t test_boxes(const baked::PackedNode& node, const GridRay& ray, float (&entry)[8]) {
  using F = typename Lanes::F;
  const NodePlanes planes = node_planes(node, ray);
  const uint8_t* bounds = reinterpret_cast<const uint8_t*>(&node) + offsetof(baked::PackedNode, lo);
  F begin = Lanes::set(ray.tnear), end = Lanes::set(ray.tmax);
  for (uint32_t axis = 0; axis < 3; ++axis) {
    const uint32_t near = ray.near_at[axis], far = 16 * axis + kBoundBytes - near;
    const F scale = Lanes::set(planes.scale[axis]);
    begin = Lanes::max(begin, Lanes::fma(Lanes::load_bytes(bounds + near), scale, Lanes::set(planes.near[axis])));
    end = Lanes::min(end, Lanes::fma(Lanes::load_bytes(bounds + far), scale, Lanes::set(planes.far[axis])));
  }
  Lanes::store(entry, begin);
  return Lanes::less_equal(begin, end);
}

template <typename Lanes>
inline uint32_t test_boxes(const TopNode& node, const GridRay& ray, float (&entry)[8]) {
  using F = typename Lanes::F;
  F begin = Lanes::set(ray.tnear), end = Lanes::set(ray.tmax);
  for (uint32_t axis = 0; axis < 3; ++axis) {
    const bool forward = ray.near_at[axis] < kBoundBytes;
    const F origin = Lanes::set(ray.origin[axis]), inverse = Lanes::set(ray.inverse[axis]),
            pad = Lanes::set(ray.pad[axis]);
    const F near = Lanes::mul(Lanes::sub(Lanes::load(forward ? node.lo[axis] : node.hi[axis]), origin), inverse);
    const F far = Lanes::mul(Lanes::sub(Lanes::load(forward ? node.hi[axis] : node.lo[axis]), origin), inverse);
    begin = Lanes::max(begin, Lanes::sub(near, pad));
    end = Lanes::min(end, Lanes::add(far, pad));
  }
  Lanes::store(entry, begin);
  return Lanes::less_equal(begin, end);
}

} // namespace
} // namespace packtrace::packed
