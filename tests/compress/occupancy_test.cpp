#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "compress/format/voxels/occupancy_stream.h"
#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

uint32_t next(uint32_t& state) {
  state ^= state << 13, state ^= state >> 17, state ^= state << 5;
  return state;
}

/// A shell around a ball, with its inside if `solid`, and some loose voxels.
VoxelSet ball(VoxelIndex size, double radius, bool solid) {
  VoxelSet set(size);
  for (uint32_t z = 0; z < size[2]; ++z)
    for (uint32_t y = 0; y < size[1]; ++y)
      for (uint32_t x = 0; x < size[0]; ++x) {
        const DVec3 from_center = DVec3(x, y, z) + 0.5 - 0.5 * DVec3(size[0], size[1], size[2]);
        const double d = glm::length(from_center) - radius;
        if (solid ? d < 0.5 : std::abs(d) < 0.5) set.set({x, y, z});
      }
  uint32_t state = 7;
  for (int i = 0; i < 20; ++i) set.set({next(state) % size[0], next(state) % size[1], next(state) % size[2]});
  return set;
}

const std::vector<VoxelIndex> kSizes = {{1, 1, 1}, {5, 1, 3}, {40, 40, 32}, {65, 17, 130}, {128, 128, 128}};

TEST(Occupancy, DecodesToTheEncodedSet) {
  for (const VoxelIndex& size : kSizes)
    for (const bool solid : {false, true})
      for (const uint32_t levels : {0u, 2u, 3u, 5u, 9u, 16u})
        for (const int form : {0, 1, 2}) {
          const VoxelSet set = ball(size, 0.45 * *std::ranges::max_element(size), solid);
          OccupancyOptions options;
          options.levels = levels;
          options.dag = form == 2;
          if (form == 1) options.full = true;
          const OccupancyStream stream = encode_occupancy(set, options);
          EXPECT_EQ(find_occupancy_fault(stream.header(), stream.words()), std::nullopt);
          ASSERT_TRUE(decode_occupancy(stream) == set) << size[0] << ' ' << levels << ' ' << form;
          ASSERT_EQ(count_occupied(stream), set.count()) << size[0] << ' ' << levels << ' ' << form;
          uint32_t state = 3;
          for (int i = 0; i < 3000; ++i) {
            const VoxelIndex v = {next(state) % size[0], next(state) % size[1], next(state) % size[2]};
            ASSERT_EQ(stream.test(v), set.test(v));
          }
        }
}

TEST(Occupancy, VisibleVoxelsKeepTheirSwatches) {
  const VoxelSet set = ball({50, 40, 45}, 18.0, true);
  std::vector<uint8_t> swatches;
  uint32_t state = 11;
  set.for_each([&](VoxelIndex) { swatches.push_back(static_cast<uint8_t>(next(state) % 200)); });
  OccupancyOptions options;
  options.swatches = swatches;
  options.palette_count = 200;
  options.full = true;
  const OccupancyStream stream = encode_occupancy(set, options);
  EXPECT_EQ(find_occupancy_fault(stream.header(), stream.words()), std::nullopt);
  ASSERT_TRUE(decode_occupancy(stream) == set);
  EXPECT_LT(stream.stored_voxels(), set.count()); // full cells keep none
  size_t i = 0;
  set.for_each([&](VoxelIndex v) {
    const int64_t x = v[0], y = v[1], z = v[2];
    const bool hidden = set.contains(x - 1, y, z) && set.contains(x + 1, y, z) && set.contains(x, y - 1, z) &&
                        set.contains(x, y + 1, z) && set.contains(x, y, z - 1) && set.contains(x, y, z + 1);
    EXPECT_TRUE(hidden || stream.swatch(v) == swatches[i]);
    ++i;
  });
}

TEST(Occupancy, SharingEqualSubtreesTakesFewerBits) {
  VoxelSet set({256, 256, 256}); // a plane and its copies: nearly all subtrees are equal
  for (uint32_t y = 0; y < 256; ++y)
    for (uint32_t x = 0; x < 256; ++x)
      for (uint32_t z = 5; z < 256; z += 64) set.set({x, y, z});
  OccupancyOptions options;
  const uint64_t tree = encode_occupancy(set, options).bits();
  options.dag = true;
  const OccupancyStream dag = encode_occupancy(set, options);
  EXPECT_LT(dag.bits() * 50, tree);
  EXPECT_LT(dag.stored_voxels() * 50, set.count());
  EXPECT_EQ(count_occupied(dag), set.count());
  EXPECT_TRUE(decode_occupancy(dag) == set);
}

