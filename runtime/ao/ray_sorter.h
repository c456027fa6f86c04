#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/trace/ray_tracer.h"

namespace packtrace {

/// Key of a direction: its octahedral projection with 4 bits per axis, interleaved.
/// Source: Meyer et al., "On floating-point normal vectors" (2010).
uint32_t direction_key(Vec3 direction);

/// Orders rays by direction_key(); equal keys keep their order.
class RaySorter {
public:
  static constexpr uint32_t kKeys = 256;

  /// Returns the rays in their new order, valid until the next call. Rays that hit nothing (tfar <= tnear) come last.
  std::span<const Ray> sort(std::span<const Ray> rays);
  /// Numbers of the sorted rays in the original order.
  std::span<const uint32_t> order() const { return order_; }

private:
  std::vector<uint16_t> keys_;
  std::vector<uint32_t> order_;
  std::vector<Ray> sorted_;
};

} // namespace packtrace
