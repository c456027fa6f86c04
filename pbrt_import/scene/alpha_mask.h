#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "pbrt_import/scene/math.h"

namespace packtrace {

enum class WrapMode : uint32_t { kRepeat = 0, kBlack = 1, kClamp = 2 };

/// Mask of the texels where an alpha texture is not exactly 0: one bit per texel, set = opaque. Row 0 is the top row of
/// the image, to which pbrt's corner (u, v) = (0, 1) maps; rows start at word boundaries.
struct AlphaMask {
  uint32_t width = 0;  ///< texels
  uint32_t height = 0; ///< texels
  WrapMode wrap = WrapMode::kRepeat;
  Vec2 uv_scale{1.0f}; ///< st = uv * uv_scale + uv_offset
  Vec2 uv_offset{0.0f};
  std::vector<uint32_t> words; ///< height x row_words(width) words; bit x % 32 of word x / 32 of a row is texel x

  static constexpr uint32_t row_words(uint32_t width_texels) { return width_texels / 32 + (width_texels % 32 != 0); }
};

/// View of a mask whose bits belong to an AlphaMask or to a baked file.
struct AlphaMaskView {
  uint32_t width = 0;
  uint32_t height = 0;
  WrapMode wrap = WrapMode::kRepeat;
  Vec2 uv_scale{1.0f};
  Vec2 uv_offset{0.0f};
  std::span<const uint32_t> words;

  /// False if pbrt's bilinear lookup at uv returns exactly 0, that is, if all texels of the footprint with nonzero
  /// weight are 0. Non-finite uv count as opaque.
  bool opaque(Vec2 uv) const;
};

AlphaMaskView view(const AlphaMask& mask);

} // namespace packtrace
