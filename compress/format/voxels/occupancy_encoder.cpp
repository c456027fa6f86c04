#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "compress/format/layout/bit_stream.h"
#include "compress/format/voxels/cell_pyramid.h"
#include "compress/format/voxels/occupancy_stream.h"
#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

using namespace voxels;

/// Levels below which the whole grid is one top cell.
uint32_t most_levels(VoxelIndex size) {
  const uint32_t longest = std::max({size[0], size[1], size[2]});
  return std::clamp(bits_for_count(longest) + 1, kMinLevels, kMaxLevels);
}

/// Voxels whose neighbours through faces are all set: nothing can see them.
VoxelSet hidden_voxels(const VoxelSet& set) {
  VoxelSet hidden(set.size());
  set.for_each([&](VoxelIndex v) {
    const int64_t x = v[0], y = v[1], z = v[2];
    if (set.contains(x - 1, y, z) && set.contains(x + 1, y, z) && set.contains(x, y - 1, z) &&
        set.contains(x, y + 1, z) && set.contains(x, y, z - 1) && set.contains(x, y, z + 1))
      hidden.set(v);
  });
  return hidden;
}

uint64_t with_ranks(uint64_t mask_bits) { return 32 * (words_for_bits(mask_bits) + rank_words(mask_bits)); }

/// Bits of a stream without pointers and swatches.
uint64_t stream_bits(const CellPyramid& pyramid, VoxelIndex size, uint32_t levels, bool full) {
  const auto nodes = [&](uint32_t k) { return full ? pyramid.mixed_count(k) : pyramid.any_count(k); };
  uint64_t cells = 1;
  for (const uint32_t n : size) cells *= ((n - 1) >> (levels - 1)) + 1;
  uint64_t bits = with_ranks(cells);
  if (full) bits += 32 * words_for_bits(cells - nodes(levels - 1));
  for (uint32_t k = levels - 1; k > 1; --k) {
    bits += with_ranks(8 * nodes(k));
    if (full) bits += 32 * words_for_bits(8 * nodes(k) - nodes(k - 1));
  }
  return bits + 32 * words_for_bits(8 * nodes(1));
}

/// A level before it is written: bits of its masks and, where they are 0, whether the cell is full.
struct LevelBits {
  std::vector<uint8_t> masks, full; ///< by node; level 0: 8 top cells each
  std::vector<uint32_t> pointers;   ///< by set bit of the level above; empty: the n-th has the n-th node
  uint64_t bit_count = 0;
};

/// Words of a stream, bit by bit.
class WordWriter {
public:
  void put(uint64_t value, uint32_t bits) {
    for (; bits > 0;) {
      if (used_ == 0) words_.push_back(0);
      const uint32_t count = std::min(bits, 32 - used_);
      words_.back() |= static_cast<uint32_t>((value & ((uint64_t{1} << count) - 1)) << used_);
      value >>= count, bits -= count, used_ = (used_ + count) % 32;
    }
  }
  void align() { used_ = 0; }
  std::vector<uint32_t>& words() { return words_; }

private:
  std::vector<uint32_t> words_;
  uint32_t used_ = 0; // bits of the last word; 0: it is complete
};

class Encoder {
public:
  Encoder(const VoxelSet& set, const OccupancyOptions& options) : set_(set), options_(options) {
    const auto require = [](bool ok, const char* what) {
      if (!ok) throw Error(ErrorKind::kUsage, std::string("voxels: ") + what);
    };
    require(options.levels == 0 || (options.levels >= kMinLevels && options.levels <= kMaxLevels),
            "levels must be 2..16");
    require(options.palette_count <= kMaxSwatches, "a palette has at most 256 swatches");
    require(options.swatches.empty() || (!options.dag && options.palette_count > 0),
            "swatches need a palette, and equal subtrees cannot be shared then");
    require(set.count() > 0, "the set is empty");
  }

