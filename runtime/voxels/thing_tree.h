#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "pbrt_import/scene/bounds.h"
#include "pbrt_import/scene/math.h"

namespace packtrace {

/// A BVH over boxes with four children per node. Boxes are tested in floats, widened by the rounding errors.
class ThingTree {
public:
  ThingTree() = default;
  /// @param boxes of things 0, 1, ...; none is empty
  explicit ThingTree(const std::vector<Bounds>& boxes);

  /// Calls visit(thing, t_max) for things whose boxes a ray meets before t_max, roughly from near to far. What it
  /// returns is the new t_max; at most t_min ends the traversal.
  template <class Visit>
  void visit(DVec3 origin, DVec3 direction, double t_min, double t_max, const Visit& visit) const {
    if (nodes_.empty() || !(t_max > t_min)) return;
    const BoxRay ray((origin - centre_) * scale_, direction * scale_, t_min);
    std::array<Open, kStack> stack;
    size_t open = 0;
    stack[open++] = {0.0f, 0};
    while (open > 0) {
      const Open next = stack[--open];
      if (double{next.t} > t_max) continue;
      if (next.what < 0) {
        t_max = visit(static_cast<uint32_t>(~next.what), t_max);
        if (!(t_max > t_min)) return;
        continue;
      }
      const Node& node = nodes_[static_cast<size_t>(next.what)];
      const Floats t = ray.entries(node, t_max);
      const size_t first = open;
      for (uint32_t met = lanes(t < kMissed); met != 0; met &= met - 1) {
        const int i = std::countr_zero(met);
        size_t place = open++; // the farthest lies deepest
        for (; place > first && stack[place - 1].t < t[i]; --place) stack[place] = stack[place - 1];
        stack[place] = {t[i], node.child[i]};
      }
    }
  }

  uint64_t bytes() const { return nodes_.size() * sizeof(Node); }

private:
  static constexpr int kWidth = 4;
  static constexpr size_t kAxes = 3;
  static constexpr size_t kDepth = 16, kStack = kDepth * (kWidth - 1) + 1; // of 2^32 things
  static constexpr float kMissed = std::numeric_limits<float>::infinity(), kLargest = std::numeric_limits<float>::max();
  using Floats [[gnu::vector_size(16)]] = float;

  using Lanes [[gnu::vector_size(16)]] = int32_t;

  /// Bit i: lane i of a comparison holds.
  [[gnu::always_inline]] static uint32_t lanes(Lanes holds) {
#ifdef __SSE2__
    return static_cast<uint32_t>(__builtin_ia32_movmskps(std::bit_cast<Floats>(holds)));
#else
    uint32_t bits = 0;
    for (int i = 0; i < kWidth; ++i) bits |= holds[i] != 0 ? 1u << i : 0u;
    return bits;
#endif
  }

  struct Node {
    std::array<Floats, kAxes> low, high; ///< of each child; no ray meets those of missing children
    std::array<int32_t, kWidth> child;   ///< a node; below 0: ~thing
  };
  struct Open {
    float t; ///< lower bound of where the ray enters
    int32_t what;
  };

  /// A ray in the tree's units. Two origins, shifted by more than the rounding errors of origin and planes, make
  /// entries earlier and exits later.
  struct BoxRay {
    std::array<float, kAxes> near_origin, far_origin, inverse;
    std::array<bool, kAxes> falling;
    float t_min;

    BoxRay(DVec3 origin, DVec3 direction, double t_first) : t_min(in_floats(t_first * (1.0 - 0x1p-20))) {
      for (size_t i = 0; i < kAxes; ++i) {
        const double o = origin[static_cast<int>(i)], d = direction[static_cast<int>(i)];
        falling[i] = d < 0.0;
        const double pad = (falling[i] ? -0x1p-22 : 0x1p-22) * (std::abs(o) + 1.0);
        inverse[i] = d == 0.0 ? kLargest : in_floats(1.0 / d);
        near_origin[i] = in_floats(o + pad), far_origin[i] = in_floats(o - pad);
      }
    }
    static float in_floats(double value) {
      return static_cast<float>(std::clamp(value, -double{kLargest}, double{kLargest}));
    }

    /// Where the ray enters each child's box; kMissed without a hit before t_max.
    [[gnu::always_inline]] Floats entries(const Node& node, double t_max) const {
      Floats enter = Floats{} + t_min, leave = Floats{} + in_floats(t_max * (1.0 + 0x1p-20));
      for (size_t a = 0; a < kAxes; ++a) {
        const Floats near = ((falling[a] ? node.high : node.low)[a] - near_origin[a]) * inverse[a] * (1.0f - 0x1p-20f),
                     far = ((falling[a] ? node.low : node.high)[a] - far_origin[a]) * inverse[a] * (1.0f + 0x1p-20f);
        enter = near > enter ? near : enter; // false for NaN, which comes of rays that lie in a face
        leave = far < leave ? far : leave;
      }
      return enter <= leave ? enter : Floats{} + kMissed;
    }
  };

  int32_t build(const std::vector<Bounds>& boxes, std::vector<uint32_t>& order, size_t begin, size_t end);

  std::vector<Node> nodes_;
  // The tree's units: (p - centre_) * scale_ lies within -1..1.
  DVec3 centre_{0.0};
  double scale_ = 1.0;
};

} // namespace packtrace
