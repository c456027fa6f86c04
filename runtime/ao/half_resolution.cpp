#include "runtime/ao/half_resolution.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace packtrace {
namespace {

constexpr double kMaxSlope = 0.3;      ///< sine of the angle between line and surface from which the weight is 0
constexpr float kNormalSlack = 1.1f;   ///< normals up to acos(1 / 1.1) = 25 degrees apart count as equal
constexpr int kNormalSquarings = 6;    ///< cosine to the power of 64
constexpr float kMinWeight = 0.1f;     ///< smallest total weight with which a mean is used
constexpr float kMinWeightFar = 0.01f; ///< the same for the 5 x 5 nearest blocks
constexpr float kSimilar = 0.99f;      ///< similarity at which the search for a more similar block stops
constexpr float kMuchLower = 0.25f;    ///< difference of similarity from which another pixel of a block is chosen

/// How two surface points relate.
struct Relation {
  float cosine; ///< between the shading normals
  float slope2; ///< squared sine of the angle between their line and the surfaces, the larger one
};

Relation relate(const GBuffer& g, size_t a, size_t b) {
  const DVec3 line = DVec3(g.position[b]) - DVec3(g.position[a]);
  const double length2 = glm::dot(line, line);
  const double height = std::max(std::abs(glm::dot(DVec3(g.geometric_normal[a]), line)),
                                 std::abs(glm::dot(DVec3(g.geometric_normal[b]), line)));
  const double slope2 = length2 > 0.0 ? height * height / length2 : 0.0;
  return {glm::dot(g.normal[a], g.normal[b]), static_cast<float>(slope2)};
}

/// 1 for points of one plane, 0 for points of different surfaces.
float similarity(Relation r) {
  float aligned = std::min(1.0f, kNormalSlack * r.cosine);
  const float flat = 1.0f - r.slope2 / static_cast<float>(kMaxSlope * kMaxSlope);
  if (!(aligned > 0.0f) || !(flat > 0.0f)) return 0.0f; // also for NaN
  for (int i = 0; i < kNormalSquarings; ++i) aligned *= aligned;
  return aligned * flat * flat;
}

float similarity(const GBuffer& g, size_t a, size_t b) {
  if (!(glm::dot(g.normal[a], g.normal[b]) > 0.0f)) return 0.0f; // spares reading positions
  return similarity(relate(g, a, b));
}

bool is_hit(const GBuffer& g, size_t pixel) { return g.instance[pixel] != kNoInstance; }

constexpr std::array<std::array<uint32_t, 2>, 4> kOffsets{{{0, 0}, {1, 1}, {1, 0}, {0, 1}}}; ///< diagonal first

/// Full pixels of a block; those beyond the right and bottom edge are left out.
struct Block {
  std::array<uint32_t, 4> pixels;
  uint32_t count = 0;

