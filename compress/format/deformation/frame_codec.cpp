#include "compress/format/deformation/frame_codec.h"

#include <algorithm>
#include <bit>
#include <limits>

#include "compress/format/cluster/index_codec.h"

namespace packtrace {
namespace {

constexpr uint32_t kKindBits = 2, kSpatialBits = 1, kWidthBits = 5, kSizeBits = 6;
constexpr uint32_t kKinds = 3, kMaxWidth = 31, kMaxAnchorBits = 32;

uint32_t zigzag_frame(uint32_t difference) { return (difference << 1) ^ (0u - (difference >> 31)); }
uint32_t unzigzag_frame(uint32_t value) { return (value >> 1) ^ (0u - (value & 1u)); }

uint32_t predict(FramePrediction kind, const FrameReferences& from, size_t vertex, size_t axis) {
  switch (kind) {
  case FramePrediction::kStored:
    return from.stored[vertex][axis];
  case FramePrediction::kPrevious:
    return from.previous[vertex][axis];
  case FramePrediction::kLinear:
    return 2 * from.previous[vertex][axis] - from.older[vertex][axis];
  }
  return 0;
}

/// Residuals of one axis.
struct Residuals {
  std::array<uint32_t, kMaxClusterVertices> values;
  uint32_t anchor = 0, width = 0;

