#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace packtrace {

inline constexpr uint64_t kMaxPictures = 10'000'000; ///< of a sequence

/// A file name with one place for a number, written as in printf: %d, or %0Nd for N digits with leading zeros. %% is a
/// percent sign.
class NumberedName {
public:
  /// Throws Error(kUsage) for a name without a place, with several, or with another conversion.
  explicit NumberedName(const std::string& pattern);

  std::string at(uint64_t number) const;

  /// The number for which at() returns this name; none if there is no such number.
  std::optional<uint64_t> number_of(const std::string& name) const;

  /// Largest number that does not need more digits than the others; unset for %d.
  std::optional<uint64_t> largest() const;
  const std::string& pattern() const { return pattern_; }

private:
  std::string pattern_, before_, after_;
  uint32_t digits_ = 0; ///< minimum number of digits; 0: %d
};

} // namespace packtrace
