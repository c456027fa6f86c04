#pragma once

#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace packtrace {

/// The nearest triangle per ray. Threads may put triangles at the same time; the result does not depend on their order.
class NearestTriangles {
public:
  explicit NearestTriangles(size_t rays) : nearest_(rays, kNothing) {}

  /// Keeps the nearest triangle, the first of equally near ones. Bits of positive floats are ordered like the floats.
  /// @param distance at least 0
  void put(size_t ray, float distance, uint32_t triangle) {
    const uint64_t key = uint64_t{std::bit_cast<uint32_t>(distance)} << 32 | triangle;
    const std::atomic_ref<uint64_t> nearest(nearest_[ray]);
    uint64_t before = nearest.load(std::memory_order_relaxed);
    while (key < before && !nearest.compare_exchange_weak(before, key, std::memory_order_relaxed)) {
    }
  }

  size_t size() const { return nearest_.size(); }
  bool empty(size_t ray) const { return nearest_[ray] == kNothing; }
  uint32_t triangle(size_t ray) const { return static_cast<uint32_t>(nearest_[ray]); }
  double distance(size_t ray) const { return double{std::bit_cast<float>(static_cast<uint32_t>(nearest_[ray] >> 32))}; }

private:
  static constexpr uint64_t kNothing = ~uint64_t{0};
  std::vector<uint64_t> nearest_; // bits of the distance, then the triangle's number
};

} // namespace packtrace
