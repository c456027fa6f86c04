#include "pbrt_import/language/name_table.h"

#include <string>

#include <gtest/gtest.h>

namespace packtrace {
namespace {

TEST(NameTable, NumbersFollowFirstUse) {
  NameTable names;
  EXPECT_FALSE(names.find("a"));
  EXPECT_EQ(names.intern("a"), 0u);
  EXPECT_EQ(names.intern(""), 1u);
  EXPECT_EQ(names.intern("a"), 0u);
  EXPECT_EQ(names.find(""), 1u);
  EXPECT_FALSE(names.find("b"));
  EXPECT_EQ(names.size(), 2u);
}

TEST(NameTable, ManyNamesOfAllLengthsStay) {
  NameTable names;
  const auto name = [](uint32_t i) { return std::string(i % 300, 'x') + std::to_string(i); };
  for (uint32_t i = 0; i < 50'000; ++i) ASSERT_EQ(names.intern(name(i)), i);
  for (uint32_t i = 0; i < 50'000; ++i) {
    ASSERT_EQ(names.find(name(i)), i);
    ASSERT_EQ(names.name(i), name(i));
  }
  EXPECT_EQ(names.intern(std::string(1 << 20, 'y')), 50'000u);
  EXPECT_EQ(names.name(50'000).size(), size_t{1} << 20);
}

} // namespace
} // namespace packtrace
