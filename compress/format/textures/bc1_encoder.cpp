#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include <tbb/parallel_for.h>

#include "compress/format/textures/texture_encoder.h"

namespace packtrace {
namespace {

constexpr size_t kTexels = 16;
constexpr std::array<int32_t, 3> kLargest{31, 63, 31}; // largest value per channel of an endpoint

using Block = std::array<Rgb8, kTexels>;
using Colour = std::array<double, 3>;
using Endpoint = std::array<int32_t, 3>; ///< 5, 6, 5 bits

uint16_t packed(const Endpoint& e) { return static_cast<uint16_t>((e[0] << 11) | (e[1] << 5) | e[2]); }

Endpoint rounded(const Colour& colour) {
  Endpoint e;
  for (size_t c = 0; c < 3; ++c)
    e[c] = std::clamp(static_cast<int32_t>(std::lrint(colour[c] * kLargest[c] / 255.0)), 0, kLargest[c]);
  return e;
}

/// Two endpoints, and for each texel the nearest of the four colours that they define.
struct Fit {
  Endpoint a{}, b{};
  std::array<uint8_t, kTexels> index{}; ///< BC1 index: 0 is a, 1 is b, 2 is 2/3 a + 1/3 b, 3 is 1/3 a + 2/3 b
  uint32_t error = std::numeric_limits<uint32_t>::max();
};

Fit fit_indices(const Block& block, Endpoint a, Endpoint b) {
  if (packed(a) < packed(b)) std::swap(a, b);
  Fit fit{a, b, {}, 0};
  const std::array<Rgb8, 4> colours = bc1_colours(packed(a), packed(b));
  const size_t choices = packed(a) == packed(b) ? 1 : 4; // equal endpoints select BC1's other palette
  for (size_t i = 0; i < kTexels; ++i) {
    int32_t least = std::numeric_limits<int32_t>::max();
    for (size_t k = 0; k < choices; ++k) {
      int32_t d = 0;
      for (size_t c = 0; c < 3; ++c) d += (block[i][c] - colours[k][c]) * (block[i][c] - colours[k][c]);
      if (d < least) least = d, fit.index[i] = static_cast<uint8_t>(k);
    }
    fit.error += static_cast<uint32_t>(least);
  }
  return fit;
}

/// Returns the extremes of the block's colours along their principal axis.
std::pair<Colour, Colour> principal_ends(const Block& block) {
  Colour mean{};
  for (const Rgb8& texel : block)
    for (size_t c = 0; c < 3; ++c) mean[c] += texel[c] / double{kTexels};
  std::array<Colour, 3> covariance{};
  for (const Rgb8& texel : block)
    for (size_t r = 0; r < 3; ++r)
      for (size_t c = 0; c < 3; ++c) covariance[r][c] += (texel[r] - mean[r]) * (texel[c] - mean[c]);
  // Power iteration starts from the row with the largest variance, which is never orthogonal to the axis.
  size_t start = 0;
  for (size_t c = 1; c < 3; ++c)
    if (covariance[c][c] > covariance[start][start]) start = c;
  Colour axis = covariance[start];
  for (int round = 0; round < 8; ++round) {
    Colour next{};
    double largest = 0.0;
    for (size_t r = 0; r < 3; ++r) {
      for (size_t c = 0; c < 3; ++c) next[r] += covariance[r][c] * axis[c];
      largest = std::max(largest, std::abs(next[r]));
    }
    if (!(largest > 0.0)) return {mean, mean};
    for (size_t c = 0; c < 3; ++c) axis[c] = next[c] / largest;
  }
  double square = 0.0, lo = 0.0, hi = 0.0;
  for (const double a : axis) square += a * a;
  for (const Rgb8& texel : block) {
    double along = 0.0;
    for (size_t c = 0; c < 3; ++c) along += (texel[c] - mean[c]) * axis[c] / square;
    lo = std::min(lo, along), hi = std::max(hi, along);
  }
  Colour a = mean, b = mean;
  for (size_t c = 0; c < 3; ++c) a[c] += hi * axis[c], b[c] += lo * axis[c];
  return {a, b};
}

/// Returns the endpoints with the least squared error for a fit's indices, before rounding; the fit's own endpoints if
/// all its indices are equal.
std::pair<Endpoint, Endpoint> least_squares(const Block& block, const Fit& fit) {
  constexpr std::array<double, 4> kWeightOfA{1.0, 0.0, 2.0 / 3.0, 1.0 / 3.0};
  double aa = 0.0, ab = 0.0, bb = 0.0;
  Colour av{}, bv{};
  for (size_t i = 0; i < kTexels; ++i) {
    const double wa = kWeightOfA[fit.index[i]], wb = 1.0 - wa;
    aa += wa * wa, ab += wa * wb, bb += wb * wb;
    for (size_t c = 0; c < 3; ++c) av[c] += wa * block[i][c], bv[c] += wb * block[i][c];
  }
  const double determinant = aa * bb - ab * ab;
  if (!(determinant > 1e-9)) return {fit.a, fit.b};
  Colour a, b;
  for (size_t c = 0; c < 3; ++c)
    a[c] = (av[c] * bb - bv[c] * ab) / determinant, b[c] = (bv[c] * aa - av[c] * ab) / determinant;
  return {rounded(a), rounded(b)};
}

/// Changes single endpoint channels by one as long as that lowers the error.
void search_around(const Block& block, Fit& best) {
  for (bool better = true; better && best.error > 0;) {
    better = false;
    for (size_t move = 0; move < 12; ++move) {
      Endpoint a = best.a, b = best.b;
      int32_t& channel = (move & 1u) != 0 ? a[move / 4] : b[move / 4];
      channel += (move & 2u) != 0 ? 1 : -1;
      if (channel < 0 || channel > kLargest[move / 4]) continue;
      const Fit fit = fit_indices(block, a, b);
      if (fit.error < best.error) best = fit, better = true;
    }
  }
}

Fit fit_block(const Block& block) {
  const auto [hi, lo] = principal_ends(block);
  Fit best = fit_indices(block, rounded(hi), rounded(lo));
  for (int round = 0; round < 8 && best.error > 0; ++round) {
    const auto [a, b] = least_squares(block, best);
    const Fit fit = fit_indices(block, a, b);
    if (fit.error >= best.error) break;
    best = fit;
  }
  // A single colour that 5 and 6 bits cannot represent: interpolate.
  if (packed(best.a) == packed(best.b) && best.error > 0) {
    Endpoint a = best.a;
    for (size_t c = 0; c < 3; ++c) a[c] = std::min(a[c] + 1, kLargest[c]);
    const Fit fit = fit_indices(block, a, best.b);
    if (fit.error < best.error) best = fit;
  }
  search_around(block, best);
  return best;
}

Block block_at(const AlbedoTexture& texture, uint32_t x0, uint32_t y0) {
  Block block;
  for (uint32_t i = 0; i < kTexels; ++i) { // repeats the texture's border beyond its size
    const uint32_t x = std::min(x0 + i % 4, texture.width - 1), y = std::min(y0 + i / 4, texture.height - 1);
    const uint8_t* const rgb = texture.rgb.data() + (size_t{y} * texture.width + x) * 3;
    block[i] = {rgb[0], rgb[1], rgb[2]};
  }
  return block;
}

void write_block(const Fit& fit, uint8_t* to) {
  for (const uint16_t endpoint : {packed(fit.a), packed(fit.b)})
    *to++ = static_cast<uint8_t>(endpoint & 255u), *to++ = static_cast<uint8_t>(endpoint >> 8);
  for (size_t row = 0; row < 4; ++row) {
    uint32_t bits = 0;
    for (size_t column = 0; column < 4; ++column) bits |= uint32_t{fit.index[4 * row + column]} << (2 * column);
    *to++ = static_cast<uint8_t>(bits);
  }
}

} // namespace

std::vector<uint8_t> encode_bc1(const AlbedoTexture& texture) {
  std::vector<uint8_t> data(static_cast<size_t>(texture_bytes(TextureCodec::kBc1, texture.width, texture.height)));
  const size_t columns = (size_t{texture.width} + 3) / 4, rows = (size_t{texture.height} + 3) / 4;
  tbb::parallel_for(size_t{0}, rows, [&](size_t y) {
    for (size_t x = 0; x < columns; ++x)
      write_block(fit_block(block_at(texture, static_cast<uint32_t>(4 * x), static_cast<uint32_t>(4 * y))),
                  data.data() + (y * columns + x) * kBc1BlockBytes);
  });
  return data;
}

} // namespace packtrace
