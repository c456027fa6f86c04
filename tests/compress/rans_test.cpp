#include "compress/format/pages/rans.h"

#include <gtest/gtest.h>

#include "compress/format/pages/rans_writer.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

std::vector<uint8_t> write(const std::vector<uint32_t>& symbols) {
  std::array<NibbleModel, 2> models;
  RansWriter writer(symbols.size());
  for (size_t i = 0; i < symbols.size(); ++i) (void)writer.put(models[i % 2], symbols[i]);
  return writer.finish();
}

/// Skewed like real symbols: mostly small, with runs of equal symbols.
std::vector<uint32_t> skewed_symbols(size_t count) {
  test::Random random(4);
  std::vector<uint32_t> symbols;
  while (symbols.size() < count) {
    const auto symbol = static_cast<uint32_t>(std::countr_zero(random.bits() | 0x8000u));
    symbols.insert(symbols.end(), 1 + (random.bits() % 8 == 0 ? random.bits() % 500 : 0), symbol);
  }
  symbols.resize(count);
  return symbols;
}

TEST(Rans, SymbolsComeBack) {
  for (const size_t count : {size_t{0}, size_t{1}, size_t{2}, size_t{3}, size_t{100001}}) {
    const std::vector<uint32_t> symbols = skewed_symbols(count);
    const std::vector<uint8_t> bytes = write(symbols);
    std::array<NibbleModel, 2> models;
    RansReader reader(bytes);
    for (size_t i = 0; i < symbols.size(); ++i) ASSERT_EQ(reader.symbol(models[i % 2]), symbols[i]) << i;
    EXPECT_TRUE(reader.whole());
  }
}

TEST(Rans, SymbolsOfTheMeanOfTwoModelsComeBack) {
  const std::vector<uint32_t> symbols = skewed_symbols(20000);
  std::array<NibbleModel, 3> models;
  RansWriter writer(symbols.size());
  for (size_t i = 0; i < symbols.size(); ++i) (void)writer.put(models[i % 2], models[2], symbols[i]);
  const std::vector<uint8_t> bytes = writer.finish();
  std::array<NibbleModel, 3> copies;
  RansReader reader(bytes);
  for (size_t i = 0; i < symbols.size(); ++i) ASSERT_EQ(reader.symbol(copies[i % 2], copies[2]), symbols[i]) << i;
  EXPECT_TRUE(reader.whole());
}

TEST(NibbleTable, MeansOfModelsKeepEverySymbolPossible) {
  NibbleModel low, high;
  for (int i = 0; i < 3000; ++i) {
    low.update(0), high.update(15);
    const NibbleTable mean(low, high);
    EXPECT_EQ(mean.below(0), 0u);
    EXPECT_EQ(mean.below(kNibbleSymbols), 1u << kProbabilityBits);
    for (uint32_t symbol = 0; symbol < kNibbleSymbols; ++symbol) {
      ASSERT_GE(mean.frequency(symbol), 1u);
      ASSERT_EQ(mean.find(mean.below(symbol)), symbol);
      ASSERT_EQ(mean.find(mean.below(symbol + 1) - 1), symbol);
    }
  }
}

TEST(Rans, TruncatedAndLongerInputIsNotWhole) {
  const std::vector<uint32_t> symbols = skewed_symbols(300);
  std::vector<uint8_t> bytes = write(symbols);
  const auto whole = [&](std::span<const uint8_t> input) {
    std::array<NibbleModel, 2> models;
    RansReader reader(input);
    for (size_t i = 0; i < symbols.size(); ++i) EXPECT_LT(reader.symbol(models[i % 2]), kNibbleSymbols);
    return reader.whole();
  };
  for (size_t size = 0; size < bytes.size(); ++size) EXPECT_FALSE(whole(std::span(bytes).first(size))) << size;
  bytes.resize(bytes.size() + 2);
  EXPECT_FALSE(whole(bytes));
}

TEST(NibbleModel, NoSymbolEverBecomesImpossible) {
  NibbleModel model;
  test::Random random(9);
  for (int round = 0; round < 2000; ++round) {
    const uint32_t symbol = random.bits() % kNibbleSymbols;
    for (uint32_t i = 0; i < 1 + random.bits() % 200; ++i) model.update(symbol);
    uint32_t total = 0;
    for (uint32_t s = 0; s < kNibbleSymbols; ++s) {
      ASSERT_GE(model.frequency(s), 1u);
      ASSERT_EQ(model.below(s), total);
      ASSERT_EQ(model.find(total), s);
      total += model.frequency(s);
      ASSERT_EQ(model.find(total - 1), s);
    }
    ASSERT_EQ(total, 1u << kProbabilityBits);
  }
}

TEST(NibbleModel, CostsComeCloseToTheEntropy) {
  NibbleModel model;
  RansWriter writer(100000);
  test::Random random(3);
  double bits = 0.0;
  for (int i = 0; i < 100000; ++i) bits += writer.put(model, random.bits() % 4); // entropy of 2 bits
  EXPECT_LT(bits / 100000, 2.03);
  const double written = static_cast<double>(writer.finish().size()) * 8.0;
  EXPECT_GT(written, bits);
  EXPECT_LT(written, bits * 1.001 + 64.0); // the two final states take 64 bits
}

TEST(Rans, BytesStayTheSame) {
  // A change of the models or of the coder changes the format.
  std::vector<uint32_t> symbols;
  for (uint32_t i = 0; i < 40; ++i) symbols.push_back(i * i % 16);
  const std::vector<uint8_t> bytes = write(symbols);
  uint64_t hash = 1469598103934665603u; // FNV-1a
  for (const uint8_t byte : bytes) hash = (hash ^ byte) * 1099511628211u;
  EXPECT_EQ(bytes.size(), 16u);
  EXPECT_EQ(hash, 17516211417506455581u);
}

} // namespace
} // namespace packtrace
