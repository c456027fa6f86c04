#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <utility>

#if defined(__SSE2__)
#include <bit>
#include <emmintrin.h>
#endif

namespace packtrace {

/// The frequencies of the 16 symbols add up to 2^kProbabilityBits.
inline constexpr uint32_t kProbabilityBits = 15;
inline constexpr uint32_t kNibbleSymbols = 16;

/// A distribution over 16 symbols. No frequency is 0.
class NibbleTable {
public:
  NibbleTable() {
    for (uint32_t i = 0; i <= kNibbleSymbols; ++i) below_[i] = static_cast<uint16_t>(i << (kProbabilityBits - 4));
  }

  /// The mean of two distributions; cumulative frequencies are rounded up.
  NibbleTable(const NibbleTable& a, const NibbleTable& b) {
#if defined(__SSE2__)
    for (uint32_t i = 0; i < kNibbleSymbols; i += 8) store(i, _mm_avg_epu16(a.load(i), b.load(i)));
#else
    for (uint32_t i = 0; i < kNibbleSymbols; ++i)
      below_[i] = static_cast<uint16_t>((uint32_t{a.below_[i]} + b.below_[i] + 1) / 2);
#endif
    below_[kNibbleSymbols] = uint16_t{1} << kProbabilityBits;
  }

  uint32_t below(uint32_t symbol) const { return below_[symbol]; }
  uint32_t frequency(uint32_t symbol) const { return uint32_t{below_[symbol + 1]} - below_[symbol]; }

  /// Returns the symbol with below(symbol) <= slot < below(symbol + 1).
  /// @param slot < 2^kProbabilityBits
  uint32_t find(uint32_t slot) const {
#if defined(__SSE2__)
    const __m128i wanted = _mm_set1_epi16(static_cast<int16_t>(slot));
    const __m128i low = _mm_cmpgt_epi16(load(0), wanted), high = _mm_cmpgt_epi16(load(8), wanted);
    const auto above = static_cast<uint32_t>(_mm_movemask_epi8(_mm_packs_epi16(low, high)));
    return static_cast<uint32_t>(std::countr_zero(above | 0x10000u)) - 1;
#else
    uint32_t symbol = 0;
    for (uint32_t i = 1; i < kNibbleSymbols; ++i) symbol += below_[i] <= slot;
    return symbol;
#endif
  }

protected:
#if defined(__SSE2__)
  __m128i load(uint32_t i) const { return _mm_loadu_si128(reinterpret_cast<const __m128i*>(below_.data() + i)); }
  void store(uint32_t i, __m128i values) { _mm_storeu_si128(reinterpret_cast<__m128i*>(below_.data() + i), values); }
#endif

  std::array<uint16_t, kNibbleSymbols + 1> below_;
};

/// An adaptive distribution over 16 symbols. The cumulative frequencies move towards each coded symbol, at a rate that
/// decreases with the number of symbols. No frequency ever reaches zero. Encoder and decoder keep equal copies.
/// Source: Giesen, "Mixing discrete probability distributions", fgiesen.wordpress.com (2015).
class NibbleModel : public NibbleTable {
public:
  void update(uint32_t symbol) {
    const int rate = kRates[count_];
    count_ = static_cast<uint16_t>(std::min<size_t>(count_ + size_t{1}, kRates.size() - 1));
    const int16_t* target = kTargets[symbol].data();
#if defined(__SSE2__)
    const __m128i shift = _mm_cvtsi32_si128(rate);
    for (uint32_t i = 0; i < kNibbleSymbols; i += 8) {
      const __m128i old = load(i), aim = _mm_loadu_si128(reinterpret_cast<const __m128i*>(target + i));
      store(i, _mm_add_epi16(old, _mm_sra_epi16(_mm_sub_epi16(aim, old), shift)));
    }
#else
    for (uint32_t i = 0; i < kNibbleSymbols; ++i)
      below_[i] = static_cast<uint16_t>(below_[i] + ((target[i] - below_[i]) >> rate));
#endif
  }

private:
  using Targets = std::array<std::array<int16_t, kNibbleSymbols>, kNibbleSymbols>;
  /// Target cumulative frequencies per symbol: every other symbol has frequency 1. Consecutive values differ by at
  /// least 1, so that moving a fraction of the way keeps every frequency positive.
  static constexpr Targets kTargets = [] {
    Targets targets{};
    for (uint32_t symbol = 0; symbol < kNibbleSymbols; ++symbol)
      for (uint32_t i = 0; i < kNibbleSymbols; ++i)
        targets[symbol][i] = static_cast<int16_t>(i <= symbol ? i : (1u << kProbabilityBits) - kNibbleSymbols + i);
    return targets;
  }();
  /// Right shift that scales the step, by number of symbols coded before.
  static constexpr std::array<uint8_t, 96> kRates = [] {
    std::array<uint8_t, 96> rates{};
    for (size_t i = 0; i < rates.size(); ++i)
      rates[i] = static_cast<uint8_t>(i < 2 ? 2 : i < 6 ? 3 : i < 20 ? 4 : i < 60 ? 5 : 6);
    rates.back() = 7;
    return rates;
  }();

  uint16_t count_ = 0;
};

/// Reads the output of RansWriter: symbols coded by two interleaved states of a range-variant asymmetric numeral
/// system, renormalised in 16-bit words. Never reads outside its bytes: missing words read as zero, and whole() reports
/// them.
/// Source: Duda, "Asymmetric numeral systems" (2013); Giesen, "Interleaved entropy coders" (2014).
class RansReader {
public:
  RansReader() = default;
  explicit RansReader(std::span<const uint8_t> bytes) : at_(bytes.data()), end_(bytes.data() + bytes.size()) {
    for (uint32_t& state : state_) {
      const uint32_t low = next_word();
      state = low | (next_word() << 16);
    }
  }

  uint32_t symbol(NibbleModel& model) {
    const uint32_t symbol = read(model);
    model.update(symbol);
    return symbol;
  }

  /// Uses the mean of two models.
  uint32_t symbol(NibbleModel& first, NibbleModel& second) {
    const uint32_t symbol = read(NibbleTable(first, second));
    first.update(symbol), second.update(symbol);
    return symbol;
  }

  /// Whether all bytes were read, none were missing, and the states are the writer's initial ones.
  bool whole() const { return at_ == end_ && !missing_ && state_[0] == kLowest && state_[1] == kLowest; }

  static constexpr uint32_t kLowest = 1u << 16; ///< states are in [kLowest, 2^32)

private:
  uint32_t read(const NibbleTable& table) {
    const uint32_t state = state_[0], slot = state & ((1u << kProbabilityBits) - 1);
    const uint32_t symbol = table.find(slot);
    uint32_t next = table.frequency(symbol) * (state >> kProbabilityBits) + slot - table.below(symbol);
    if (next < kLowest) next = (next << 16) | next_word();
    state_ = {state_[1], next};
    return symbol;
  }

  uint32_t next_word() {
    if (end_ - at_ < 2) {
      missing_ = true;
      return 0;
    }
    uint16_t word = 0;
    std::memcpy(&word, at_, sizeof word);
    at_ += 2;
    return word;
  }

  const uint8_t* at_ = nullptr;
  const uint8_t* end_ = nullptr;
  std::array<uint32_t, 2> state_{};
  bool missing_ = false;
};

} // namespace packtrace
