#include "runtime/trace/source/texture_pyramids.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace packtrace {
namespace {

/// A level in linear light.
struct LinearImage {
  uint32_t width = 0, height = 0;
  std::vector<Vec3> texels;
};

/// Texels of a level that lie in a texel of the next one, with the parts of them that do.
struct Cover {
  uint32_t first = 0;
  std::vector<float> weights; ///< sum 1
};

/// @param n number of texels along an axis, at least 2
Cover cover_of(uint32_t n, uint32_t half, uint32_t i) {
  const double ratio = static_cast<double>(n) / half, begin = i * ratio, end = std::min((i + 1) * ratio, double(n));
  Cover cover;
  cover.first = std::min(static_cast<uint32_t>(begin), n - 1);
  for (uint32_t x = cover.first; x < n && x < end; ++x)
    cover.weights.push_back(static_cast<float>((std::min(x + 1.0, end) - std::max<double>(x, begin)) / (end - begin)));
  return cover;
}

std::vector<Cover> covers(uint32_t n, uint32_t half) {
  std::vector<Cover> all(half);
  for (uint32_t i = 0; i < half; ++i) all[i] = cover_of(n, half, i);
  return all;
}

/// Averages an image to half its sides.
/// @param texel returns the linear colour of (x, y)
template <class Texel>
LinearImage halved(uint32_t width, uint32_t height, const Texel& texel) {
  LinearImage out{std::max(1u, width / 2), std::max(1u, height / 2), {}};
  out.texels.resize(size_t{out.width} * out.height);
  const std::vector<Cover> columns = covers(width, out.width), rows = covers(height, out.height);
  tbb::parallel_for(tbb::blocked_range<uint32_t>(0, out.height, 16), [&](const tbb::blocked_range<uint32_t>& range) {
    for (uint32_t y = range.begin(); y < range.end(); ++y)
      for (uint32_t x = 0; x < out.width; ++x) {
        Vec3 sum(0.0f);
        for (uint32_t j = 0; j < rows[y].weights.size(); ++j)
          for (uint32_t i = 0; i < columns[x].weights.size(); ++i)
            sum += rows[y].weights[j] * columns[x].weights[i] * texel(columns[x].first + i, rows[y].first + j);
        out.texels[size_t{y} * out.width + x] = sum;
      }
  });
  return out;
}

std::vector<uint8_t> encoded(const LinearImage& image) {
  std::vector<uint8_t> rgb(3 * image.texels.size());
  for (size_t i = 0; i < image.texels.size(); ++i)
    for (int c = 0; c < 3; ++c) rgb[3 * i + static_cast<size_t>(c)] = srgb8_of_linear(image.texels[i][c]);
  return rgb;
}

struct LevelBytes {
  uint64_t all = 0;    ///< of the levels below the full one
  uint64_t floats = 0; ///< of two successive ones in linear light, the largest
};

LevelBytes level_bytes(uint32_t width, uint32_t height) {
  LevelBytes bytes;
  while (width > 1 || height > 1) {
    width = std::max(1u, width / 2), height = std::max(1u, height / 2);
    const uint64_t texels = uint64_t{width} * height;
    bytes.all += 3 * texels;
    if (bytes.floats == 0) bytes.floats = 2 * sizeof(Vec3) * texels;
  }
  return bytes;
}

} // namespace

TexturePyramids::TexturePyramids(const SceneSource& source, const std::optional<MemoryBudget>& memory) {
  for (const Material& material : source.materials()) {
    const uint32_t texture = material.albedo_texture;
    if (texture == kNoTexture) continue;
    if (texture >= pyramids_.size()) pyramids_.resize(size_t{texture} + 1);
    if (pyramids_[texture].levels.empty()) {
      pyramids_[texture].full = source.texture(texture);
      pyramids_[texture].levels = {pyramids_[texture].full};
    }
  }
  constexpr std::string_view kWhat = "mip levels of textures";
  MemoryReservation floats;
  if (memory) {
    uint64_t bytes = 0, largest = 0;
    for (const Pyramid& pyramid : pyramids_) {
      const LevelBytes of_texture = level_bytes(pyramid.full.width, pyramid.full.height);
      bytes += pyramid.levels.empty() ? 0 : of_texture.all;
      largest = std::max(largest, of_texture.floats);
    }
    memory_ = MemoryReservation(*memory, bytes, kWhat);
    floats = MemoryReservation(*memory, largest, kWhat);
  }
  for (Pyramid& pyramid : pyramids_)
    if (!pyramid.levels.empty()) build(pyramid);
}