  Block(ImageSize full, uint32_t bx, uint32_t by) {
    for (const auto& [x, y] : kOffsets)
      if (2 * bx + x < full.width && 2 * by + y < full.height) pixels[count++] = (2 * by + y) * full.width + 2 * bx + x;
  }
};

template <class Body>
void for_each_row(uint32_t rows, const Body& body) {
  tbb::parallel_for(tbb::blocked_range<uint32_t>(0, rows, 8), [&](const tbb::blocked_range<uint32_t>& range) {
    for (uint32_t y = range.begin(); y != range.end(); ++y) body(y);
  });
}

/// Calls body(index, column, row) for the blocks of some columns and rows, bounds included, that lie in the picture.
template <class Body>
void for_blocks(ImageSize half, uint32_t x0, uint32_t y0, uint32_t x1, uint32_t y1, const Body& body) {
  x1 = std::min(half.width - 1, x1), y1 = std::min(half.height - 1, y1);
  for (uint32_t y = y0; y <= y1; ++y)
    for (uint32_t x = x0; x <= x1; ++x) body(size_t{y} * half.width + x, x, y);
}

/// Calls body(index, column, row) for the blocks within `reach` of a block, itself included.
template <class Body>
void for_neighbours(ImageSize half, uint32_t bx, uint32_t by, uint32_t reach, const Body& body) {
  for_blocks(half, bx > reach ? bx - reach : 0, by > reach ? by - reach : 0, bx + reach, by + reach, body);
}

/// The first pixel that shows a surface, per block.
std::vector<uint32_t> first_hits(const GBuffer& full, ImageSize half) {
  std::vector<uint32_t> pixel(half.pixels());
  for_each_row(half.height, [&](uint32_t by) {
    for (uint32_t bx = 0; bx < half.width; ++bx) {
      const Block block(full.size, bx, by);
      const auto end = block.pixels.begin() + block.count;
      const auto found = std::find_if(block.pixels.begin(), end, [&](uint32_t p) { return is_hit(full, p); });
      pixel[size_t{by} * half.width + bx] = found == end ? block.pixels[0] : *found;
    }
  });
  return pixel;
}

/// The pixel of a block that is least similar to the first hits of the neighbouring blocks.
uint32_t least_similar(const GBuffer& full, ImageSize half, const std::vector<uint32_t>& first, uint32_t bx,
                       uint32_t by) {
  const size_t own = size_t{by} * half.width + bx;
  const auto best_similarity = [&](uint32_t p) {
    float best = 0.0f;
    for_neighbours(half, bx, by, 1, [&](size_t other, uint32_t, uint32_t) {
      if (other != own && best < kSimilar && is_hit(full, first[other]))
        best = std::max(best, similarity(full, p, first[other]));
    });
    return best;
  };
  uint32_t chosen = first[own];
  if (!is_hit(full, chosen)) return chosen;
  float least = best_similarity(chosen) - kMuchLower;
  const Block block(full.size, bx, by);
  for (uint32_t i = 0; i < block.count && least > 0.0f; ++i) {
    const uint32_t p = block.pixels[i];
    if (p == first[own] || !is_hit(full, p)) continue;
    if (const float value = best_similarity(p); value < least) least = value, chosen = p;
  }
  return chosen;
}

/// Without the channels that a G-buffer may do without: neither occlusion nor its denoiser reads them.
GBuffer pixels_of(const GBuffer& full, ImageSize half, const std::vector<uint32_t>& pixel) {
  GBuffer g;
  g.keep_channels(0);
  g.make_room(half);
  g.previous_z.resize(full.previous_z.empty() ? 0 : half.pixels());
  g.pixel_spread = 2.0f * full.pixel_spread;
  for_each_row(half.height, [&](uint32_t by) {
    for (size_t i = size_t{by} * half.width; i < size_t{by + 1} * half.width; ++i) {
      const uint32_t p = pixel[i];
      g.view_z[i] = full.view_z[p], g.position[i] = full.position[p], g.normal[i] = full.normal[p];
      g.geometric_normal[i] = full.geometric_normal[p], g.instance[i] = full.instance[p];
      g.offset[i] = full.offset[p], g.motion_px[i] = full.motion_px[p] * 0.5f;
      if (!g.previous_z.empty()) g.previous_z[i] = full.previous_z[p];
    }
  });
  return g;
}

template <size_t kLayers>
class Upsampler {
public:
  using Layers = std::array<float, kLayers>; ///< values of a pixel

  Upsampler(const GBuffer& full, const HalfGBuffer& half, const std::array<std::span<const float>, kLayers>& ao)
      : full_(full), half_(half), ao_(ao) {}

  Layers values(uint32_t x, uint32_t y) const {
    const size_t pixel = size_t{y} * full_.size.width + x;
    if (!is_hit(full_, pixel)) return no_values();
    const ImageSize size = half_.gbuffer.size;
    const uint32_t bx = x / 2, by = y / 2;
    if (const size_t own = size_t{by} * size.width + bx; half_.pixel[own] == pixel) return at(own);
    Means near;
    // A half pixel less than two full pixels away belongs to the pixel's own block or to the closer neighbouring block
    // on each axis: the one before for the first pixel of a block, the one after for the second.
    const uint32_t x0 = bx - (x % 2 == 0 && bx > 0 ? 1 : 0), y0 = by - (y % 2 == 0 && by > 0 ? 1 : 0);
    for_blocks(size, x0, y0, bx + x % 2, by + y % 2, [&](size_t i, uint32_t nx, uint32_t ny) {
      const auto [dx, dy] = distances(x, y, i, nx, ny);
      if (dx < 2 && dy < 2 && is_hit(half_.gbuffer, i))
        near.add((2 - dx) * (2 - dy) * 0.25f * similarity(full_, pixel, half_.pixel[i]), at(i));
    });
    Layers values = near.values(kMinWeight);
    if (std::ranges::all_of(values, [](float v) { return v >= 0.0f; })) return values;
    const Layers others = values_around(x, y, pixel);
    for (size_t layer = 0; layer < kLayers; ++layer)
      if (values[layer] < 0.0f) values[layer] = others[layer];
    return values;
  }

private:
  /// Weighted means of the valid values of each layer.
  struct Means {
    Layers weight{}, sum{}, lo, hi;
    Means() { lo.fill(INFINITY), hi.fill(-INFINITY); }
    void add(float w, const Layers& v) {
      if (!(w > 0.0f)) return;
      for (size_t i = 0; i < kLayers; ++i)
        if (v[i] >= 0.0f)
          weight[i] += w, sum[i] += w * v[i], lo[i] = std::min(lo[i], v[i]), hi[i] = std::max(hi[i], v[i]);
    }
    /// kInvalidAo where the total weight is less than `least`.
    Layers values(float least) const {
      Layers v = no_values();
      for (size_t i = 0; i < kLayers; ++i)
        if (weight[i] >= least) v[i] = std::clamp(sum[i] / weight[i], lo[i], hi[i]); // rounding leaves the range
      return v;
    }
  };