  uint32_t anchor_bits() const { return static_cast<uint32_t>(std::bit_width(zigzag_frame(anchor))); }
  uint64_t bits(size_t count) const { return kWidthBits + kSizeBits + anchor_bits() + uint64_t{width} * count; }
};

/// A frame in one of its possible forms.
struct FrameForm {
  FramePrediction kind{};
  bool spatial = false;
  std::array<Residuals, 3> axes;
  uint64_t bits = std::numeric_limits<uint64_t>::max();
};

void find_residuals(std::span<const FrameVertex> vertices, const FrameReferences& from, FrameForm& form) {
  form.bits = 0;
  for (size_t axis = 0; axis < 3; ++axis) {
    Residuals& out = form.axes[axis];
    uint32_t last = 0;
    int32_t lo = std::numeric_limits<int32_t>::max(), hi = std::numeric_limits<int32_t>::min();
    for (size_t v = 0; v < vertices.size(); ++v) {
      const uint32_t residual = vertices[v][axis] - predict(form.kind, from, v, axis);
      const uint32_t value = form.spatial ? residual - last : residual;
      last = residual;
      out.values[v] = value;
      lo = std::min(lo, static_cast<int32_t>(value)), hi = std::max(hi, static_cast<int32_t>(value));
    }
    out.anchor = static_cast<uint32_t>(lo);
    out.width = static_cast<uint32_t>(std::bit_width(static_cast<uint32_t>(hi) - out.anchor));
    form.bits += out.width > kMaxWidth ? uint64_t{1} << 32 : out.bits(vertices.size());
  }
}

void write_form(const FrameForm& form, size_t count, BitWriter& writer) {
  writer.put(static_cast<uint32_t>(form.kind), kKindBits);
  writer.put(form.spatial ? 1 : 0, kSpatialBits);
  for (const Residuals& axis : form.axes) {
    writer.put(axis.width, kWidthBits);
    writer.put(axis.anchor_bits(), kSizeBits);
    writer.put(zigzag_frame(axis.anchor), axis.anchor_bits());
    for (size_t v = 0; v < count; ++v) writer.put(axis.values[v] - axis.anchor, axis.width);
  }
}

/// The fields of one axis in the stream.
struct AxisFields {
  uint32_t width = 0, anchor = 0;
  uint64_t first_bit = 0;
};

AxisFields read_axis(const uint8_t* bits, uint64_t bit) {
  AxisFields fields;
  fields.width = static_cast<uint32_t>(read_bits(bits, bit, kWidthBits));
  const auto size = static_cast<uint32_t>(read_bits(bits, bit + kWidthBits, kSizeBits));
  bit += kWidthBits + kSizeBits;
  fields.anchor = unzigzag_frame(static_cast<uint32_t>(read_bits(bits, bit, std::min(size, kMaxAnchorBits))));
  fields.first_bit = bit + size;
  return fields;
}

template <FramePrediction kKind, bool kSpatial>
void decode_axis(const uint8_t* bits, const AxisFields& fields, const FrameReferences& from, size_t axis,
                 std::span<FrameVertex> out) {
  uint64_t bit = fields.first_bit;
  uint32_t last = 0;
  const uint32_t width = fields.width, anchor = fields.anchor;
  for (size_t v = 0; v < out.size(); ++v, bit += width) {
    const uint32_t value = static_cast<uint32_t>(read_bits(bits, bit, width)) + anchor;
    last = kSpatial ? last + value : value;
    out[v][axis] = predict(kKind, from, v, axis) + last;
  }
}

template <FramePrediction kKind>
void decode_axis(const uint8_t* bits, const AxisFields& fields, const FrameReferences& from, size_t axis, bool spatial,
                 std::span<FrameVertex> out) {
  spatial ? decode_axis<kKind, true>(bits, fields, from, axis, out)
          : decode_axis<kKind, false>(bits, fields, from, axis, out);
}

} // namespace

void encode_frame(std::span<const FrameVertex> vertices, const FrameReferences& references, BitWriter& writer) {
  FrameForm best, form;
  for (const FramePrediction kind : {FramePrediction::kStored, FramePrediction::kPrevious, FramePrediction::kLinear}) {
    if (kind == FramePrediction::kPrevious && references.previous.empty()) break;
    if (kind == FramePrediction::kLinear && references.older.empty()) break;
    for (const bool spatial : {false, true}) {
      form.kind = kind, form.spatial = spatial;
      find_residuals(vertices, references, form);
      if (form.bits < best.bits) best = form;
    }
  }
  write_form(best, vertices.size(), writer);
}

uint64_t decode_frame(const uint8_t* bits, uint64_t bit, const FrameReferences& references,
                      std::span<FrameVertex> out) {
  const auto kind = static_cast<FramePrediction>(read_bits(bits, bit, kKindBits));
  const bool spatial = read_bits(bits, bit + kKindBits, kSpatialBits) != 0;
  bit += kKindBits + kSpatialBits;
  for (size_t axis = 0; axis < 3; ++axis) {
    const AxisFields fields = read_axis(bits, bit);
    switch (kind) {
    case FramePrediction::kStored:
      decode_axis<FramePrediction::kStored>(bits, fields, references, axis, spatial, out);
      break;
    case FramePrediction::kPrevious:
      decode_axis<FramePrediction::kPrevious>(bits, fields, references, axis, spatial, out);
      break;
    case FramePrediction::kLinear:
      decode_axis<FramePrediction::kLinear>(bits, fields, references, axis, spatial, out);
      break;
    }
    bit = fields.first_bit + uint64_t{fields.width} * out.size();
  }
  return bit;
}

uint64_t skip_frame(const uint8_t* bits, uint64_t bit, uint64_t end, uint32_t vertex_count, uint32_t before) {
  if (bit + kKindBits + kSpatialBits > end) return 0;
  const uint64_t kind = read_bits(bits, bit, kKindBits);
  if (kind >= kKinds || kind > before) return 0;
  bit += kKindBits + kSpatialBits;
  for (size_t axis = 0; axis < 3; ++axis) {
    if (bit + kWidthBits + kSizeBits > end) return 0;
    if (read_bits(bits, bit + kWidthBits, kSizeBits) > kMaxAnchorBits) return 0;
    const AxisFields fields = read_axis(bits, bit);
    bit = fields.first_bit + uint64_t{fields.width} * vertex_count;
    if (bit > end) return 0;
  }
  return bit;
}

} // namespace packtrace
