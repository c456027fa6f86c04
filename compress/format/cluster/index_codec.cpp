#include "compress/format/cluster/index_codec.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstring>

#include "compress/format/layout/bit_stream.h"

namespace packtrace {
namespace {

/// Up to 128 bits starting at bit `first`, least significant first. Bits at and beyond `count` are zero.
struct Mask128 {
  std::array<uint64_t, 2> word{};

  Mask128(const uint8_t* bits, uint32_t first, uint32_t count) {
    word[0] = read_bits64(bits, first, count < 64 ? count : 64);
    if (count > 64) word[1] = read_bits64(bits, first + 64, count - 64);
  }
  bool test(uint32_t bit) const { return (word[bit >> 6] >> (bit & 63u)) & 1u; }
  uint32_t count() const { return static_cast<uint32_t>(std::popcount(word[0]) + std::popcount(word[1])); }

  /// Copy with only bits 0..bit.
  Mask128 up_to(uint32_t bit) const {
    Mask128 result = *this;
    const uint64_t last = ~uint64_t{0} >> (63u - (bit & 63u));
    if (bit < 64)
      result.word = {word[0] & last, 0};
    else
      result.word[1] &= last;
    return result;
  }
  /// Number of the highest set bit, or -1 if none is set.
  int32_t highest() const {
    if (word[1] != 0) return 127 - std::countl_zero(word[1]);
    return 63 - std::countl_zero(word[0]);
  }
};

/// Number of fresh corners before corner `end`.
uint32_t fresh_before(const uint8_t* bits, uint32_t fresh_bit, uint32_t end) {
  uint32_t count = 0, at = 0;
  for (; at + 57 <= end; at += 57) count += static_cast<uint32_t>(std::popcount(read_bits(bits, fresh_bit + at, 57)));
  return count + static_cast<uint32_t>(std::popcount(read_bits(bits, fresh_bit + at, end - at)));
}

uint32_t corner_vertex(const uint8_t* bits, const IndexLayout& layout, uint32_t corner) {
  const uint32_t rank = fresh_before(bits, layout.fresh_bit(), corner);
  if (read_bits(bits, layout.fresh_bit() + corner, 1) != 0) return rank;
  const uint32_t width = layout.index_bits();
  return static_cast<uint32_t>(read_bits(bits, layout.explicit_bit() + (corner - rank) * width, width));
}

} // namespace

uint32_t IndexLayout::index_bits() const { return bits_for_count(vertex_count); }

void write_strips(const Strips& strips, BitWriter& writer) {
  for (const uint8_t bit : strips.restart) writer.put(bit, 1);
  for (const uint8_t bit : strips.left) writer.put(bit, 1);
  uint32_t used = 0;
  for (const uint32_t vertex : strips.corners) {
    writer.put(vertex == used ? 1 : 0, 1);
    used += vertex == used;
  }
  assert(used == strips.layout.vertex_count);
  used = 0;
  const uint32_t width = strips.layout.index_bits();
  for (const uint32_t vertex : strips.corners) {
    if (vertex == used)
      ++used;
    else
      writer.put(vertex, width);
  }
}

namespace {

/// Vertex numbers of the corner list, with room for whole words behind the last.
using CornerList = std::array<uint8_t, kMaxClusterCorners + 64>;

/// Reads the corner list. Has no branch per corner, as fresh corners follow no pattern.
void read_corners(const uint8_t* bits, const IndexLayout& layout, CornerList& corners) {
  constexpr uint64_t kOnes = 0x0101010101010101u;
  constexpr uint32_t kStep = 56; // whole bytes of fresh bits, in one field
  const uint32_t width = layout.index_bits(), count = layout.corner_count();
  uint64_t explicit_at = layout.explicit_bit();
  uint32_t used = 0;
  for (uint32_t first = 0; first < count; first += kStep) {
    const uint32_t here = std::min(count - first, kStep);
    const uint64_t fresh = read_bits(bits, layout.fresh_bit() + first, here);
    for (uint32_t i = 0; i < here; i += 8) {
      // Byte k of `ones` is fresh bit k; byte k of `numbers` is the number of fresh corners before corner k.
      const uint64_t spread = (((fresh >> i) & 0xffu) * kOnes) & 0x8040201008040201u;
      const uint64_t ones = ((spread + 0x7f7f7f7f7f7f7f7fu) >> 7) & kOnes, sums = ones * kOnes;
      const uint64_t numbers = (sums << 8) + (used & 0xffu) * kOnes; // bytes overflow only after vertex 255
      std::memcpy(corners.data() + first + i, &numbers, sizeof numbers);
      used += static_cast<uint32_t>(sums >> 56);
    }
    for (uint64_t named = ~fresh & ((uint64_t{1} << here) - 1); named != 0; named &= named - 1, explicit_at += width)
      corners[first + static_cast<uint32_t>(std::countr_zero(named))] =
          static_cast<uint8_t>(read_bits(bits, explicit_at, width));
  }
}

} // namespace

void decode_triangles(const uint8_t* bits, const IndexLayout& layout, uint32_t base, std::span<Triangle> triangles) {
  assert(triangles.size() >= layout.triangle_count);
  CornerList corners;
  read_corners(bits, layout, corners);
  const uint8_t* next = corners.data();
  Triangle* out = triangles.data();
  Triangle t{};
  for (uint32_t first = 0; first < layout.triangle_count; first += 32) {
    const uint32_t count = std::min(layout.triangle_count - first, 32u);
    auto restart = static_cast<uint32_t>(read_bits(bits, first, count));
    auto left = static_cast<uint32_t>(read_bits(bits, layout.triangle_count + first, count));
    for (uint32_t i = 0; i < count; ++i, restart >>= 1, left >>= 1) {
      const uint32_t begins = 0 - (restart & 1u), goes_left = 0 - (left & 1u); // masks
      const auto select = [](uint32_t mask, uint32_t a, uint32_t b) { return b ^ ((a ^ b) & mask); };
      const uint32_t x = select(goes_left, t.x, t.z), y = select(goes_left, t.z, t.y);
      t.x = select(begins, base + next[0], x);
      t.y = select(begins, base + next[1], y);
      next += begins & 2u;
      t.z = base + *next++;
      *out++ = t;
    }
  }
}

Triangle decode_triangle(const uint8_t* bits, const IndexLayout& layout, uint32_t index) {
  const Mask128 restarts = Mask128(bits, 0, layout.triangle_count).up_to(index);
  const uint32_t corner = index + 2 * restarts.count(); // of the corner that this triangle adds
  const auto first = static_cast<uint32_t>(restarts.highest());
  const auto vertex = [&](uint32_t at) { return corner_vertex(bits, layout, at); };
  if (first == index) return {vertex(corner - 2), vertex(corner - 1), vertex(corner)};

  // One of a, b is the corner added before this one. The other was last replaced at the last turn in the other
  // direction in this strip, by the corner added before that turn. Without such a turn it is still a corner of the
  // strip's first triangle.
  Mask128 other(bits, layout.triangle_count, layout.triangle_count);
  const bool is_left = other.test(index);
  if (is_left) other.word = {~other.word[0], ~other.word[1]};
  const int32_t turn = other.up_to(index).highest();
  const uint32_t first_corner = corner - (index - first); // of the last corner of the strip's first triangle
  const uint32_t kept = turn > static_cast<int32_t>(first) ? vertex(corner - (index - static_cast<uint32_t>(turn)) - 1)
                                                           : vertex(is_left ? first_corner - 2 : first_corner - 1);
  const uint32_t previous = vertex(corner - 1), newest = vertex(corner);
  return is_left ? Triangle(kept, previous, newest) : Triangle(previous, kept, newest);
}

bool strips_are_valid(const uint8_t* bits, const IndexLayout& layout) {
  const uint32_t n = layout.triangle_count;
  const Mask128 restart(bits, 0, n), left(bits, n, n);
  if (!restart.test(0) || restart.count() != layout.strip_count) return false;
  if ((restart.word[0] & left.word[0]) != 0 || (restart.word[1] & left.word[1]) != 0) return false;
  const uint32_t width = layout.index_bits();
  if (fresh_before(bits, layout.fresh_bit(), layout.corner_count()) != layout.vertex_count) return false;
  // The k-th corner that is not fresh has (corner - k) fresh corners before it.
  uint64_t explicit_at = layout.explicit_bit();
  bool valid = true;
  for (uint32_t first = 0, k = 0; first < layout.corner_count(); first += 32) {
    const uint32_t count = std::min(layout.corner_count() - first, 32u);
    uint64_t named = ~read_bits(bits, layout.fresh_bit() + first, count) & ((uint64_t{1} << count) - 1);
    for (; named != 0; named &= named - 1, ++k, explicit_at += width)
      valid &= read_bits(bits, explicit_at, width) < first + static_cast<uint32_t>(std::countr_zero(named)) - k;
  }
  return valid;
}

} // namespace packtrace