void TexturePyramids::build(Pyramid& pyramid) {
  const TextureView& full = pyramid.full;
  if (full.width == 0 || full.height == 0 || (full.width == 1 && full.height == 1)) return;
  const std::array<float, 256>& linear = linear_of_srgb8();
  LinearImage level = halved(full.width, full.height, [&](uint32_t x, uint32_t y) {
    const Rgb8 texel = full.texel(x, y);
    return Vec3(linear[texel[0]], linear[texel[1]], linear[texel[2]]);
  });
  for (;;) {
    pyramid.texels.push_back(encoded(level));
    TextureView view = full;
    view.width = level.width, view.height = level.height;
    view.codec = TextureCodec::kRgb8, view.data = pyramid.texels.back();
    pyramid.levels.push_back(view);
    if (level.width == 1 && level.height == 1) return;
    level = halved(level.width, level.height,
                   [&](uint32_t x, uint32_t y) { return level.texels[size_t{y} * level.width + x]; });
  }
}

Vec3 TexturePyramids::mean(uint32_t texture, Vec2 uv, Vec2 side_a, Vec2 side_b) const {
  const Pyramid& pyramid = pyramids_[texture];
  const TextureView& full = pyramid.full;
  const Vec2 texels = full.uv_scale * Vec2(static_cast<float>(full.width), static_cast<float>(full.height));
  // The axes of the footprint are those of the ellipse that the sides, as columns of a matrix, make of the unit circle.
  const Vec2 a = side_a * texels, b = side_b * texels;
  const float aa = glm::dot(a, a), bb = glm::dot(b, b), ab = glm::dot(a, b);
  const float longer = std::sqrt(0.5f * (aa + bb + std::hypot(aa - bb, 2.0f * ab)));
  if (!(longer > 1.0f) || !std::isfinite(longer)) return full.sample(uv);
  const float angle = 0.5f * std::atan2(2.0f * ab, aa - bb);
  const Vec2 along = std::cos(angle) * side_a + std::sin(angle) * side_b;
  const float shorter = std::clamp(std::abs(a.x * b.y - a.y * b.x) / longer, 1.0f, longer);
  constexpr float kRounding = 1e-3f; // of the ratio, so that footprints as wide as long take one sample
  const float samples = std::ceil(longer / shorter - kRounding);
  const int probes = static_cast<int>(std::clamp(samples, 1.0f, static_cast<float>(kMaxProbes)));
  const float texel = std::max(shorter, longer / static_cast<float>(probes));
  const float last = static_cast<float>(pyramid.levels.size() - 1);
  const float level = std::clamp(std::log2(texel), 0.0f, last);
  const auto finer = static_cast<size_t>(level);
  const float coarser_share = level - static_cast<float>(finer);
  Vec3 sum(0.0f);
  for (int i = 0; i < probes; ++i) {
    const Vec2 at = uv + along * ((static_cast<float>(i) + 0.5f) / static_cast<float>(probes) - 0.5f);
    Vec3 colour = pyramid.levels[finer].sample(at);
    if (coarser_share > 0.0f) colour += (pyramid.levels[finer + 1].sample(at) - colour) * coarser_share;
    sum += colour;
  }
  return sum / static_cast<float>(probes);
}

uint64_t TexturePyramids::bytes() const {
  uint64_t bytes = 0;
  for (const Pyramid& pyramid : pyramids_)
    for (const std::vector<uint8_t>& texels : pyramid.texels) bytes += texels.size();
  return bytes;
}

} // namespace packtrace
