#include "compress/exchange/shader/bit_image.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace packtrace {
namespace {

/// Bits of an image, their filtered sums, and the levels that the sums should have.
class BitSearch {
public:
  BitSearch(uint32_t width, uint32_t height, std::vector<float> wanted)
      : width_(static_cast<int32_t>(width)), height_(static_cast<int32_t>(height)), wanted_(std::move(wanted)),
        bits_(wanted_.size()), error_(wanted_.size()) {
    diffuse();
    for (int32_t y = 0; y < height_; ++y)
      for (int32_t x = 0; x < width_; ++x) error_[at(x, y)] -= wanted_[at(x, y)];
    for (int32_t y = 0; y < height_; ++y)
      for (int32_t x = 0; x < width_; ++x)
        if (bits_[at(x, y)] != 0) add(x, y, 1.0f);
  }

  /// Flips single bits and swaps neighbours until nothing lowers the error.
  void improve() {
    constexpr int kSweeps = 32;
    bool changed = true;
    for (int sweep = 0; sweep < kSweeps && changed; ++sweep) {
      changed = false;
      for (int32_t y = 0; y < height_; ++y)
        for (int32_t x = 0; x < width_; ++x) {
          changed |= try_flip(x, y);
          if (x + 1 < width_) changed |= try_swap(x, y, x + 1, y);
          if (y + 1 < height_) changed |= try_swap(x, y, x, y + 1);
        }
    }
  }

  std::vector<uint8_t> take_bits() { return std::move(bits_); }
  /// Filtered sum at a texel, 0..kBitLevels.
  float level(size_t texel) const { return wanted_[texel] + error_[texel]; }

private:
  static constexpr float kMinGain = 1e-3f; // of a gain, so that the search ends despite rounding

  size_t at(int32_t x, int32_t y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x);
  }

  /// Weight of the bit in column or row `from` in the filter of `to`, which is at most one away.
  static float weight(int32_t from, int32_t to, int32_t size) {
    int32_t sum = 0;
    for (int32_t d = -1; d <= 1; ++d)
      if (std::clamp(to + d, 0, size - 1) == from) sum += kBitWeights[static_cast<size_t>(d + 1)];
    return static_cast<float>(sum);
  }

  template <class Visit>
  void around(int32_t x, int32_t y, const Visit& visit) const {
    for (int32_t v = std::max(y - 1, 0); v <= std::min(y + 1, height_ - 1); ++v)
      for (int32_t u = std::max(x - 1, 0); u <= std::min(x + 1, width_ - 1); ++u)
        visit(at(u, v), weight(x, u, width_) * weight(y, v, height_));
  }

  void add(int32_t x, int32_t y, float sign) {
    around(x, y, [&](size_t texel, float w) { error_[texel] += sign * w; });
  }

  /// By how much the squared error grows if a bit is flipped.
  float growth(int32_t x, int32_t y) const {
    const float sign = bits_[at(x, y)] != 0 ? -1.0f : 1.0f;
    float sum = 0.0f;
    around(x, y, [&](size_t texel, float w) { sum += sign * w * (2.0f * error_[texel] + sign * w); });
    return sum;
  }

  void flip(int32_t x, int32_t y) {
    uint8_t& bit = bits_[at(x, y)];
    add(x, y, bit != 0 ? -1.0f : 1.0f);
    bit ^= 1u;
  }

  bool try_flip(int32_t x, int32_t y) {
    if (!(growth(x, y) < -kMinGain)) return false;
    flip(x, y);
    return true;
  }

  bool try_swap(int32_t x, int32_t y, int32_t u, int32_t v) {
    if (bits_[at(x, y)] == bits_[at(u, v)]) return false;
    const float first = growth(x, y);
    flip(x, y);
    if (first + growth(u, v) < -kMinGain) {
      flip(u, v);
      return true;
    }
    flip(x, y);
    return false;
  }

  void diffuse() {
    std::vector<float> rest(wanted_);
    const auto spread = [&](int32_t x, int32_t y, float value) {
      if (x >= 0 && x < width_ && y < height_) rest[at(x, y)] += value;
    };
    for (int32_t y = 0; y < height_; ++y)
      for (int32_t x = 0; x < width_; ++x) {
        const float value = rest[at(x, y)];
        bits_[at(x, y)] = value >= 0.5f * kBitLevels ? 1 : 0;
        const float left = (value - (bits_[at(x, y)] != 0 ? float{kBitLevels} : 0.0f)) / 16.0f;
        spread(x + 1, y, 7.0f * left), spread(x - 1, y + 1, 3.0f * left);
        spread(x, y + 1, 5.0f * left), spread(x + 1, y + 1, left);
      }
  }

  int32_t width_, height_;
  std::vector<float> wanted_;
  std::vector<uint8_t> bits_;
  std::vector<float> error_; ///< sums minus wanted levels
};

