#include <algorithm>
#include <bit>

#include "compress/format/voxels/occupancy_stream.h"

namespace packtrace {
namespace {

using namespace voxels;

/// Reads the parts of a stream in order and compares each with the header.
class OccupancyCheck {
public:
  OccupancyCheck(const OccupancyHeader& header, std::span<const uint32_t> words) : header_(header), words_(words) {}

  std::optional<std::string_view> run() {
    if (const auto fault = shape()) return fault;
    for (uint32_t l = 0; l < header_.levels; ++l)
      if (const auto fault = level(l)) return fault;
    if (const auto fault = swatches()) return fault;
    if (at_ != words_.size()) return "words behind the last part";
    return std::nullopt;
  }

private:
  std::optional<std::string_view> shape() const {
    if (header_.levels < kMinLevels || header_.levels > kMaxLevels) return "number of levels";
    if ((header_.flags & ~kOccupancyFlags) != 0) return "flags";
    if (header_.word_count != words_.size()) return "number of words";
    uint64_t cells = 1;
    for (size_t a = 0; a < 3; ++a) {
      if (header_.size[a] < 1 || header_.size[a] > kMaxGridSize) return "grid size";
      if (header_.top[a] != ((header_.size[a] - 1) >> (header_.levels - 1)) + 1) return "top cells";
      cells *= header_.top[a];
    }
    if (cells != header_.level[0].mask_bits) return "number of top cells";
    if (header_.level[0].pointer_bits != 0) return "pointers to the top";
    if (header_.swatch_bits > 8 || header_.palette_count > kMaxSwatches ||
        (header_.palette_count == 0) != (header_.swatch_bits == 0) || header_.palette_count > 1u << header_.swatch_bits)
      return "palette";
    for (uint32_t l = 0; l < kMaxLevels; ++l) {
      const OccupancyLevel& level = header_.level[l];
      if (level.reserved != 0) return "reserved fields";
      if (l >= header_.levels && (level.mask_bits != 0 || level.set_bits != 0 || level.pointer_bits != 0))
        return "levels behind the last";
    }
    return std::nullopt;
  }

  /// Takes the words of a part; false if the stream ends before.
  bool take(uint64_t count, std::span<const uint32_t>& part) {
    if (count > words_.size() - at_) return false;
    part = words_.subspan(at_, static_cast<size_t>(count));
    at_ += static_cast<size_t>(count);
    return true;
  }

  static bool zero_tail(std::span<const uint32_t> part, uint64_t bits) {
    return bits % 32 == 0 || part[static_cast<size_t>(bits / 32)] >> (bits % 32) == 0;
  }

  std::optional<std::string_view> level(uint32_t l) {
    const OccupancyLevel& level = header_.level[l];
    const bool last = l + 1 == header_.levels;
    if (l > 0) {
      if (level.mask_bits % 8 != 0) return "mask bits";
      const uint64_t nodes = level.mask_bits / 8, edges = header_.level[l - 1].set_bits;
      if (level.pointer_bits == 0 ? nodes != edges : nodes > edges) return "number of nodes";
      if (level.pointer_bits > 32) return "pointer bits";
    }
    std::span<const uint32_t> masks, part;
    if (!take(words_for_bits(level.mask_bits), masks)) return "masks end early";
    if (!zero_tail(masks, level.mask_bits)) return "bits behind the masks";
    if (const auto fault = ranks(level, masks, !last || header_.swatch_bits > 0)) return fault;
    if (!last && (header_.flags & kHasFull) != 0) {
      const uint64_t bits = uint64_t{level.mask_bits} - level.set_bits;
      if (!take(words_for_bits(bits), part)) return "full bits end early";
      if (!zero_tail(part, bits)) return "bits behind the full bits";
    }
    return level.pointer_bits > 0 ? pointers(l) : std::nullopt;
  }

  /// Compares the stored ranks with those of the masks.
  std::optional<std::string_view> ranks(const OccupancyLevel& level, std::span<const uint32_t> masks, bool stored) {
    std::span<const uint32_t> part;
    if (stored && !take(rank_words(level.mask_bits), part)) return "ranks end early";
    const size_t blocks = level.mask_bits == 0 ? 0 : (level.mask_bits - 1) / kRankBits;
    const size_t groups = blocks / kRankGroupBlocks;
    uint64_t rank = 0, group_rank = 0;
    for (size_t w = 0; w < masks.size(); ++w) {
      if (const size_t block = w * 32 / kRankBits; stored && block > 0 && w * 32 % kRankBits == 0) {
        if (block % kRankGroupBlocks == 0) {
          group_rank = rank;
          if (part[block / kRankGroupBlocks - 1] != rank) return "rank of a group";
        }
        if ((part[groups + (block - 1) / 2] >> (16 * ((block - 1) % 2)) & 0xffffu) != rank - group_rank)
          return "rank of a block";
      }
      rank += static_cast<uint64_t>(std::popcount(masks[w]));
    }
    if (stored && blocks % 2 == 1 && part.back() >> 16 != 0) return "bits behind the ranks";
    if (rank != level.set_bits) return "number of set bits";
    return std::nullopt;
  }

  std::optional<std::string_view> pointers(uint32_t l) {
    const OccupancyLevel& level = header_.level[l];
    return packed(header_.level[l - 1].set_bits, level.pointer_bits, level.mask_bits / 8,
                  {"pointers end early", "bits behind the pointers", "pointer"});
  }

  std::optional<std::string_view> swatches() {
    if (header_.swatch_bits == 0) return std::nullopt;
    return packed(header_.level[header_.levels - 1].set_bits, header_.swatch_bits, header_.palette_count,
                  {"swatches end early", "bits behind the swatches", "swatch"});
  }

  struct PackedFaults {
    std::string_view short_part, tail, value;
  };
  /// Takes `count` packed values, which must be below `limit`.
  std::optional<std::string_view> packed(uint64_t count, uint32_t width, uint64_t limit, const PackedFaults& faults) {
    std::span<const uint32_t> part;
    if (!take(words_for_bits(count * width), part)) return faults.short_part;
    if (!zero_tail(part, count * width)) return faults.tail;
    for (uint64_t i = 0; i < count; ++i)
      if (read_packed(part.data(), i * width, width) >= limit) return faults.value;
    return std::nullopt;
  }

  const OccupancyHeader& header_;
  std::span<const uint32_t> words_;
  size_t at_ = 0;
};

} // namespace

std::optional<std::string_view> find_occupancy_fault(const OccupancyHeader& header, std::span<const uint32_t> words) {
  return OccupancyCheck(header, words).run();
}

} // namespace packtrace
