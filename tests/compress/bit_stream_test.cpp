#include "compress/format/layout/bit_stream.h"

#include <gtest/gtest.h>

#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

TEST(BitStream, FieldsOfAllWidthsRoundTrip) {
  test::Random random(8);
  std::vector<std::pair<uint64_t, uint32_t>> fields;
  BitWriter writer;
  for (int i = 0; i < 5000; ++i) {
    const uint32_t bits = random.bits() % (kMaxFieldBits + 1);
    const uint64_t value = ((uint64_t{random.bits()} << 32) | random.bits()) & ((uint64_t{1} << bits) - 1);
    fields.emplace_back(value, bits);
    writer.put(value, bits);
  }
  const uint64_t total = writer.bit_count();
  writer.align(8);
  EXPECT_EQ(writer.bytes().size() % 8, 0u);
  std::vector<uint8_t> bytes = writer.bytes();
  bytes.resize(bytes.size() + kReadSlackBytes);
  uint64_t at = 0;
  for (const auto& [value, bits] : fields) {
    ASSERT_EQ(read_bits(bytes.data(), at, bits), value);
    ASSERT_EQ(read_bits64(bytes.data(), at, bits), value);
    at += bits;
  }
  EXPECT_EQ(at, total);
}

TEST(BitStream, LeastSignificantBitComesFirst) {
  BitWriter writer;
  writer.put(1, 1);
  writer.put(0x1ff, 9);
  writer.put(0, 3);
  writer.align(1);
  EXPECT_EQ(writer.bytes(), (std::vector<uint8_t>{0xff, 0x03}));
}

TEST(BitStream, BitsForCountIsZeroForOneValue) {
  EXPECT_EQ(bits_for_count(0), 0u);
  EXPECT_EQ(bits_for_count(1), 0u);
  EXPECT_EQ(bits_for_count(2), 1u);
  EXPECT_EQ(bits_for_count(256), 8u);
  EXPECT_EQ(bits_for_count(257), 9u);
}

} // namespace
} // namespace packtrace
