#include "pbrt_import/text/number.h"

#include <charconv>
#include <limits>
#include <system_error>

#include "pbrt_import/base/cpu.h"
#include "pbrt_import/text/number_kernels.h"

namespace packtrace {
namespace {

/// Whether a decimal number that from_chars reports as out of range is too large rather than too small. The test uses
/// its decimal exponent: the position of the first nonzero digit plus the written exponent.
bool is_too_large(std::string_view digits) {
  int64_t before_point = 0, leading_zeros = 0;
  bool seen_point = false, seen_nonzero = false;
  size_t i = 0;
  for (; i < digits.size() && digits[i] != 'e' && digits[i] != 'E'; ++i) {
    if (digits[i] == '.') {
      seen_point = true;
      continue;
    }
    seen_nonzero = seen_nonzero || digits[i] != '0';
    if (!seen_nonzero && seen_point) ++leading_zeros;
    if (seen_nonzero && !seen_point) ++before_point;
  }
  int64_t exponent = 0;
  if (i < digits.size()) {
    size_t start = i + 1;
    if (start < digits.size() && digits[start] == '+') ++start;
    const auto [end, error] = std::from_chars(digits.data() + start, digits.data() + digits.size(), exponent);
    if (error == std::errc::result_out_of_range) return digits[start] != '-';
  }
  const int64_t first_digit = before_point > 0 ? before_point : -leading_zeros;
  // first_digit + exponent > 0 without overflow, since |first_digit| is at most the text length.
  return exponent > -first_digit;
}

template <class T>
size_t parse(std::string_view text, bool negative, T& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const auto used = static_cast<size_t>(end - text.data());
  if (error == std::errc::invalid_argument) return 0;
  if (error == std::errc::result_out_of_range)
    value = is_too_large(text.substr(0, used)) ? std::numeric_limits<T>::infinity() : T(0);
  if (negative) value = -value;
  return used;
}

} // namespace

template <class T>
NumberText<T> parse_number(std::string_view word) {
  NumberText<T> number;
  if (word.empty()) return number;
  const bool has_sign = word[0] == '-' || word[0] == '+';
  const std::string_view magnitude = word.substr(has_sign ? 1 : 0);
  if (magnitude.empty() || magnitude[0] == '-') return number; // from_chars would accept a second minus
  const size_t used = parse(magnitude, word[0] == '-', number.value);
  if (used > 0) number.used = used + (has_sign ? 1 : 0);
  return number;
}

template NumberText<float> parse_number(std::string_view word);
template NumberText<double> parse_number(std::string_view word);

const NumberKernels* number_kernels() {
#if defined(__x86_64__)
  static constexpr NumberKernels kAvx2{avx2::convert_integers, avx2::convert_floats, avx2::convert_doubles};
  if (cpu_has_avx2()) return &kAvx2;
#endif
  return nullptr;
}

} // namespace packtrace