  OccupancyStream run() {
    std::optional<VoxelSet> hidden;
    if (!options_.swatches.empty()) hidden = hidden_voxels(set_);
    const uint32_t most = options_.levels != 0 ? options_.levels : most_levels(set_.size());
    const CellPyramid pyramid(set_, most, hidden ? &*hidden : nullptr);
    choose(pyramid, most);
    build(pyramid);
    if (options_.dag) share();
    return write();
  }

private:
  void choose(const CellPyramid& pyramid, uint32_t most) {
    uint64_t best = std::numeric_limits<uint64_t>::max();
    for (uint32_t levels = options_.levels != 0 ? most : kMinLevels; levels <= most; ++levels)
      for (const bool full : {false, true}) {
        if (options_.full && full != *options_.full) continue;
        const uint64_t bits = stream_bits(pyramid, set_.size(), levels, full);
        if (bits < best) best = bits, levels_ = levels, full_ = full;
      }
  }

  void build(const CellPyramid& pyramid) {
    const VoxelIndex top = pyramid.any(levels_ - 1).size();
    const auto is_node = [&](uint32_t k, VoxelIndex c) {
      return pyramid.any(k).test(c) && !(full_ && k > 0 && pyramid.full(k).test(c));
    };
    level_.resize(levels_);
    level_[0].bit_count = uint64_t{top[0]} * top[1] * top[2];
    level_[0].masks.resize((level_[0].bit_count + 7) / 8), level_[0].full.resize(level_[0].masks.size());
    std::vector<VoxelIndex> cells; // of the nodes of the level below
    uint64_t bit = 0;
    for (uint32_t z = 0; z < top[2]; ++z)
      for (uint32_t y = 0; y < top[1]; ++y)
        for (uint32_t x = 0; x < top[0]; ++x, ++bit) {
          const auto one = static_cast<uint8_t>(1u << (bit % 8));
          if (is_node(levels_ - 1, {x, y, z}))
            level_[0].masks[bit / 8] |= one, cells.push_back({x, y, z});
          else if (full_ && pyramid.full(levels_ - 1).test({x, y, z}))
            level_[0].full[bit / 8] |= one;
        }
    for (uint32_t l = 1; l < levels_; ++l) cells = build_level(pyramid, l, cells, is_node);
  }

  /// Fills level l, whose nodes represent `cells`, and returns the cells of the nodes below.
  template <class IsNode>
  std::vector<VoxelIndex> build_level(const CellPyramid& pyramid, uint32_t l, const std::vector<VoxelIndex>& cells,
                                      const IsNode& is_node) {
    const uint32_t k = levels_ - 1 - l; // the octants have 2^k voxels along an axis
    const VoxelIndex size = pyramid.any(k).size();
    LevelBits& level = level_[l];
    if (cells.size() > std::numeric_limits<uint32_t>::max() / 8)
      throw Error(ErrorKind::kLimitExceeded, "voxels: a level has more than 2^32 bits; use fewer voxels");
    level.bit_count = 8 * cells.size();
    level.masks.reserve(cells.size()), level.full.reserve(cells.size());
    std::vector<VoxelIndex> below;
    for (const VoxelIndex& cell : cells) {
      uint32_t mask = 0, full = 0;
      for (uint32_t o = 0; o < 8; ++o) {
        const VoxelIndex c = {2 * cell[0] + (o & 1), 2 * cell[1] + (o >> 1 & 1), 2 * cell[2] + (o >> 2)};
        if (c[0] >= size[0] || c[1] >= size[1] || c[2] >= size[2]) continue;
        if (is_node(k, c)) {
          mask |= 1u << o;
          if (k > 0)
            below.push_back(c);
          else if (!options_.swatches.empty())
            leaf_voxels_.push_back(c);
        } else if (full_ && k > 0 && pyramid.full(k).test(c)) {
          full |= 1u << o;
        }
      }
      level.masks.push_back(static_cast<uint8_t>(mask)), level.full.push_back(static_cast<uint8_t>(full));
    }
    return below;
  }