DVec3 color_at(const AlbedoTexture& source, size_t texel) {
  return {source.rgb[3 * texel], source.rgb[3 * texel + 1], source.rgb[3 * texel + 2]};
}

/// Two colours on the main axis of those of an image, where a twentieth of the texels lies beyond each. Where these are
/// close, a twentieth would hide all that the image shows, and they are the outermost ones.
std::array<DVec3, 2> first_keys(const AlbedoTexture& source, size_t count) {
  DVec3 mean(0.0);
  for (size_t i = 0; i < count; ++i) mean += color_at(source, i);
  mean /= static_cast<double>(count);
  glm::dmat3 covariance(0.0);
  for (size_t i = 0; i < count; ++i) {
    const DVec3 d = color_at(source, i) - mean;
    covariance += glm::outerProduct(d, d);
  }
  DVec3 axis = glm::normalize(DVec3(0.3, 0.6, 0.1)); // brightness, if there is no other
  for (int step = 0; step < 32; ++step) {            // power iteration
    const DVec3 next = covariance * axis;
    if (const double length = glm::length(next); length > 0.0) axis = next / length;
  }
  if (axis.x + axis.y + axis.z < 0.0) axis = -axis;
  std::vector<float> places(count);
  for (size_t i = 0; i < count; ++i) places[i] = static_cast<float>(glm::dot(color_at(source, i) - mean, axis));
  std::ranges::sort(places);
  size_t margin = count / 20;
  constexpr float kClose = 0.25f; // of the whole range
  if (places[count - 1 - margin] - places[margin] < kClose * (places.back() - places.front())) margin = 0;
  return {mean + axis * double{places[margin]}, mean + axis * double{places[count - 1 - margin]}};
}

Rgb8 rounded(DVec3 color) {
  Rgb8 result;
  for (size_t c = 0; c < 3; ++c)
    result[c] = static_cast<uint8_t>(std::lrint(std::clamp(color[static_cast<glm::length_t>(c)], 0.0, 255.0)));
  return result;
}

/// Keys with the least squared error for given levels; the old ones if the levels do not differ.
std::array<Rgb8, 2> fitted_keys(const AlbedoTexture& source, const BitSearch& search, size_t count,
                                const std::array<Rgb8, 2>& old) {
  double aa = 0.0, ab = 0.0, bb = 0.0;
  DVec3 av(0.0), bv(0.0);
  for (size_t i = 0; i < count; ++i) {
    const double b = double{search.level(i)} / kBitLevels, a = 1.0 - b;
    aa += a * a, ab += a * b, bb += b * b;
    av += a * color_at(source, i), bv += b * color_at(source, i);
  }
  const double determinant = aa * bb - ab * ab;
  if (!(determinant > 1e-6 * static_cast<double>(count))) return old;
  return {rounded((av * bb - bv * ab) / determinant), rounded((bv * aa - av * ab) / determinant)};
}

/// Sum of the squared differences of an image and what the bits show with two keys.
double squared_error(const AlbedoTexture& source, const BitSearch& search, size_t count,
                     const std::array<Rgb8, 2>& keys) {
  const DVec3 from(keys[0][0], keys[0][1], keys[0][2]), way = DVec3(keys[1][0], keys[1][1], keys[1][2]) - from;
  double sum = 0.0;
  for (size_t i = 0; i < count; ++i) {
    const DVec3 difference = from + way * (double{search.level(i)} / kBitLevels) - color_at(source, i);
    sum += glm::dot(difference, difference);
  }
  return sum;
}

/// The levels whose colours are nearest to those of an image, as real numbers.
std::vector<float> levels_between(const AlbedoTexture& source, size_t count, const std::array<Rgb8, 2>& keys) {
  const DVec3 from(keys[0][0], keys[0][1], keys[0][2]), way = DVec3(keys[1][0], keys[1][1], keys[1][2]) - from;
  const double squared = glm::dot(way, way);
  std::vector<float> levels(count);
  for (size_t i = 0; i < count && squared > 0.0; ++i) {
    const double place = glm::dot(color_at(source, i) - from, way) / squared;
    levels[i] = static_cast<float>(kBitLevels * std::clamp(place, 0.0, 1.0));
  }
  return levels;
}

} // namespace

BitImage encode_bits(const AlbedoTexture& source) {
  const size_t count = source.rgb.size() / 3;
  const std::array<DVec3, 2> ends = first_keys(source, count);
  std::array<Rgb8, 2> keys{rounded(ends[0]), rounded(ends[1])};
  BitImage best;
  double least = std::numeric_limits<double>::infinity();
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round) {
    BitSearch search(source.width, source.height, levels_between(source, count, keys));
    search.improve();
    const std::array<Rgb8, 2> fitted = fitted_keys(source, search, count, keys);
    const double error = squared_error(source, search, count, fitted);
    if (error < least) least = error, best.keys = fitted, best.bits = search.take_bits();
    if (fitted == keys) break;
    keys = fitted;
  }
  return best;
}

} // namespace packtrace
