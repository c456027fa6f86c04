#include "compress/format/cluster/cluster_codec.h"

#include <algorithm>
#include <cassert>
#include <numeric>

#include "compress/format/cluster/normal_kernels.h"
#include "compress/format/cluster/position_kernels.h"
#include "compress/format/layout/bit_stream.h"
#include "pbrt_import/base/cpu.h"

namespace packtrace {
namespace {

constexpr uint32_t kMaxUvBits = 31;     // for differences of codes in -kMaxUvLattice .. kMaxUvLattice
constexpr uint32_t kMaxNormalBits = 17; // covers three times the codes of axis32 (unfolded charts)

uint32_t uv_width(const uint8_t* bits, uint32_t uv_bit, uint32_t axis) {
  return static_cast<uint32_t>(read_bits(bits, uv_bit + 2 * kUvAnchorBits + axis * kUvWidthBits, kUvWidthBits));
}

int32_t uv_anchor(const uint8_t* bits, uint32_t uv_bit, uint32_t axis) {
  return static_cast<int32_t>(static_cast<uint32_t>(read_bits(bits, uv_bit + axis * kUvAnchorBits, kUvAnchorBits)));
}

LatticePoint offset(const LatticePoint& base, const PositionFields& fields) {
  return {base[0] + static_cast<int64_t>(fields.axis[0]), base[1] + static_cast<int64_t>(fields.axis[1]),
          base[2] + static_cast<int64_t>(fields.axis[2])};
}

/// Whether coordinates and field widths of a cluster are within the PositionKernel's limits.
bool fits_kernel(const LatticePoint& base, const baked::ClusterRecord& record) {
  constexpr int64_t kMost = int64_t{1} << kMaxKernelPositionBits;
  for (size_t axis = 0; axis < 3; ++axis)
    if (base[axis] < -kMost || base[axis] > kMost || record.position_bits[axis] > kMaxKernelPositionBits) return false;
  return true;
}

uint32_t position_stride(const baked::ClusterRecord& record) {
  return std::accumulate(record.position_bits.begin(), record.position_bits.end(), 0u);
}

uint32_t normal_stride(const baked::GeometryRecord& geometry, const baked::ClusterRecord& record) {
  const auto encoding = static_cast<NormalEncoding>(geometry.normal_encoding);
  return uint32_t{record.normal_bits[0]} + record.normal_bits[1] +
         ((record.flags & baked::kClusterMixedCharts) != 0 ? bits_for_count(format_of(encoding).charts) : 0);
}

uint32_t normal_stream_bits(const baked::ClusterRecord& record, uint32_t stride) {
  if ((record.flags & baked::kClusterHasNormals) == 0) return 0;
  if (record.normal_palette == 0) return record.vertex_count * stride;
  return record.normal_palette * stride + record.vertex_count * bits_for_count(record.normal_palette);
}

uint32_t chart_of(const baked::ClusterRecord& record) {
  return (uint32_t{record.flags} & baked::kClusterChart) >> baked::kClusterChartShift;
}

std::optional<std::string_view> find_normal_fault(const baked::GeometryRecord& geometry,
                                                  const baked::ClusterRecord& cluster) {
  const bool mixed = (cluster.flags & baked::kClusterMixedCharts) != 0;
  if ((cluster.flags & baked::kClusterHasNormals) == 0) {
    const bool none = cluster.normal_anchor == std::array<int16_t, 2>{} && cluster.normal_palette == 0 &&
                      cluster.normal_bits == std::array<uint8_t, 2>{} && !mixed && chart_of(cluster) == 0;
    return none ? std::nullopt : std::optional<std::string_view>("normals without their flag");
  }
  const uint32_t charts = format_of(static_cast<NormalEncoding>(geometry.normal_encoding)).charts;
  if (mixed ? charts == 1 || chart_of(cluster) != 0 : chart_of(cluster) >= charts) return "normal chart";
  if (std::max(cluster.normal_bits[0], cluster.normal_bits[1]) > kMaxNormalBits) return "normal bits";
  if (cluster.normal_palette > cluster.vertex_count) return "normal palette";
  return std::nullopt;
}

} // namespace

ClusterView::ClusterView(const baked::GeometryRecord& geometry, const baked::ClusterRecord& cluster,
                         const uint8_t* payload)
    : record_(&cluster), bits_(payload + uint64_t{4} * cluster.payload_offset),
      layout_{cluster.triangle_count, cluster.vertex_count, cluster.strip_count},
      step_(PositionGrid{geometry.step_mantissa, geometry.step_exponent}.step()),
      u_decoder_(static_cast<UvEncoding>(geometry.uv_encoding), geometry.uv_exponent[0]),
      v_decoder_(static_cast<UvEncoding>(geometry.uv_encoding), geometry.uv_exponent[1]),
      normal_encoding_(static_cast<NormalEncoding>(geometry.normal_encoding)),
      normal_stride_(normal_stride(geometry, cluster)), position_stride_(position_stride(cluster)) {
  for (size_t axis = 0; axis < 3; ++axis)
    base_[axis] = geometry.origin[axis] + int64_t{cluster.anchor[axis]} * (int64_t{1} << geometry.anchor_shift);
  position_bit_ = layout_.total_bits();
  normal_bit_ = position_bit_ + layout_.vertex_count * position_stride_;
  uv_bit_ = normal_bit_ + normal_stream_bits(cluster, normal_stride_);
}

LatticePoint ClusterView::lattice(uint32_t vertex) const {
  uint64_t bit = position_bit_ + uint64_t{vertex} * position_stride_;
  const auto [x_bits, y_bits, z_bits] = record_->position_bits;
  if (position_stride_ > kMaxFieldBits) { // more than one load holds
    LatticePoint point = base_;
    for (size_t axis = 0; axis < 3; bit += record_->position_bits[axis++])
      point[axis] += static_cast<int64_t>(read_bits(bits_, bit, record_->position_bits[axis]));
    return point;
  }
  return offset(base_, read_position(bits_, bit, x_bits, y_bits, z_bits));
}

Vec3 ClusterView::position(uint32_t vertex) const {
  const LatticePoint q = lattice(vertex);
  return {from_lattice(q[0], step_), from_lattice(q[1], step_), from_lattice(q[2], step_)};
}

NormalFields ClusterView::normal_fields(uint32_t vertex) const {
  assert(has_normals());
  const uint32_t palette = record_->normal_palette;
  uint32_t entry = vertex;
  if (palette != 0) {
    const uint32_t width = bits_for_count(palette);
    entry = static_cast<uint32_t>(
        read_bits(bits_, normal_bit_ + palette * normal_stride_ + uint64_t{vertex} * width, width));
  }
  return normal_entry(entry);
}

NormalFields ClusterView::normal_entry(uint32_t entry) const {
  const uint32_t x_bits = record_->normal_bits[0], y_bits = record_->normal_bits[1];
  const uint64_t field = read_bits(bits_, normal_bit_ + uint64_t{entry} * normal_stride_, normal_stride_);
  const auto y = static_cast<int32_t>(field & ((1u << y_bits) - 1));
  const auto x = static_cast<int32_t>((field >> y_bits) & ((1u << x_bits) - 1));
  return fold_normal(normal_encoding_,
                     {chart_of(*record_) + static_cast<uint32_t>(field >> (x_bits + y_bits)), // one of them is 0
                      2 * record_->normal_anchor[0] + x, 2 * record_->normal_anchor[1] + y});
}

Vec3 ClusterView::normal(uint32_t vertex) const { return decode_normal(normal_encoding_, normal_fields(vertex)); }

std::array<int64_t, 2> ClusterView::uv_code(uint32_t vertex) const {
  assert(has_uvs());
  const uint32_t u_bits = uv_width(bits_, uv_bit_, 0), v_bits = uv_width(bits_, uv_bit_, 1);
  const uint64_t bit = uv_bit_ + kUvHeaderBits + uint64_t{vertex} * (u_bits + v_bits);
  return {uv_anchor(bits_, uv_bit_, 0) + static_cast<int64_t>(read_bits(bits_, bit, u_bits)),
          uv_anchor(bits_, uv_bit_, 1) + static_cast<int64_t>(read_bits(bits_, bit + u_bits, v_bits))};
}

Vec2 ClusterView::uv(uint32_t vertex) const {
  const auto [u, v] = uv_code(vertex);
  return {u_decoder_(u), v_decoder_(v)};
}

void ClusterView::bounds(Vec3& lo, Vec3& hi) const {
  for (int axis = 0; axis < 3; ++axis) {
    const int64_t base = base_[static_cast<size_t>(axis)];
    const uint32_t bits = record_->position_bits[static_cast<size_t>(axis)];
    lo[axis] = from_lattice(base, step_);
    hi[axis] = from_lattice(base + ((int64_t{1} << bits) - 1), step_);
  }
}

ClusterView::StreamBits ClusterView::stream_bits() const {
  StreamBits bits{layout_.total_bits(), uint64_t{layout_.vertex_count} * position_stride_,
                  normal_stream_bits(*record_, normal_stride_), 0};
  if (has_uvs())
    bits.uvs =
        kUvHeaderBits + uint64_t{layout_.vertex_count} * (uv_width(bits_, uv_bit_, 0) + uv_width(bits_, uv_bit_, 1));
  return bits;
}

void decode_positions(const ClusterView& cluster, std::span<Vec3> out) {
  const uint32_t count = cluster.vertex_count(), stride = cluster.position_stride_;
  assert(out.size() >= count);
  if (stride > kMaxFieldBits) {
    for (uint32_t v = 0; v < count; ++v) out[v] = cluster.position(v);
    return;
  }
  const auto [x_bits, y_bits, z_bits] = cluster.record_->position_bits;
  if (const PositionKernel kernel = position_kernel();
      kernel != nullptr && fits_kernel(cluster.base_, *cluster.record_)) {
    static_assert(sizeof(Vec3) == 3 * sizeof(float));
    const auto [x, y, z] = cluster.base_;
    const PositionStream stream{cluster.bits_,
                                cluster.position_bit_,
                                stride,
                                count,
                                {x_bits, y_bits, z_bits},
                                {static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)},
                                cluster.step_};
    kernel(stream, &out[0].x);
    return;
  }
  // Local copies, because writes to `out` might change the originals: a seventh faster.
  const uint8_t* const bits = cluster.bits_;
  const LatticePoint base = cluster.base_;
  const double step = cluster.step_;
  uint64_t bit = cluster.position_bit_;
  for (uint32_t v = 0; v < count; ++v, bit += stride) {
    const LatticePoint q = offset(base, read_position(bits, bit, x_bits, y_bits, z_bits));
    out[v] = {from_lattice(q[0], step), from_lattice(q[1], step), from_lattice(q[2], step)};
  }
}