  /// Numbers of the distinct subtrees of each level from `first` on, by node; masks and full bits of the last levels
  /// are compared in full, so that equal numbers mean equal voxels.
  std::vector<std::vector<uint32_t>> subtree_numbers() const {
    std::vector<std::vector<uint32_t>> numbers(levels_);
    for (uint32_t l = levels_ - 1; l > 0; --l) {
      const LevelBits& level = level_[l];
      std::map<std::vector<uint32_t>, uint32_t> known;
      std::vector<uint32_t> key;
      size_t child = 0;
      for (size_t n = 0; n < level.masks.size(); ++n) {
        key.assign(1, uint32_t{level.masks[n]} | uint32_t{level.full[n]} << 8);
        if (l + 1 < levels_)
          for (uint32_t m = level.masks[n]; m != 0; m &= m - 1) key.push_back(numbers[l + 1][child++]);
        numbers[l].push_back(known.emplace(key, static_cast<uint32_t>(known.size())).first->second);
      }
    }
    return numbers;
  }

  /// A copy of the levels in which levels first..levels_ - 2 store each subtree once.
  std::vector<LevelBits> shared_from(uint32_t first, const std::vector<std::vector<uint32_t>>& numbers) const {
    std::vector<LevelBits> result(level_.begin(), level_.begin() + first);
    std::vector<uint32_t> nodes(level_[first].masks.size()); // of the level, that the bits above refer to
    for (size_t i = 0; i < nodes.size(); ++i) nodes[i] = static_cast<uint32_t>(i);
    for (uint32_t l = first; l < levels_; ++l) {
      const LevelBits& level = level_[l];
      std::vector<uint32_t> first_child(level.masks.size() + 1);
      for (size_t n = 0; n < level.masks.size(); ++n)
        first_child[n + 1] = first_child[n] + static_cast<uint32_t>(std::popcount(level.masks[n]));
      LevelBits& out = result.emplace_back();
      std::vector<uint32_t> stored(level.masks.size(), kNoPlace), children;
      for (const uint32_t node : nodes) {
        uint32_t& place = stored[numbers[l][node]];
        const bool share = l + 1 < levels_; // a pointer to a leaf would take as much as the leaf
        if (place == kNoPlace || !share) {
          place = static_cast<uint32_t>(out.masks.size());
          out.masks.push_back(level.masks[node]), out.full.push_back(level.full[node]);
          for (uint32_t c = first_child[node]; c < first_child[node + 1]; ++c) children.push_back(c);
        }
        if (share) out.pointers.push_back(place);
      }
      out.bit_count = 8 * out.masks.size();
      nodes = std::move(children);
    }
    return result;
  }

  uint64_t bits_of(const std::vector<LevelBits>& levels) const {
    uint64_t bits = 0;
    for (const LevelBits& level : levels) {
      bits += with_ranks(level.bit_count);
      if (full_) bits += level.bit_count; // at most; the same for all that are compared, nearly
      bits += level.pointers.size() * bits_for_count(level.masks.size());
    }
    return bits;
  }

  void share() {
    const std::vector<std::vector<uint32_t>> numbers = subtree_numbers();
    std::vector<LevelBits> best = level_;
    for (uint32_t first = 1; first + 1 < levels_; ++first) {
      std::vector<LevelBits> shared = shared_from(first, numbers);
      if (bits_of(shared) < bits_of(best)) best = std::move(shared);
    }
    level_ = std::move(best);
  }

  OccupancyStream write() const {
    OccupancyHeader header{};
    header.levels = levels_;
    header.flags = full_ ? kHasFull : 0;
    header.size = set_.size();
    for (size_t a = 0; a < 3; ++a) header.top[a] = ((header.size[a] - 1) >> (levels_ - 1)) + 1;
    if (!options_.swatches.empty()) {
      header.palette_count = options_.palette_count;
      header.swatch_bits = std::max(bits_for_count(options_.palette_count), 1u);
    }
    WordWriter writer;
    for (uint32_t l = 0; l < levels_; ++l) write_level(header, l, writer);
    if (header.swatch_bits > 0) write_swatches(header.swatch_bits, writer);
    header.word_count = writer.words().size();
    return OccupancyStream(header, std::move(writer.words()));
  }

