#include "runtime/gpu/top_nodes.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include <tbb/parallel_for.h>

namespace packtrace::gpu {
namespace {

/// Kernels compute origin * inverse + bias and add a byte times unit * inverse. Each plane is moved outwards by this
/// share of its node's largest coordinate along the axis, four times what the first of the two roundings may be off.
constexpr double kSumError = 0x1p-22;
/// unit * inverse must be a normal number, and finite times 2^24 (kHalfBytes): inverses lie in [2^-1, 2^80].
constexpr int kMinExponent = -100, kMaxExponent = 22;
constexpr double kMaxByte = 255.0;

/// Origin and unit of a node's quantised planes along an axis.
struct Axis {
  float origin;
  int exponent;

  double unit() const { return std::ldexp(1.0, exponent); }
};

Axis axis_of(const packed::TopNode& node, uint32_t axis, double& margin) {
  double lo = std::numeric_limits<double>::infinity(), hi = -lo;
  for (uint32_t slots = node.slots; slots != 0; slots &= slots - 1) {
    const int slot = std::countr_zero(slots);
    lo = std::min(lo, double{node.lo[axis][slot]}), hi = std::max(hi, double{node.hi[axis][slot]});
  }
  margin = kSumError * std::max(std::abs(lo), std::abs(hi));
  const float origin = std::nextafter(static_cast<float>(lo - margin), -std::numeric_limits<float>::infinity());
  const double extent = hi + margin - origin;
  int exponent = kMinExponent;
  if (extent > std::ldexp(kMaxByte, kMinExponent)) {
    exponent = std::ilogb(extent / kMaxByte);
    if (std::ldexp(kMaxByte, exponent) < extent) ++exponent;
  }
  return {origin, std::min(exponent, kMaxExponent)};
}

TopNodeRecord pack(const packed::TopNode& node) {
  TopNodeRecord record{};
  std::copy_n(node.child, baked::kNodeWidth, record.child);
  record.ray_classes = 0xffu << 16;
  record.kind = baked::kInnerChild;
  std::fill_n(&record.lo[0][0], sizeof record.lo, uint8_t{255}); // boxes that no ray passes
  for (uint32_t axis = 0; axis < 3; ++axis) {
    double margin;
    const Axis a = axis_of(node, axis, margin);
    record.origin[axis] = a.origin;
    record.exponents |= static_cast<uint32_t>(a.exponent + 127) << (8 * axis);
    for (uint32_t slots = node.slots; slots != 0; slots &= slots - 1) {
      const int slot = std::countr_zero(slots);
      const double lo = (node.lo[axis][slot] - margin - a.origin) / a.unit();
      const double hi = (node.hi[axis][slot] + margin - a.origin) / a.unit();
      record.lo[axis][slot] = static_cast<uint8_t>(std::clamp(std::floor(lo), 0.0, kMaxByte));
      record.hi[axis][slot] = static_cast<uint8_t>(std::clamp(std::ceil(hi), 0.0, kMaxByte));
    }
  }
  return record;
}

} // namespace

std::vector<TopNodeRecord> pack_top_nodes(std::span<const packed::TopNode> nodes) {
  std::vector<TopNodeRecord> records(nodes.size());
  tbb::parallel_for(tbb::blocked_range<size_t>(0, nodes.size(), 64), [&](const tbb::blocked_range<size_t>& range) {
    for (size_t i = range.begin(); i != range.end(); ++i) records[i] = pack(nodes[i]);
  });
  return records;
}

} // namespace packtrace::gpu