TEST(Occupancy, TheIndexTakesOneAndAHalfPercentOfTheMasks) {
  const OccupancyStream stream = encode_occupancy(ball({300, 300, 300}, 140.0, false), {});
  uint64_t ranked = 0;
  for (uint32_t l = 0; l + 1 < stream.levels(); ++l) ranked += stream.header().level[l].mask_bits;
  EXPECT_GT(stream.index_bits(), ranked / 66);
  EXPECT_LT(stream.index_bits(), ranked / 56);
}

TEST(Occupancy, BytesAreFixed) {
  OccupancyOptions options;
  options.levels = 3;
  options.full = true;
  const OccupancyStream stream = encode_occupancy(ball({12, 9, 7}, 4.0, true), options);
  uint64_t hash = 0xcbf29ce484222325u;
  for (const uint32_t word : stream.words()) hash = (hash ^ word) * 0x100000001b3u;
  EXPECT_EQ(stream.words().size(), 20u);
  EXPECT_EQ(hash, 10954377594358567895u);
}

TEST(Occupancy, EveryPrefixAndEveryChangedMaskIsAFault) {
  for (const bool full : {false, true}) {
    OccupancyOptions options;
    options.full = full;
    const OccupancyStream stream = encode_occupancy(ball({40, 40, 32}, 15.0, full), options);
    const std::vector<uint32_t> words(stream.words().begin(), stream.words().end());
    for (size_t count = 0; count < words.size(); ++count) {
      voxels::OccupancyHeader header = stream.header();
      EXPECT_NE(find_occupancy_fault(header, std::span(words).first(count)), std::nullopt);
      header.word_count = count;
      EXPECT_NE(find_occupancy_fault(header, std::span(words).first(count)), std::nullopt) << count;
    }
    for (size_t bit = 0; bit < words.size() * 32; ++bit) {
      std::vector<uint32_t> changed = words;
      changed[bit / 32] ^= 1u << (bit % 32);
      if (find_occupancy_fault(stream.header(), changed)) continue;
      // What is still valid is another set of voxels of the same size: only full bits can change alone.
      EXPECT_TRUE(full);
      EXPECT_FALSE(decode_occupancy(OccupancyStream(stream.header(), changed)) == decode_occupancy(stream));
    }
  }
}

TEST(Occupancy, EveryChangedHeaderBitIsAFaultOrReadable) {
  OccupancyOptions options;
  options.dag = true;
  const OccupancyStream stream = encode_occupancy(ball({70, 40, 32}, 15.0, true), options);
  const std::vector<uint32_t> words(stream.words().begin(), stream.words().end());
  for (size_t bit = 0; bit < sizeof(voxels::OccupancyHeader) * 8; ++bit) {
    voxels::OccupancyHeader header = stream.header();
    reinterpret_cast<uint8_t*>(&header)[bit / 8] ^= static_cast<uint8_t>(1u << (bit % 8));
    if (find_occupancy_fault(header, words)) continue;
    const VoxelSet set = decode_occupancy(OccupancyStream(header, words)); // under sanitizers: reads nothing outside
    EXPECT_LE(set.count(), uint64_t{kMaxGridSize} * kMaxGridSize);
  }
}

TEST(Occupancy, OptionsOutOfRangeAreErrors) {
  VoxelSet set({4, 4, 4});
  EXPECT_THROW(encode_occupancy(set, {}), Error); // empty
  set.set({1, 2, 3});
  OccupancyOptions options;
  for (const uint32_t levels : {1u, 17u}) {
    options.levels = levels;
    EXPECT_THROW(encode_occupancy(set, options), Error);
  }
  options.levels = 0;
  const std::vector<uint8_t> swatches{3};
  options.swatches = swatches;
  EXPECT_THROW(encode_occupancy(set, options), Error); // without a palette
}

} // namespace
} // namespace packtrace
