#include "pbrt_import/scene/material_flags.h"

#include <bit>
#include <fstream>
#include <map>
#include <regex>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

namespace packtrace {
namespace {

std::string text_of(const std::string& file) {
  std::ifstream in(std::string(PACKTRACE_SOURCE_DIR) + "/" + file);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

/// Maps bit numbers to names for all matches of a pattern.
/// @param bit,name groups of the pattern
std::map<int, std::string> bits_in(const std::string& text, const std::regex& pattern, size_t bit, size_t name) {
  std::map<int, std::string> bits;
  for (std::sregex_iterator match(text.begin(), text.end(), pattern), end; match != end; ++match)
    EXPECT_TRUE(bits.emplace(std::stoi((*match)[bit]), (*match)[name]).second) << "bit twice: " << match->str();
  return bits;
}

TEST(MaterialFlags, EveryBitIsInTheDocumentUnderItsName) {
  const std::map<int, std::string> declared = bits_in(text_of("pbrt_import/scene/material_flags.h"),
                                                      std::regex(R"(MaterialFlags (k\w+) = 1u << (\d+);)"), 2, 1);
  const std::map<int, std::string> documented =
      bits_in(text_of("docs/baked_format.md"), std::regex(R"(\n\| (\d+) \| `(k\w+)` \|)"), 1, 2);
  EXPECT_EQ(documented, declared);
  MaterialFlags all = 0;
  for (const auto& [bit, name] : declared) all |= 1u << bit;
  EXPECT_EQ(all, kAllMaterialFlags);
}

TEST(MaterialFlags, BitsWithoutANameAreDocumentedAsOneRange) {
  const int first = std::countr_one(kAllMaterialFlags);
  EXPECT_NE(text_of("docs/baked_format.md").find("\n| " + std::to_string(first) + " to 31 | |"), std::string::npos);
}

} // namespace
} // namespace packtrace
