// Kernels of node_kernels.h, compiled once per instruction set. Code here must not use inline functions of other
// headers, because they would be compiled for AVX2; those of bit_fields.h are always inlined.

#include "compress/format/layout/bit_fields.h"
#include "compress/format/trees/node_kernels.h"

namespace packtrace::node_kernels {
namespace {

using Int8 = int32_t __attribute__((vector_size(32), may_alias));
using Uint8 = uint32_t __attribute__((vector_size(32)));
using Long4 = uint64_t __attribute__((vector_size(32)));
using Bytes16 = uint8_t __attribute__((vector_size(16)));
using Long2 = uint64_t __attribute__((vector_size(16)));

[[gnu::always_inline]] inline const Int8& lanes(const Box& box) { return reinterpret_cast<const Int8&>(box); }
[[gnu::always_inline]] inline Int8& lanes(Box& box) { return reinterpret_cast<Int8&>(box); }

[[gnu::always_inline]] inline void extend(Int8& box, const Int8& other) { box = other < box ? other : box; }

/// Returns, for each byte of `which`, the byte of `from` at that index modulo 16.
[[gnu::always_inline]] inline Bytes16 pick_bytes(const Bytes16& from, const Bytes16& which) {
#ifdef __clang__ // clang shuffles by constants only
  uint8_t source[16], picked[16];
  __builtin_memcpy(source, &from, sizeof source);
  __builtin_memcpy(picked, &which, sizeof picked);
  for (uint8_t& byte : picked) byte = source[byte & 15u];
  Bytes16 out;
  __builtin_memcpy(&out, picked, sizeof out);
  return out;
#else
  return __builtin_shuffle(from, which);
#endif
}

void place_vertices(const VertexFields& fields, Box* boxes) {
  const uint64_t x = fields.widths[0], y = fields.widths[1], z = fields.widths[2], one = 1;
  const Long4 masks = {(one << x) - 1, (one << y) - 1, (one << z) - 1, 0};
  const auto b = fields.base;
  const Uint8 flip = {0, 0, 0, 0, ~0u, ~0u, ~0u, 0}; // -v = ~v + 1
  const auto base = [&](int axis) { return static_cast<uint32_t>(b[axis]); };
  const Uint8 add = {base(0), base(1), base(2), 0, 1 - base(0), 1 - base(1), 1 - base(2), 0};
  Long4 shifts[8]; // by the field's bit offset in its byte; below 64 even for fields of zero width
  for (uint64_t i = 0; i < 8; ++i) shifts[i] = Long4{i, y == 0 ? 0 : i + x, z == 0 ? 0 : i + x + y, 0};
  const uint8_t* const bits = fields.bits;
  const uint64_t stride = x + y + z;
  const uint32_t count = fields.count, shift = fields.shift;
  uint64_t bit = fields.first_bit;
  for (uint32_t v = 0; v < count; ++v, bit += stride) {
    const uint64_t word = load64(bits + (bit >> 3));
    const Long4 field = (Long4{word, word, word, word} >> shifts[bit & 7u]) & masks;
    const auto halves = reinterpret_cast<Uint8>(field),
               both = __builtin_shufflevector(halves, halves, 0, 2, 4, 6, 0, 2, 4, 6);
    lanes(boxes[v]) = reinterpret_cast<Int8>(((both << shift) ^ flip) + add);
  }
}

/// By byte value: for each bit the number of set bits below it, for each bit 255 if it is set, and the number of set
/// bits.
struct ByteTable {
  uint64_t below[256], set[256];
  uint8_t count[256];
  constexpr ByteTable() : below(), set(), count() {
    for (uint32_t byte = 0; byte < 256; ++byte) {
      uint8_t seen = 0;
      for (uint32_t i = 0; i < 8; ++i) {
        below[byte] |= uint64_t{seen} << (8 * i);
        const bool is_set = ((byte >> i) & 1u) != 0;
        set[byte] |= (is_set ? uint64_t{255} : 0) << (8 * i);
        seen = static_cast<uint8_t>(seen + (is_set ? 1 : 0));
      }
      count[byte] = seen;
    }
  }
};
constexpr ByteTable kBytes;

/// Expands fields of 0..8 bits to one byte each, four per step.
[[gnu::always_inline]] inline void spread_fields(const uint8_t* bits, uint64_t at, uint32_t width, uint32_t count,
                                                 uint8_t* out) {
  const uint64_t pair = (uint64_t{1} << (2 * width)) - 1;
  const uint32_t single = (1u << width) - 1;
  for (uint32_t i = 0; i < count; i += 4, at += uint64_t{4} * width) {
    const uint64_t word = read_bits(bits, at, 4 * width);
    const uint64_t pairs = (word & pair) | (word >> (2 * width) << 16);
    const uint64_t low = pairs & (single * 0x10001u), high = (pairs >> width) & (single * 0x10001u);
    const auto four = static_cast<uint32_t>(low | high << 8);
    __builtin_memcpy(out + i, &four, sizeof four);
  }
}

void number_corners(const CornerBits& corners, uint8_t* vertices) {
  uint8_t named[384 + kSpareIds];           // 16 bytes are readable behind any entry
  const uint8_t* const bits = corners.bits; // local copies: byte stores might alias the struct
  const uint32_t corner_count = corners.corner_count, fresh_bit = corners.fresh_bit;
  spread_fields(bits, corners.explicit_bit, corners.index_bits, corner_count - corners.vertex_count, named);
  constexpr uint64_t kIota = 0x0706050403020100, kByteOnes = 0x0101010101010101;
  uint32_t used = 0;
  for (uint32_t c = 0; c < corner_count; c += 8) {
    const uint32_t bit = fresh_bit + c, left = corner_count - c;
    const auto byte = static_cast<uint8_t>(read_bits(bits, bit, left < 8 ? left : 8));
    const uint64_t below = kBytes.below[byte];
    Bytes16 from;
    __builtin_memcpy(&from, named + (c - used), sizeof from);
    const Bytes16 picked = pick_bytes(from, reinterpret_cast<Bytes16>(Long2{kIota - below, 0}));
    uint64_t taken;
    __builtin_memcpy(&taken, &picked, sizeof taken); // not a subscript, which GCC 12 miscompiles under sanitizers
    const uint64_t set = kBytes.set[byte], fresh = (below + (used & 127u) * kByteOnes) ^ ((used & 128u) * kByteOnes);
    const uint64_t eight = (fresh & set) | (taken & ~set);
    __builtin_memcpy(vertices + c, &eight, sizeof eight);
    used += kBytes.count[byte];
  }
}

void box_leaves(const Box* boxes, const uint8_t* vertices, const LeafCorners* leaves, uint32_t count, Box* out) {
  for (uint32_t i = 0; i < count; ++i) {
    const LeafCorners& leaf = leaves[i];
    Int8 box = lanes(boxes[vertices[leaf.kept[0]]]);
    extend(box, lanes(boxes[vertices[leaf.kept[1]]]));
    // Eight corners per step. The first corner replaces missing ones.
    for (uint32_t c = leaf.begin; c < leaf.end; c += 8) {
      uint64_t eight = load64(vertices + c);
      if (const uint32_t left = leaf.end - c; left < 8) {
        const uint64_t beyond = ~uint64_t{0} << (8 * left);
        eight = (eight & ~beyond) | (uint64_t{vertices[c]} * 0x0101010101010101 & beyond);
      }
      Int8 other = lanes(boxes[eight & 255u]); // two independent minimum chains
      extend(box, lanes(boxes[(eight >> 8) & 255u]));
      extend(other, lanes(boxes[(eight >> 16) & 255u]));
      extend(box, lanes(boxes[(eight >> 24) & 255u]));
      extend(other, lanes(boxes[(eight >> 32) & 255u]));
      extend(box, lanes(boxes[(eight >> 40) & 255u]));
      extend(other, lanes(boxes[(eight >> 48) & 255u]));
      extend(box, lanes(boxes[eight >> 56]));
      extend(box, other);
    }
    lanes(out[i]) = box;
  }
}

void pack_children(const Box* children, uint32_t count, NodeBoxes& node, Box& whole) {
  Int8 all = lanes(children[0]);
  for (uint32_t child = 1; child < count; ++child) extend(all, lanes(children[child]));
  lanes(whole) = all;
  uint32_t exponents[3], ups[3];
  node.exponents = 0;
  for (uint32_t axis = 0; axis < 3; ++axis) {
    node.origin[axis] = whole.lo[axis];
    const auto extent = static_cast<uint32_t>(-int64_t{whole.minus_hi[axis]} - whole.lo[axis]); // < 2^31
    uint32_t exponent = extent < 256 ? 0 : 24 - static_cast<uint32_t>(__builtin_clz(extent));
    exponent += extent > 255u << exponent ? 1 : 0; // exponent is at most 23
    exponents[axis] = exponent;
    ups[axis] = (1u << exponent) - static_cast<uint32_t>(whole.lo[axis]); // rounds up, as ~minus_hi is hi - 1
    node.exponents |= exponent << (5 * axis);
  }
  const auto down = [&](uint32_t axis) { return 0 - static_cast<uint32_t>(whole.lo[axis]); };
  const Uint8 flip = {0, 0, 0, 0, ~0u, ~0u, ~0u, ~0u}, add = {down(0), down(1), down(2), 0, ups[0], ups[1], ups[2], 1};
  const Uint8 shifts = {exponents[0], exponents[1], exponents[2], 0, exponents[0], exponents[1], exponents[2], 0};
  uint32_t bytes[2][8];
  for (uint32_t half = 0; half < 2; ++half) {
    Uint8 four = {};
    const uint32_t first = 4 * half, end = count < first + 4 ? count : first + 4;
    for (uint32_t child = first; child < end; ++child) {
      const auto box = reinterpret_cast<Uint8>(lanes(children[child]));
      four |= (((box ^ flip) + add) >> shifts) << (8 * (child - first));
    }
    __builtin_memcpy(bytes[half], &four, sizeof four);
  }
  const uint64_t unused = count < 8 ? ~uint64_t{0} << (8 * count) : 0;
  for (uint32_t axis = 0; axis < 3; ++axis) {
    node.lo[axis] = (bytes[0][axis] | uint64_t{bytes[1][axis]} << 32) | unused;
    node.hi[axis] = bytes[0][4 + axis] | uint64_t{bytes[1][4 + axis]} << 32;
  }
}

} // namespace
} // namespace packtrace::node_kernels
