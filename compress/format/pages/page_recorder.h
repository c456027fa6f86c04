#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "compress/format/cluster/position_grid.h"
#include "compress/format/layout/bit_stream.h"
#include "compress/format/pages/page_contexts.h"

namespace packtrace {

/// Coder for PageModel (page_model.h) that records symbols and bit fields, for codec `small`.
class PageRecorder {
public:
  static constexpr bool kDecodes = false;
  static constexpr uint32_t kNoPoint = ~0u;

  static constexpr uint16_t kNoContext = 0xffff;
  struct Symbol {
    uint16_t context, second; ///< models whose mean is used; second: kNoContext if only the first is
    uint8_t value;
  };

  uint32_t symbol(uint32_t context, uint32_t value) {
    symbols_.push_back({static_cast<uint16_t>(context), kNoContext, static_cast<uint8_t>(value)});
    return value;
  }
  uint32_t symbol(uint32_t first, uint32_t second, uint32_t value) {
    symbols_.push_back({static_cast<uint16_t>(first), static_cast<uint16_t>(second), static_cast<uint8_t>(value)});
    return value;
  }
  uint64_t raw(uint32_t context, uint64_t value, uint32_t bits) {
    fields_.put(value, bits);
    field_bits_[static_cast<size_t>(page_stream_of(context))] += bits;
    return value;
  }
  uint32_t find_point(const LatticePoint& p) const {
    const auto found = points_.find(p);
    return found == points_.end() ? kNoPoint : found->second;
  }
  void add_point(const LatticePoint& p, uint32_t point) { points_.emplace(p, point); }

  const std::vector<Symbol>& symbols() const { return symbols_; }
  /// The recorded bit fields, padded to whole bytes. Nothing may be recorded afterwards.
  const std::vector<uint8_t>& fields() {
    fields_.align(1);
    return fields_.bytes();
  }
  /// Number of bits in fields per PageStream.
  const std::array<uint64_t, kPageStreams>& field_bits() const { return field_bits_; }

private:
  struct Hash {
    size_t operator()(const LatticePoint& p) const {
      uint64_t hash = 0;
      for (const int64_t c : p) {
        hash = (hash ^ static_cast<uint64_t>(c)) * 0x9e3779b97f4a7c15u;
        hash ^= hash >> 32;
      }
      return static_cast<size_t>(hash);
    }
  };
  std::vector<Symbol> symbols_;
  BitWriter fields_;
  std::array<uint64_t, kPageStreams> field_bits_{};
  std::unordered_map<LatticePoint, uint32_t, Hash> points_;
};

} // namespace packtrace
