#include "pbrt_import/base/printable.h"

#include <string>

#include <gtest/gtest.h>

namespace packtrace {
namespace {

using namespace std::string_literals;

TEST(Printable, TextStaysAsItIs) {
  for (const char* const text :
       {"", "plain", "two\nlines\tand a tab", "gr\xc3\xbcn", "\xe6\x9c\xa8", "\xf0\x9f\x8c\xb2", "\\x1b"})
    EXPECT_EQ(printable(text), text);
}

TEST(Printable, ControlCharactersAreShownInHexadecimal) {
  EXPECT_EQ(printable("a\x1b[31mb\r\0c\x7f"s), "a\\x1b[31mb\\x0d\\x00c\\x7f");
  EXPECT_EQ(printable("\xc2\x9b"), "\\xc2\\x9b"); // C1: CSI in one character
  EXPECT_EQ(printable("a\nb\t", ""), "a\\x0ab\\x09");
}

TEST(Printable, WhatTurnsOrHidesTextIsShownInHexadecimal) {
  for (const char* const hidden :
       {"\u202e", "\u202a", "\u2066", "\u2069", "\u200e", "\u200f", "\u061c", "\u200b", "\u200d", "\u2028", "\u2060",
        "\u00ad", "\u180e", "\ufeff", "\ufffb", "\U000e0041", "\U000e0001"}) {
    const std::string shown = printable("a" + std::string(hidden) + "b");
    EXPECT_EQ(shown.size(), 2 + 4 * std::string(hidden).size()) << shown;
    EXPECT_TRUE(shown.starts_with("a\\x")) << shown;
  }
  for (const char* const shown :
       {"\u00e9", "\u2027", "\u202f", "\u20ac", "\u2070", "\u05d0", "\ufefe", "\uffe5", "\U0001f332"})
    EXPECT_EQ(printable(shown), shown);
}

TEST(Printable, BytesThatAreNoUtf8AreShownInHexadecimal) {
  EXPECT_EQ(printable("caf\xe9"), "caf\\xe9");
  EXPECT_EQ(printable("\xc0\xaf"), "\\xc0\\xaf");                   // overlong
  EXPECT_EQ(printable("\xe0\x80\xae"), "\\xe0\\x80\\xae");          // overlong
  EXPECT_EQ(printable("\xed\xa0\x80"), "\\xed\\xa0\\x80");          // a surrogate
  EXPECT_EQ(printable("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80"); // beyond Unicode
  EXPECT_EQ(printable("\xe6\x9c"), "\\xe6\\x9c");
}

TEST(Utf8, BytesThatAreNoneAreReadAsLatin1) {
  EXPECT_EQ(to_utf8("gr\xfcn"), "gr\u00fcn");
  EXPECT_EQ(to_utf8("gr\u00fcn \U0001f332"), "gr\u00fcn \U0001f332");
  EXPECT_EQ(to_utf8("\xe6\x9c"), "\u00e6\u009c");
  EXPECT_EQ(to_utf8("\xff\xc3"), "\u00ff\u00c3");
}

} // namespace
} // namespace packtrace
