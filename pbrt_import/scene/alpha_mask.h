#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "pbrt_import/scene/math.h"

namespace packtrace {

enum class WrapMode : uint32_t { kRepeat = 0, kBlack = 1, kClamp = 2 };

/// Where an alpha texture is exactly zero: 1 bit per texel, set = opaque. Row 0 is the image's top row, which pbrt's
/// (u,v) = (0,1) corner maps to; rows start at word boundaries.
struct AlphaMask {
  uint32_t width = 0;  ///< texels
  uint32_t height = 0; ///< texels
  WrapMode wrap = WrapMode::kRepeat;
  Vec2 uv_scale{1.0f}; ///< st = uv * uv_scale + uv_offset
  Vec2 uv_offset{0.0f};
  std::vector<uint32_t> words; ///< height x row_words(width), bit x%32 of word x/32 is texel x

  static constexpr uint32_t row_words(uint32_t width_texels) { return width_texels / 32 + (width_texels % 32 != 0); }
};

/// A mask that does not own its bits; what both AlphaMask and the baked file can be looked at through.
struct AlphaMaskView {
  uint32_t width = 0;
  uint32_t height = 0;
  WrapMode wrap = WrapMode::kRepeat;
  Vec2 uv_scale{1.0f};
  Vec2 uv_offset{0.0f};
  std::span<const uint32_t> words;

  /// False where pbrt's bilinear lookup at uv would return exactly 0: all four texels of the footprint are 0.
  /// Non-finite uv count as opaque.
  bool opaque(Vec2 uv) const;
};

AlphaMaskView view(const AlphaMask& mask);

} // namespace packtrace