void decode_indices(const ClusterView& cluster, uint32_t base, std::span<Triangle> out) {
  decode_triangles(cluster.bits(), cluster.layout(), base, out);
}

void decode_normals(const ClusterView& cluster, std::span<Vec3> out) {
  assert(cluster.has_normals() && out.size() >= cluster.vertex_count());
  const uint32_t vertex_count = cluster.vertex_count(), palette = cluster.record_->normal_palette;
  if (palette == 0) {
    cluster.decode_normal_entries(vertex_count, out);
    return;
  }
  std::array<Vec3, kMaxClusterVertices> entries;
  cluster.decode_normal_entries(palette, entries);
  const uint32_t width = bits_for_count(palette);
  uint64_t bit = cluster.normal_bit_ + uint64_t{palette} * cluster.normal_stride_;
  for (uint32_t v = 0; v < vertex_count; ++v, bit += width)
    out[v] = entries[static_cast<size_t>(read_bits(cluster.bits_, bit, width))];
}

void ClusterView::decode_normal_entries(uint32_t count, std::span<Vec3> out) const {
  static_assert(sizeof(Vec3) == 3 * sizeof(float));
  const NormalFormat& format = format_of(normal_encoding_);
  const AxisNormalKernel kernel = axis_normal_kernel();
  if (format.family != NormalFamily::kAxis || kernel == nullptr) {
    for (uint32_t i = 0; i < count; ++i) out[i] = decode_normal(normal_encoding_, normal_entry(i));
    return;
  }
  const auto last = static_cast<int32_t>(format.x_codes) - 1;
  const AxisNormalStream stream{bits_,
                                normal_bit_,
                                normal_stride_,
                                count,
                                record_->normal_bits[0],
                                record_->normal_bits[1],
                                2 * record_->normal_anchor[0],
                                2 * record_->normal_anchor[1],
                                static_cast<int32_t>(chart_of(*record_)),
                                last,
                                1.0f / static_cast<float>(last),
                                static_cast<float>(kAxisSlope),
                                static_cast<float>(kAxisCubic)};
  kernel(stream, &out[0].x);
}

