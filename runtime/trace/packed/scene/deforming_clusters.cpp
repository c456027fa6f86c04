#include "runtime/trace/packed/scene/deforming_clusters.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstring>

#include "compress/format/layout/bit_fields.h"

namespace packtrace {
namespace {

/// Number of bytes before the positions: strips padded to a whole byte.
uint64_t strip_bytes(const packed::TraceCluster& cluster) { return cluster.position_bit / 8u; }

uint32_t width(const DeformingClusters::Extent& extent, size_t axis) {
  return static_cast<uint32_t>(std::bit_width(static_cast<uint32_t>(extent.hi[axis] - extent.lo[axis])));
}

/// Packs the fields of all vertices. Writes up to 8 bytes behind the last field.
void write_fields(std::span<const FramePoint> points, const FramePoint& lo, uint32_t x_bits, uint32_t y_bits,
                  uint32_t stride, uint8_t* at) {
  uint64_t pending = 0;
  uint32_t filled = 0; // bits of `pending` that are not in memory yet: less than 8 between vertices
  for (const FramePoint& point : points) {
    const uint64_t x = static_cast<uint32_t>(point[0] - lo[0]), y = static_cast<uint32_t>(point[1] - lo[1]),
                   z = static_cast<uint32_t>(point[2] - lo[2]);
    pending |= (x | y << x_bits | z << (x_bits + y_bits)) << filled;
    std::memcpy(at, &pending, sizeof pending);
    filled += stride;
    const uint32_t whole = filled / 8;
    at += whole;
    pending = whole < 8 ? pending >> (8 * whole) : 0;
    filled &= 7u;
  }
}

} // namespace

DeformingClusters::DeformingClusters(const BakedFile& file, uint32_t geometry,
                                     std::span<const packed::TraceCluster> clusters, const FramePoint& low)
    : low_(low), clusters_(clusters.begin(), clusters.end()) {
  std::vector<uint64_t> bits(clusters_.size());
  for (uint32_t c = 0; c < count(); ++c) {
    const ClusterView view = file.cluster(geometry, c);
    packed::TraceCluster& cluster = clusters_[c];
    cluster.bits = view.bits();
    cluster.position_bit = static_cast<uint16_t>((view.layout().total_bits() + 7) / 8 * 8);
    std::fill_n(cluster.position_bits, 3, uint8_t{0}); // nothing is written yet
    cluster.up = cluster.down = 0;
    cluster.flags = static_cast<uint8_t>(cluster.flags & ~packed::kNeedsWideDecode);
    constexpr uint32_t kSpare = 3; // bits per vertex by which later frames may exceed the file's widths at no cost
    const auto& widths = view.record().position_bits;
    bits[c] = view.vertex_count() * std::min<uint64_t>(kMaxFieldBits, widths[0] + widths[1] + widths[2] + kSpare);
  }
  lay_out(bits);
}

DeformingClusters::Extent DeformingClusters::extent_of(std::span<const FramePoint> points) {
  Extent extent{points[0], points[0]};
  for (const FramePoint& point : points)
    for (size_t axis = 0; axis < 4; ++axis) {
      extent.lo[axis] = std::min(extent.lo[axis], point[axis]);
      extent.hi[axis] = std::max(extent.hi[axis], point[axis]);
    }
  return extent;
}

uint32_t DeformingClusters::stride_of(const Extent& extent) {
  return width(extent, 0) + width(extent, 1) + width(extent, 2);
}

bool DeformingClusters::has_room(uint32_t cluster, size_t vertices, const Extent& extent) const {
  const uint64_t bytes = begins_[cluster + size_t{1}] - begins_[cluster] - strip_bytes(clusters_[cluster]);
  return vertices * stride_of(extent) <= 8 * (bytes - kReadSlackBytes);
}

void DeformingClusters::make_room(std::span<const uint64_t> bits) {
  std::vector<uint64_t> all(bits.begin(), bits.end());
  for (uint32_t c = 0; c < count(); ++c) {
    const uint64_t bytes = begins_[c + size_t{1}] - begins_[c] - strip_bytes(clusters_[c]) - kReadSlackBytes;
    all[c] = std::max(all[c], 8 * bytes);
  }
  lay_out(all);
}

void DeformingClusters::lay_out(std::span<const uint64_t> bits) {
  const std::vector<uint64_t> old_begins = std::move(begins_);
  std::vector<uint8_t> old_bits = std::move(bits_);
  begins_.assign(1, 0);
  for (uint32_t c = 0; c < count(); ++c)
    begins_.push_back(begins_.back() + strip_bytes(clusters_[c]) + (bits[c] + 7) / 8 + kReadSlackBytes);
  bits_.assign(begins_.back(), 0);
  for (uint32_t c = 0; c < count(); ++c) {
    const uint64_t bytes = old_begins.empty() ? strip_bytes(clusters_[c]) : old_begins[c + size_t{1}] - old_begins[c];
    std::memcpy(bits_.data() + begins_[c], clusters_[c].bits, bytes);
    clusters_[c].bits = bits_.data() + begins_[c];
  }
}

void DeformingClusters::write(uint32_t number, std::span<const FramePoint> points, const Extent& extent) {
  assert(has_room(number, points.size(), extent));
  packed::TraceCluster& cluster = clusters_[number];
  for (size_t axis = 0; axis < 3; ++axis) {
    cluster.base[axis] = low_[axis] + extent.lo[axis];
    cluster.position_bits[axis] = static_cast<uint8_t>(width(extent, axis));
  }
  write_fields(points, extent.lo, cluster.position_bits[0], cluster.position_bits[1], stride_of(extent),
               bits_.data() + begins_[number] + strip_bytes(cluster));
}

uint64_t DeformingClusters::bytes() const {
  return bits_.size() + begins_.size() * sizeof begins_[0] + clusters_.size() * sizeof clusters_[0];
}

std::array<int32_t, 3> grid_point(const packed::TraceCluster& cluster, uint32_t vertex) {
  const auto [x, y, z] =
      std::array<uint32_t, 3>{cluster.position_bits[0], cluster.position_bits[1], cluster.position_bits[2]};
  const PositionFields fields =
      read_position(cluster.bits, cluster.position_bit + uint64_t{vertex} * (x + y + z), x, y, z);
  std::array<int32_t, 3> point;
  for (size_t axis = 0; axis < 3; ++axis)
    point[axis] = static_cast<int32_t>(static_cast<uint32_t>(cluster.base[axis]) +
                                       (static_cast<uint32_t>(fields.axis[axis]) << cluster.up));
  return point;
}

} // namespace packtrace
