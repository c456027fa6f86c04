#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

#include "compress/format/pages/rans.h"

namespace packtrace {

/// Encodes all symbols of a page into the words that RansReader reads.
class RansWriter {
public:
  explicit RansWriter(size_t symbols) { steps_.reserve(symbols); }

  /// Returns the symbol's cost in bits.
  double put(NibbleModel& model, uint32_t symbol) {
    const double bits = add(model, symbol);
    model.update(symbol);
    return bits;
  }

  /// Uses the mean of two models.
  double put(NibbleModel& first, NibbleModel& second, uint32_t symbol) {
    const double bits = add(NibbleTable(first, second), symbol);
    first.update(symbol), second.update(symbol);
    return bits;
  }

  std::vector<uint8_t> finish() const {
    // The reader decodes symbol i with state i % 2. Encoding runs backwards and ends in the reader's initial states.
    std::array<uint32_t, 2> state{RansReader::kLowest, RansReader::kLowest};
    std::vector<uint16_t> words; // in reverse order
    for (size_t i = steps_.size(); i-- > 0;) {
      const auto [below, frequency] = steps_[i];
      uint32_t& x = state[i % 2];
      if (x >= uint64_t{frequency} << (32 - kProbabilityBits)) {
        words.push_back(static_cast<uint16_t>(x));
        x >>= 16;
      }
      x = ((x / frequency) << kProbabilityBits) + x % frequency + below;
    }
    for (const uint32_t x : {state[1], state[0]}) {
      words.push_back(static_cast<uint16_t>(x >> 16));
      words.push_back(static_cast<uint16_t>(x));
    }
    std::reverse(words.begin(), words.end());
    std::vector<uint8_t> bytes(2 * words.size());
    std::memcpy(bytes.data(), words.data(), bytes.size());
    return bytes;
  }

private:
  double add(const NibbleTable& table, uint32_t symbol) {
    const uint32_t frequency = table.frequency(symbol);
    steps_.push_back({static_cast<uint16_t>(table.below(symbol)), static_cast<uint16_t>(frequency)});
    return kProbabilityBits - std::log2(frequency);
  }

  struct Step {
    uint16_t below, frequency;
  };
  std::vector<Step> steps_;
};

} // namespace packtrace