PositionKernel position_kernel() {
#if defined(__x86_64__)
  if (cpu_has_avx2()) return avx2::decode_positions;
#endif
  return nullptr;
}

AxisNormalKernel axis_normal_kernel() {
#if defined(__x86_64__)
  if (cpu_has_avx2()) return avx2::decode_axis_normals;
#endif
  return nullptr;
}

void decode_uvs(const ClusterView& cluster, std::span<Vec2> out) {
  assert(cluster.has_uvs() && out.size() >= cluster.vertex_count());
  for (uint32_t v = 0; v < cluster.vertex_count(); ++v) out[v] = cluster.uv(v);
}

std::optional<std::string_view> find_cluster_fault(const baked::GeometryRecord& geometry,
                                                   const baked::ClusterRecord& cluster, const uint8_t* payload,
                                                   uint64_t payload_bytes) {
  const IndexLayout layout{cluster.triangle_count, cluster.vertex_count, cluster.strip_count};
  if (layout.triangle_count < 1 || layout.triangle_count > kMaxClusterTriangles) return "triangle count";
  if (layout.vertex_count < 1 || layout.vertex_count > kMaxClusterVertices) return "vertex count";
  if (layout.strip_count < 1 || layout.strip_count > layout.triangle_count) return "strip count";
  if (layout.vertex_count > layout.corner_count()) return "more vertices than corners";
  for (size_t axis = 0; axis < 3; ++axis) {
    if (cluster.position_bits[axis] > kMaxFieldBits) return "position bits";
    const int64_t low = geometry.origin[axis] + int64_t{cluster.anchor[axis]} * (int64_t{1} << geometry.anchor_shift);
    const int64_t high = low + ((int64_t{1} << cluster.position_bits[axis]) - 1);
    // The top value of a field may lie past the last vertex, so the limit is loose; it keeps all sums within int64.
    if (low < -2 * kMaxLattice || high > 8 * kMaxLattice) return "position anchor";
  }
  if ((cluster.flags & ~baked::kClusterFlags) != 0) return "flags";
  if (const auto fault = find_normal_fault(geometry, cluster)) return fault;

  const uint64_t begin = uint64_t{4} * cluster.payload_offset;
  const auto fits = [&](uint64_t bits) { return begin <= payload_bytes && (bits + 7) / 8 <= payload_bytes - begin; };
  const uint8_t* bits = payload + begin;
  if (!fits(layout.total_bits())) return "payload extent";
  if (!strips_are_valid(bits, layout)) return "triangle strips";
  const ClusterView view(geometry, cluster, payload);
  const bool has_uvs = view.has_uvs();
  const uint64_t uv_bit = uint64_t{layout.total_bits()} + layout.vertex_count * position_stride(cluster) +
                          normal_stream_bits(cluster, normal_stride(geometry, cluster));
  if (!fits(uv_bit + (has_uvs ? kUvHeaderBits : 0))) return "payload extent";
  if (cluster.normal_palette != 0)
    for (uint32_t v = 0, width = bits_for_count(cluster.normal_palette); v < layout.vertex_count; ++v)
      if (read_bits(bits, uv_bit - uint64_t{layout.vertex_count - v} * width, width) >= cluster.normal_palette)
        return "normal palette index";
  for (uint32_t axis = 0; has_uvs && axis < 2; ++axis) {
    const auto at = static_cast<uint32_t>(uv_bit);
    if (uv_width(bits, at, axis) > kMaxUvBits) return "texture coordinate bits";
    if (std::abs(int64_t{uv_anchor(bits, at, axis)}) > kMaxUvLattice) return "texture coordinate anchor";
  }
  if (!fits(view.stream_bits().total())) return "payload extent";
  Vec3 lo, hi;
  view.bounds(lo, hi);
  // The box may exceed the float range although all vertices are finite.
  for (uint32_t v = 0; !(is_finite(lo) && is_finite(hi)) && v < layout.vertex_count; ++v)
    if (!is_finite(view.position(v))) return "position beyond the float range";
  return std::nullopt;
}

} // namespace packtrace
