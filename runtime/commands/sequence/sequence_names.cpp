#include "runtime/commands/sequence/sequence_names.h"

#include <charconv>
#include <string_view>

#include <fmt/format.h>

#include "pbrt_import/base/error.h"

namespace packtrace {

NumberedName::NumberedName(const std::string& pattern) : pattern_(pattern) {
  constexpr size_t kMaxDigits = 9;
  bool found = false;
  const auto fail = [&](const char* what) {
    throw Error(
        ErrorKind::kUsage,
        fmt::format("{}: {}; write the frame's number as %d or %04d, for example frame_%04d.png", pattern, what));
  };
  for (size_t i = 0; i < pattern.size(); ++i) {
    std::string& part = found ? after_ : before_;
    if (pattern[i] != '%') {
      part += pattern[i];
      continue;
    }
    const std::string_view rest = std::string_view(pattern).substr(i + 1);
    if (rest.starts_with('%')) {
      part += '%', ++i;
      continue;
    }
    const size_t end = rest.find_first_not_of("0123456789");
    const bool digits = rest.size() >= 2 && rest[0] == '0' && end == 2 && rest[1] != '0';
    if (end == std::string_view::npos || rest[end] != 'd' || (end != 0 && !digits))
      fail("the conversion after % is not d");
    if (found) fail("the name has two places for a number");
    found = true;
    if (digits) digits_ = static_cast<uint32_t>(rest[1] - '0');
    static_assert(kMaxDigits == 9, "a single digit says how many there are");
    i += end + 1;
  }
  if (!found) fail("a sequence needs the number of the frame in the name");
}

std::string NumberedName::at(uint64_t number) const {
  std::string name = before_;
  name.append(fmt::format("{:0{}}", number, digits_)).append(after_);
  return name;
}

std::optional<uint64_t> NumberedName::number_of(const std::string& name) const {
  if (name.size() <= before_.size() + after_.size() || !name.starts_with(before_) || !name.ends_with(after_)) return {};
  uint64_t number = 0;
  const char* const end = name.data() + name.size() - after_.size();
  const auto [stop, error] = std::from_chars(name.data() + before_.size(), end, number);
  if (error != std::errc() || stop != end || at(number) != name) return {};
  return number;
}

std::optional<uint64_t> NumberedName::largest() const {
  if (digits_ == 0) return std::nullopt;
  uint64_t power = 1;
  for (uint32_t i = 0; i < digits_; ++i) power *= 10;
  return power - 1;
}

} // namespace packtrace
