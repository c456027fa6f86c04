#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace packtrace {

/// a == b, inline, since a call of memcmp takes longer than comparing a keyword.
inline bool equal_text(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  const auto differ = [&](size_t at, auto word) {
    auto other = word;
    std::memcpy(&word, a.data() + at, sizeof word);
    std::memcpy(&other, b.data() + at, sizeof other);
    return word != other;
  };
  const size_t size = a.size();
  if (size >= sizeof(uint64_t)) {
    for (size_t at = 0; at + sizeof(uint64_t) < size; at += sizeof(uint64_t))
      if (differ(at, uint64_t{0})) return false;
    return !differ(size - sizeof(uint64_t), uint64_t{0});
  }
  if (size >= sizeof(uint32_t)) return !differ(0, uint32_t{0}) && !differ(size - sizeof(uint32_t), uint32_t{0});
  for (size_t at = 0; at < size; ++at)
    if (a[at] != b[at]) return false;
  return true;
}

} // namespace packtrace