  static Layers no_values() {
    Layers none;
    none.fill(kInvalidAo);
    return none;
  }
  Layers at(size_t i) const {
    Layers v;
    for (size_t layer = 0; layer < kLayers; ++layer) v[layer] = ao_[layer][i];
    return v;
  }

  /// Means over the 5 x 5 nearest blocks.
  Layers values_around(uint32_t x, uint32_t y, size_t pixel) const {
    Means far, unlike;
    for_neighbours(half_.gbuffer.size, x / 2, y / 2, 2, [&](size_t i, uint32_t nx, uint32_t ny) {
      if (!is_hit(half_.gbuffer, i)) return;
      const auto [dx, dy] = distances(x, y, i, nx, ny);
      const float closeness = 1.0f / (1.0f + dx * dx + dy * dy);
      const Relation r = relate(full_, pixel, half_.pixel[i]);
      far.add(closeness * similarity(r), at(i));
      const float similar = (1.0f + r.cosine) * (1.0f - r.slope2);
      unlike.add(similar > 0.0f ? closeness * (similar * similar + 1e-6f) : closeness * 1e-6f, at(i));
    });
    Layers values = far.values(kMinWeightFar);
    const Layers others = unlike.values(std::numeric_limits<float>::min());
    for (size_t layer = 0; layer < kLayers; ++layer)
      if (values[layer] < 0.0f) values[layer] = others[layer];
    return values;
  }

  /// Distances of a half pixel along both axes, in full pixels.
  std::array<float, 2> distances(uint32_t x, uint32_t y, size_t i, uint32_t bx, uint32_t by) const {
    const uint32_t width = full_.size.width, in_block = half_.pixel[i] - (2 * by * width + 2 * bx);
    const uint32_t row = in_block >= width ? 1 : 0;
    return {std::abs(static_cast<float>(2 * bx + in_block - row * width) - static_cast<float>(x)),
            std::abs(static_cast<float>(2 * by + row) - static_cast<float>(y))};
  }

  const GBuffer& full_;
  const HalfGBuffer& half_;
  const std::array<std::span<const float>, kLayers> ao_;
};

} // namespace

HalfGBuffer halve(const GBuffer& full) {
  const ImageSize size{(full.size.width + 1) / 2, (full.size.height + 1) / 2};
  const std::vector<uint32_t> first = first_hits(full, size);
  HalfGBuffer half;
  half.pixel.resize(size.pixels());
  for_each_row(size.height, [&](uint32_t by) {
    for (uint32_t bx = 0; bx < size.width; ++bx)
      half.pixel[size_t{by} * size.width + bx] = least_similar(full, size, first, bx, by);
  });
  half.gbuffer = pixels_of(full, size, half.pixel);
  return half;
}

template <size_t kLayers>
std::array<std::vector<float>, kLayers> upsample_ao(const GBuffer& full, const HalfGBuffer& half,
                                                    const std::array<std::span<const float>, kLayers>& layers) {
  const Upsampler<kLayers> upsampler(full, half, layers);
  std::array<std::vector<float>, kLayers> result;
  for (std::vector<float>& layer : result) layer.resize(full.size.pixels());
  for_each_row(full.size.height, [&](uint32_t y) {
    for (uint32_t x = 0; x < full.size.width; ++x) {
      const std::array<float, kLayers> values = upsampler.values(x, y);
      for (size_t i = 0; i < kLayers; ++i) result[i][size_t{y} * full.size.width + x] = values[i];
    }
  });
  return result;
}

template std::array<std::vector<float>, 1> upsample_ao(const GBuffer&, const HalfGBuffer&,
                                                       const std::array<std::span<const float>, 1>&);
template std::array<std::vector<float>, 2> upsample_ao(const GBuffer&, const HalfGBuffer&,
                                                       const std::array<std::span<const float>, 2>&);

} // namespace packtrace
