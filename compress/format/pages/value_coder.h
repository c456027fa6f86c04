#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>

namespace packtrace {

inline uint64_t wrap(int64_t value) { return static_cast<uint64_t>(value); }

/// Codes numbers of any size with a page's coder, which PageModel describes. Functions take the value and return it;
/// decoders ignore the argument.
template <class Coder>
class ValueCoder {
public:
  explicit ValueCoder(Coder& coder) : coder_(coder) {}

  bool fault() const { return fault_; }

protected:
  static constexpr bool kDecodes = Coder::kDecodes;

  uint32_t flag(uint32_t context, bool value) { return coder_.symbol(context, value ? 1 : 0) & 1u; }

  /// Codes any 64-bit value; small values take few bits. A symbol holds the bit width, raw bits hold everything below
  /// the leading one.
  uint64_t magnitude(uint32_t context, uint64_t value) {
    return magnitude_with(value, context, [&](uint32_t width) { return coder_.symbol(context, width); });
  }

  int64_t difference(uint32_t context, int64_t value) { return unfold(magnitude(context, fold(value))); }

  /// Codes the symbol with the mean of two models.
  int64_t difference(uint32_t first, uint32_t second, int64_t value) {
    const auto code = [&](uint32_t width) { return coder_.symbol(first, second, width); };
    return unfold(magnitude_with(fold(value), first, code));
  }

  Coder& coder_;
  bool fault_ = false; ///< decoders: whether data was invalid

private:
  static constexpr uint32_t kExplicitWidth = 15; ///< magnitudes of this many bits and more store their width explicitly

  static uint64_t fold(int64_t value) {
    const auto shifted = static_cast<uint64_t>(value) << 1;
    return value < 0 ? ~shifted : shifted;
  }
  static int64_t unfold(uint64_t zigzag) { return static_cast<int64_t>((zigzag >> 1) ^ (0 - (zigzag & 1u))); }

  template <class Code>
  uint64_t magnitude_with(uint64_t value, uint32_t context, const Code& code) {
    const auto bits = static_cast<uint32_t>(std::bit_width(value));
    const uint32_t width = code(std::min(bits, kExplicitWidth));
    if (width == kExplicitWidth) return wide_magnitude(context, value, bits);
    // Without a branch on the width, which is unpredictable.
    const uint64_t first = (uint64_t{1} << width) >> 1;
    return first | coder_.raw(context, value - (kDecodes ? 0 : first), width - (width != 0 ? 1 : 0));
  }

  uint64_t wide_magnitude(uint32_t context, uint64_t value, uint32_t bits) {
    const auto width = kExplicitWidth + static_cast<uint32_t>(coder_.raw(context, bits - kExplicitWidth, 6));
    if (width > 64) {
      fault_ = true;
      return 0;
    }
    const uint32_t low = std::min(width - 1, 32u), high = width - 1 - low;
    const uint64_t top = coder_.raw(context, (value >> low) & ((uint64_t{1} << high) - 1), high);
    return ((uint64_t{1} << high | top) << low) | coder_.raw(context, value & ((uint64_t{1} << low) - 1), low);
  }
};

} // namespace packtrace