  void write_level(OccupancyHeader& header, uint32_t l, WordWriter& writer) const {
    const LevelBits& level = level_[l];
    const bool last = l + 1 == levels_;
    OccupancyLevel& record = header.level[l];
    record.mask_bits = static_cast<uint32_t>(level.bit_count);
    const size_t begin = writer.words().size();
    for (const uint8_t mask : level.masks) {
      writer.put(mask, 8);
      record.set_bits += static_cast<uint32_t>(std::popcount(mask));
    }
    writer.align();
    if (!last || header.swatch_bits > 0) write_ranks(begin, record.mask_bits, writer);
    if (!last && full_) {
      for (uint64_t bit = 0; bit < level.bit_count; ++bit)
        if ((level.masks[bit / 8] >> (bit % 8) & 1) == 0) writer.put(level.full[bit / 8] >> (bit % 8) & 1, 1);
      writer.align();
    }
    if (level.pointers.empty()) return;
    record.pointer_bits = std::max(bits_for_count(level.masks.size()), 1u);
    for (const uint32_t pointer : level.pointers) writer.put(pointer, record.pointer_bits);
    writer.align();
  }

  static void write_ranks(size_t begin, uint64_t mask_bits, WordWriter& writer) {
    std::vector<uint32_t> groups, blocks;
    uint32_t rank = 0, group_rank = 0;
    for (uint64_t w = 0; w < words_for_bits(mask_bits); ++w) {
      if (const uint64_t block = w * 32 / kRankBits; block > 0 && w * 32 % kRankBits == 0) {
        if (block % kRankGroupBlocks == 0) groups.push_back(group_rank = rank);
        blocks.push_back(rank - group_rank);
      }
      rank += static_cast<uint32_t>(std::popcount(writer.words()[begin + static_cast<size_t>(w)]));
    }
    for (const uint32_t group : groups) writer.put(group, 32);
    for (const uint32_t block : blocks) writer.put(block, 16);
    writer.align();
  }

  void write_swatches(uint32_t bits, WordWriter& writer) const {
    std::vector<uint64_t> row_rank; // set voxels before each row
    uint64_t rank = 0;
    const VoxelIndex size = set_.size();
    for (uint32_t z = 0; z < size[2]; ++z)
      for (uint32_t y = 0; y < size[1]; ++y) {
        row_rank.push_back(rank);
        for (uint32_t w = 0; w < set_.row_words(); ++w) rank += static_cast<uint64_t>(std::popcount(set_.row(y, z)[w]));
      }
    for (const VoxelIndex& v : leaf_voxels_) {
      uint64_t at = row_rank[size_t{v[2]} * size[1] + v[1]];
      const uint64_t* const row = set_.row(v[1], v[2]);
      for (uint32_t w = 0; w < v[0] / 64; ++w) at += static_cast<uint64_t>(std::popcount(row[w]));
      at += static_cast<uint64_t>(std::popcount(row[v[0] / 64] & ((uint64_t{1} << (v[0] % 64)) - 1)));
      writer.put(options_.swatches[static_cast<size_t>(at)], bits);
    }
    writer.align();
  }

  static constexpr uint32_t kNoPlace = ~0u;
  const VoxelSet& set_;
  const OccupancyOptions& options_;
  uint32_t levels_ = 0;
  bool full_ = false;
  std::vector<LevelBits> level_;
  std::vector<VoxelIndex> leaf_voxels_; // in the stream's order, if they have swatches
};

} // namespace

OccupancyStream encode_occupancy(const VoxelSet& set, const OccupancyOptions& options) {
  return Encoder(set, options).run();
}

} // namespace packtrace
