#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "compress/format/cluster/position_grid.h"
#include "compress/format/layout/bit_stream.h"
#include "compress/format/pages/page_contexts.h"
#include "compress/format/pages/rans.h"

namespace packtrace {

/// Reads bit fields in order and never outside their bytes. Missing fields read as zero; whole() reports them.
class FieldReader {
public:
  FieldReader() = default;
  /// @param bytes followed by 8 readable bytes
  explicit FieldReader(std::span<const uint8_t> bytes) : bytes_(bytes.data()), end_(8 * uint64_t{bytes.size()}) {}

  uint64_t take(uint32_t bits) {
    if (bits > end_ - at_) {
      missing_ = true;
      return 0;
    }
    at_ += bits;
    return read_bits(bytes_, at_ - bits, bits);
  }
  /// Whether no field was missing and less than a byte is left.
  bool whole() const { return !missing_ && end_ - at_ < 8; }

private:
  const uint8_t* bytes_ = nullptr;
  uint64_t end_ = 0, at_ = 0;
  bool missing_ = false;
};

/// The Coder (page_model.h) that decodes pages with codec `small`.
class SmallPageReader {
public:
  static constexpr bool kDecodes = true;

  /// @param fields bit fields, followed by 8 readable bytes
  /// @param words output of a RansWriter
  void begin(std::span<const uint8_t> fields, std::span<const uint8_t> words) {
    models_.fill(NibbleModel());
    fields_ = FieldReader(fields);
    symbols_ = RansReader(words);
  }

  uint32_t symbol(uint32_t context, uint32_t) { return symbols_.symbol(models_[context]); }
  uint32_t symbol(uint32_t first, uint32_t second, uint32_t) {
    return symbols_.symbol(models_[first], models_[second]);
  }
  uint64_t raw(uint32_t, uint64_t, uint32_t bits) { return fields_.take(bits); }
  bool whole() const { return symbols_.whole() && fields_.whole(); }

private:
  std::array<NibbleModel, context::kCount> models_;
  FieldReader fields_;
  RansReader symbols_;
};

} // namespace packtrace
