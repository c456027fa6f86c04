#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include "runtime/camera/gbuffer.h"

namespace packtrace::synthetic {

/// Uniform random number in [0,1), independent per pixel and frame.
inline float uniform(uint32_t x, uint32_t y, uint32_t frame) {
  uint64_t h = (static_cast<uint64_t>(frame) << 42) ^ (static_cast<uint64_t>(y) << 21) ^ x;
  h = (h ^ (h >> 31)) * 0x9e3779b97f4a7c15ull;
  h = (h ^ (h >> 29)) * 0xbf58476d1ce4e5b9ull;
  h = (h ^ (h >> 32)) * 0x94d049bb133111ebull;
  return static_cast<float>(static_cast<uint32_t>((h ^ (h >> 31)) >> 40)) * 0x1p-24f;
}

inline constexpr float kOccluded =
    0.25f; ///< AO of an occluded sample; others have 1, so the raw RMSE at p = 1/2 is 0.375

inline float noisy(float p, uint32_t x, uint32_t y, uint32_t frame) {
  return uniform(x, y, frame) < p ? kOccluded : 1.0f;
}
inline float expected(float p) { return 1.0f - (1.0f - kOccluded) * p; }

/// G-buffer of a wall that faces the camera.
inline GBuffer wall(ImageSize size, float z = 10.0f) {
  GBuffer g;
  g.resize(size);
  for (size_t i = 0; i < size.pixels(); ++i) g.view_z[i] = z, g.normal[i] = Vec3(0, 0, -1), g.instance[i] = 0;
  return g;
}

/// AO frame with values from a function of the pixel.
inline AoFrame samples(ImageSize size, const std::function<float(uint32_t x, uint32_t y)>& ao) {
  AoFrame frame;
  frame.resize(size);
  for (uint32_t y = 0; y < size.height; ++y)
    for (uint32_t x = 0; x < size.width; ++x) frame.ao[static_cast<size_t>(y) * size.width + x] = ao(x, y);
  return frame;
}

/// One sample per pixel, occluded with probability p.
inline AoFrame noise(ImageSize size, float p, uint32_t frame) {
  return samples(size, [&](uint32_t x, uint32_t y) { return noisy(p, x, y, frame); });
}

struct Rect {
  uint32_t x0, y0, x1, y1; ///< half-open
};

inline Rect all(ImageSize size) { return {0, 0, size.width, size.height}; }

inline double mean_of(const std::vector<float>& image, ImageSize size, Rect r) {
  double sum = 0;
  for (uint32_t y = r.y0; y < r.y1; ++y)
    for (uint32_t x = r.x0; x < r.x1; ++x) sum += static_cast<double>(image[static_cast<size_t>(y) * size.width + x]);
  return sum / (static_cast<double>(r.x1 - r.x0) * static_cast<double>(r.y1 - r.y0));
}

inline double rmse_of(const std::vector<float>& image, ImageSize size, Rect r,
                      const std::function<float(uint32_t x, uint32_t y)>& truth) {
  double sum = 0;
  for (uint32_t y = r.y0; y < r.y1; ++y)
    for (uint32_t x = r.x0; x < r.x1; ++x) {
      const double d = static_cast<double>(image[static_cast<size_t>(y) * size.width + x] - truth(x, y));
      sum += d * d;
    }
  return std::sqrt(sum / (static_cast<double>(r.x1 - r.x0) * static_cast<double>(r.y1 - r.y0)));
}

} // namespace packtrace::synthetic
