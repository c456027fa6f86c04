#include "pbrt_import/scene/alpha_mask.h"

#include <algorithm>
#include <cmath>

namespace packtrace {
namespace {

bool texel_opaque(const AlphaMaskView& mask, int64_t x, int64_t y) {
  const int64_t w = mask.width, h = mask.height;
  switch (mask.wrap) {
  case WrapMode::kRepeat:
    x = ((x % w) + w) % w;
    y = ((y % h) + h) % h;
    break;
  case WrapMode::kClamp:
    x = std::clamp<int64_t>(x, 0, w - 1);
    y = std::clamp<int64_t>(y, 0, h - 1);
    break;
  case WrapMode::kBlack:
    if (x < 0 || y < 0 || x >= w || y >= h) return false;
    break;
  }
  const auto word = static_cast<size_t>(y) * AlphaMask::row_words(mask.width) + static_cast<size_t>(x / 32);
  return (mask.words[word] >> (x % 32)) & 1u;
}

} // namespace

bool AlphaMaskView::opaque(Vec2 uv) const {
  const double s = static_cast<double>(uv.x) * uv_scale.x + uv_offset.x;
  const double t = static_cast<double>(uv.y) * uv_scale.y + uv_offset.y;
  // Texel centres are at (i + 1/2) / size; t runs up while rows run down.
  const double x = s * width - 0.5, y = (1.0 - t) * height - 0.5;
  constexpr double kLimit = 9.0e15; // beyond this, doubles cannot distinguish neighbouring texels
  if (!(std::abs(x) < kLimit && std::abs(y) < kLimit)) return true;
  const auto x0 = static_cast<int64_t>(std::floor(x)), y0 = static_cast<int64_t>(std::floor(y));
  // A texel with zero bilinear weight does not contribute.
  const int64_t x1 = x0 + (x > static_cast<double>(x0)), y1 = y0 + (y > static_cast<double>(y0));
  return texel_opaque(*this, x0, y0) || texel_opaque(*this, x1, y0) || texel_opaque(*this, x0, y1) ||
         texel_opaque(*this, x1, y1);
}

AlphaMaskView view(const AlphaMask& mask) {
  return {mask.width, mask.height, mask.wrap, mask.uv_scale, mask.uv_offset, mask.words};
}

} // namespace packtrace
