#include "runtime/trace/packed/scene/trace_cluster.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "compress/format/layout/bit_fields.h"

namespace packtrace {
namespace {

__extension__ using Int128 = __int128;

constexpr int32_t kMaxDown = 62;

/// Tree coordinate = (q 2^up - origin 2^down) / 2^down for lattice coordinate q.
struct Shifts {
  uint32_t up, down;
};

Shifts shifts(const baked::TreeRecord& tree, const baked::GeometryRecord& geometry) {
  const int32_t up = geometry.step_exponent - tree.step_exponent;
  return {static_cast<uint32_t>(std::clamp(up, 0, kMaxDown)), static_cast<uint32_t>(std::max(-up, 0))};
}

/// Returns a tree coordinate in units of 2^-down tree grid steps.
Int128 moved(int64_t q, int64_t origin, Shifts by) {
  return static_cast<Int128>(q) * (Int128{1} << by.up) - static_cast<Int128>(origin) * (Int128{1} << by.down);
}

float tree_coordinate(int64_t q, int64_t origin, Shifts by) {
  if (by.down <= kMaxDown) return std::ldexp(static_cast<float>(moved(q, origin, by)), -static_cast<int>(by.down));
  // The share of q is below 2^-7 then, too small to affect the result unless the origin is 0.
  if (origin != 0) return -static_cast<float>(origin);
  return std::ldexp(static_cast<float>(q), -static_cast<int>(by.down));
}

/// Whether kernels can read the cluster's vertices: coordinates fit into 32 bits, and one 64-bit load holds the fields
/// of a vertex.
bool is_plain(const baked::TreeRecord& tree, const baked::GeometryRecord& geometry, const ClusterView& cluster,
              Shifts by, int32_t (&base)[3]) {
  const auto& widths = cluster.record().position_bits;
  if (by.down > kMaxDown || by.up > 31 || uint32_t{widths[0]} + widths[1] + widths[2] > kMaxFieldBits) return false;
  constexpr Int128 kMin = std::numeric_limits<int32_t>::min(), kMax = std::numeric_limits<int32_t>::max();
  for (size_t axis = 0; axis < 3; ++axis) {
    const int64_t low =
        geometry.origin[axis] + int64_t{cluster.record().anchor[axis]} * (int64_t{1} << geometry.anchor_shift);
    const Int128 lo = moved(low, tree.origin[axis], by);
    const Int128 hi = moved(low + ((int64_t{1} << widths[axis]) - 1), tree.origin[axis], by);
    if (lo < kMin || hi > kMax) return false;
    base[axis] = static_cast<int32_t>(lo);
  }
  return true;
}

} // namespace

packed::TraceCluster trace_cluster(const baked::TreeRecord& tree, const baked::GeometryRecord& geometry,
                                   const ClusterView& cluster, uint8_t ray_classes) {
  const Shifts by = shifts(tree, geometry);
  packed::TraceCluster out{};
  out.bits = cluster.bits();
  out.triangle_count = static_cast<uint8_t>(cluster.triangle_count());
  out.strip_count = static_cast<uint8_t>(cluster.layout().strip_count);
  out.position_bit = static_cast<uint16_t>(cluster.layout().total_bits());
  const uint32_t flags = ray_classes | (cluster.layout().index_bits() << packed::kIndexBitsShift);
  out.flags = static_cast<uint8_t>(flags);
  if (!is_plain(tree, geometry, cluster, by, out.base)) {
    out.flags = static_cast<uint8_t>(flags | packed::kNeedsWideDecode);
    return out;
  }
  std::copy(cluster.record().position_bits.begin(), cluster.record().position_bits.end(), out.position_bits);
  out.up = static_cast<uint8_t>(by.up);
  out.down = static_cast<uint8_t>(by.down);
  return out;
}

void decode_vertices_exactly(const baked::TreeRecord& tree, const baked::GeometryRecord& geometry,
                             const ClusterView& cluster, std::vector<float>& out) {
  const Shifts by = shifts(tree, geometry);
  for (uint32_t v = 0; v < cluster.vertex_count(); ++v) {
    const LatticePoint q = cluster.lattice(v);
    for (size_t axis = 0; axis < 3; ++axis) out.push_back(tree_coordinate(q[axis], tree.origin[axis], by));
  }
}

uint32_t decode_batch_exactly(const baked::TreeRecord& tree, const baked::GeometryRecord& geometry,
                              const ClusterView& cluster, uint32_t first, uint32_t count, packed::DecodedBatch& out) {
  count = std::min(count, packed::kBatch);
  const Shifts by = shifts(tree, geometry);
  for (uint32_t i = 0; i < count; ++i) {
    const Triangle triangle = cluster.triangle(first + i);
    for (int corner = 0; corner < 3; ++corner) {
      const LatticePoint q = cluster.lattice(triangle[corner]);
      for (size_t axis = 0; axis < 3; ++axis)
        out.vertex[axis][corner][i] = tree_coordinate(q[axis], tree.origin[axis], by);
    }
  }
  for (auto& axis : out.vertex)
    for (auto& lanes : axis) std::fill(lanes + count, lanes + packed::kBatch, lanes[0]);
  return count;
}

} // namespace packtrace
