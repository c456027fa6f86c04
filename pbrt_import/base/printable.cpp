#include "pbrt_import/base/printable.h"

#include <algorithm>
#include <cstdint>
#include <iterator>

namespace packtrace {
namespace {

uint32_t byte_at(std::string_view text, size_t i) { return static_cast<unsigned char>(text[i]); }

/// Code point of the character of `length` bytes at the start of text, where length is its utf8_length().
uint32_t code_point(std::string_view text, size_t length) {
  constexpr uint32_t kLeadBits[] = {0, 0x7f, 0x1f, 0x0f, 0x07};
  uint32_t code = byte_at(text, 0) & kLeadBits[length];
  for (size_t i = 1; i < length; ++i) code = code << 6 | (byte_at(text, i) & 0x3f);
  return code;
}

struct Range {
  uint32_t first, last;
};
/// Code points of Unicode's categories Cc, Cf, Zl and Zp, and other invisible ones that could make text misleading.
/// Sorted.
constexpr Range kHidden[] = {
    {0x0000, 0x001f},   {0x007f, 0x009f},   {0x00ad, 0x00ad},   {0x034f, 0x034f},   {0x0600, 0x0605},
    {0x061c, 0x061c},   {0x06dd, 0x06dd},   {0x070f, 0x070f},   {0x0890, 0x0891},   {0x08e2, 0x08e2},
    {0x115f, 0x1160},   {0x17b4, 0x17b5},   {0x180b, 0x180f},   {0x200b, 0x200f},   {0x2028, 0x202e},
    {0x2060, 0x206f},   {0x3164, 0x3164},   {0xfe00, 0xfe0f},   {0xfeff, 0xfeff},   {0xffa0, 0xffa0},
    {0xfff0, 0xfffb},   {0x110bd, 0x110bd}, {0x110cd, 0x110cd}, {0x13430, 0x1343f}, {0x1bca0, 0x1bca3},
    {0x1d173, 0x1d17a}, {0xe0000, 0xe0fff},
};

bool is_hidden(uint32_t code) {
  const Range* const range =
      std::upper_bound(std::begin(kHidden), std::end(kHidden), code, [](uint32_t c, Range r) { return c <= r.last; });
  return range != std::end(kHidden) && code >= range->first;
}

void append_hexadecimal(std::string& to, uint32_t byte) {
  constexpr char kHex[] = "0123456789abcdef";
  to += {'\\', 'x', kHex[byte >> 4], kHex[byte & 15]};
}

} // namespace

size_t utf8_length(std::string_view text) {
  if (text.empty()) return 0;
  const uint32_t lead = byte_at(text, 0);
  const size_t length = lead < 0x80 ? 1 : lead < 0xc2 ? 0 : lead < 0xe0 ? 2 : lead < 0xf0 ? 3 : lead < 0xf5 ? 4 : 0;
  if (length > text.size()) return 0;
  for (size_t i = 1; i < length; ++i)
    if ((byte_at(text, i) & 0xc0) != 0x80) return 0;
  if (length < 3) return length;
  const uint32_t code = code_point(text, length);
  const bool overlong = code < (length == 3 ? 0x800u : 0x10000u), surrogate = code >= 0xd800 && code < 0xe000;
  return overlong || surrogate || code > 0x10ffff ? 0 : length;
}

size_t printable_length(std::string_view text) {
  const size_t length = utf8_length(text);
  return length > 0 && !is_hidden(code_point(text, length)) ? length : 0;
}

std::string printable(std::string_view text, std::string_view layout) {
  std::string shown;
  shown.reserve(text.size());
  for (size_t i = 0; i < text.size();) {
    const bool stays = layout.find(text[i]) != layout.npos;
    const size_t length = stays ? 1 : printable_length(text.substr(i));
    if (length > 0)
      shown += text.substr(i, length);
    else
      append_hexadecimal(shown, byte_at(text, i));
    i += std::max<size_t>(length, 1);
  }
  return shown;
}

std::string to_utf8(std::string_view text) {
  std::string valid;
  valid.reserve(text.size());
  for (size_t i = 0; i < text.size();) {
    const size_t length = utf8_length(text.substr(i));
    if (length > 0)
      valid += text.substr(i, length);
    else
      valid += {static_cast<char>(0xc0 | byte_at(text, i) >> 6), static_cast<char>(0x80 | (byte_at(text, i) & 0x3f))};
    i += std::max<size_t>(length, 1);
  }
  return valid;
}

} // namespace packtrace
