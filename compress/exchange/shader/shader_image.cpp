#include "compress/exchange/shader/shader_image.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "compress/exchange/shader/bit_image.h"
#include "compress/format/textures/texture_encoder.h"

namespace packtrace {
namespace {

constexpr uint32_t kRampSteps = kRampKnots - 1;

uint32_t bits_of(TexelFormat format) { return format == TexelFormat::kBit ? 1 : 8; }

/// Rounded value between two, at `part` of `whole`.
uint8_t between(uint32_t a, uint32_t b, uint32_t part, uint32_t whole) {
  return static_cast<uint8_t>((a * (whole - part) + b * part + whole / 2) / whole);
}

/// Where a byte lies on the curve of colours: the knot before it, and the way to the next one in 255ths.
std::array<uint32_t, 2> ramp_place(uint32_t value) {
  const uint32_t knot = std::min(value * kRampSteps / 255, kRampSteps - 1);
  return {knot, value * kRampSteps - knot * 255};
}

Rgb8 ramp_color(const std::vector<uint32_t>& ramp, uint32_t value) {
  const auto [knot, part] = ramp_place(value);
  Rgb8 color;
  for (uint32_t c = 0; c < 3; ++c)
    color[c] = between(ramp[knot] >> (8 * c) & 0xffu, ramp[knot + 1] >> (8 * c) & 0xffu, part, 255);
  return color;
}

void set_texel(ShaderImage& image, size_t number, uint32_t value) {
  const uint32_t bits = bits_of(image.format);
  image.words[number * bits / 32] |= value << (number * bits % 32);
}

uint32_t stored(const ShaderImage& image, size_t number) {
  const uint32_t bits = bits_of(image.format);
  return image.words[number * bits / 32] >> (number * bits % 32) & ((1u << bits) - 1);
}

/// Colours of the knots with the least squared error for given bytes: normal equations, which link neighbours only. A
/// small weight on the second difference fills parts of the curve without texels.
std::vector<uint32_t> fit_ramp(const AlbedoTexture& source, const std::vector<uint8_t>& values) {
  constexpr size_t n = kRampKnots;
  std::array<std::array<double, n>, n> matrix{};
  std::array<DVec3, n> right{};
  for (size_t i = 0; i < values.size(); ++i) {
    const auto [knot, part] = ramp_place(values[i]);
    const double b = part / 255.0, a = 1.0 - b;
    const DVec3 color(source.rgb[3 * i], source.rgb[3 * i + 1], source.rgb[3 * i + 2]);
    matrix[knot][knot] += a * a, matrix[knot + 1][knot + 1] += b * b;
    matrix[knot][knot + 1] += a * b, matrix[knot + 1][knot] += a * b;
    right[knot] += a * color, right[knot + 1] += b * color;
  }
  const double weight = 1e-5 * static_cast<double>(values.size()) + 1e-6;
  for (size_t k = 1; k + 1 < n; ++k)
    for (size_t i = 0; i < 3; ++i)
      for (size_t j = 0; j < 3; ++j)
        matrix[k - 1 + i][k - 1 + j] += weight * (i == 1 ? -2.0 : 1.0) * (j == 1 ? -2.0 : 1.0);
  for (size_t k = 0; k < n; ++k) matrix[k][k] += 1e-9; // one texel: the curve is a point
  for (size_t k = 0; k < n; ++k)                       // elimination; the matrix is positive definite
    for (size_t i = k + 1; i < n; ++i) {
      const double factor = matrix[i][k] / matrix[k][k];
      for (size_t j = k; j < n; ++j) matrix[i][j] -= factor * matrix[k][j];
      right[i] -= factor * right[k];
    }
  std::vector<uint32_t> ramp(n);
  for (size_t k = n; k-- > 0;) {
    for (size_t j = k + 1; j < n; ++j) right[k] -= matrix[k][j] * right[j];
    right[k] /= matrix[k][k];
    for (uint32_t c = 0; c < 3; ++c)
      ramp[k] |= static_cast<uint32_t>(std::lrint(std::clamp(right[k][static_cast<glm::length_t>(c)], 0.0, 255.0)))
                 << (8 * c);
  }
  return ramp;
}

/// Gives each texel the byte whose colour is nearest. Returns the sum of squared errors.
uint64_t assign_greys(const AlbedoTexture& source, const std::vector<uint32_t>& ramp, std::vector<uint8_t>& values) {
  std::array<Rgb8, 256> colors;
  for (uint32_t v = 0; v < 256; ++v) colors[v] = ramp_color(ramp, v);
  uint64_t sum = 0;
  for (size_t i = 0; i < values.size(); ++i) {
    uint32_t least = std::numeric_limits<uint32_t>::max();
    for (uint32_t v = 0; v < 256; ++v) {
      uint32_t squared = 0;
      for (size_t c = 0; c < 3; ++c) {
        const int32_t d = int32_t{source.rgb[3 * i + c]} - int32_t{colors[v][c]};
        squared += static_cast<uint32_t>(d * d);
      }
      if (squared < least) least = squared, values[i] = static_cast<uint8_t>(v);
    }
    sum += least;
  }
  return sum;
}

/// Starts from brightness and alternates between the curve and the nearest bytes while the error falls.
void encode_grey(const AlbedoTexture& source, ShaderImage& image) {
  std::vector<double> brightness(source.rgb.size() / 3);
  for (size_t i = 0; i < brightness.size(); ++i)
    brightness[i] = 0.2126 * source.rgb[3 * i] + 0.7152 * source.rgb[3 * i + 1] + 0.0722 * source.rgb[3 * i + 2];
  const auto [low, high] = std::ranges::minmax(brightness);
  std::vector<uint8_t> values(brightness.size());
  for (size_t i = 0; i < values.size() && high > low; ++i)
    values[i] = static_cast<uint8_t>(std::lrint(255.0 * (brightness[i] - low) / (high - low)));
  uint64_t least = std::numeric_limits<uint64_t>::max();
  std::vector<uint8_t> best;
  constexpr int kRounds = 12;
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<uint32_t> ramp = fit_ramp(source, values);
    const uint64_t error = assign_greys(source, ramp, values);
    if (error >= least) break;
    least = error, best = values, image.ramp = ramp;
  }
  for (size_t i = 0; i < best.size(); ++i) set_texel(image, i, best[i]);
}

} // namespace

Rgb8 ShaderImage::texel(uint32_t x, uint32_t y) const {
  const auto number = [&](uint32_t column, uint32_t row) { return size_t{row} * width + column; };
  Rgb8 color;
  if (format == TexelFormat::kGrey) return ramp_color(ramp, stored(*this, number(x, y)));
  if (format == TexelFormat::kR2G4B2) {
    const uint32_t value = stored(*this, number(x, y));
    return {between(keys[0][0], keys[1][0], value >> 6, 3), between(keys[0][1], keys[1][1], value >> 2 & 15u, 15),
            between(keys[0][2], keys[1][2], value & 3u, 3)};
  }
  uint32_t level = 0;
  for (uint32_t j = 0; j < 3; ++j)
    for (uint32_t i = 0; i < 3; ++i) {
      const uint32_t column = std::min(std::max(x + i, 1u) - 1, width - 1),
                     row = std::min(std::max(y + j, 1u) - 1, height - 1);
      level += static_cast<uint32_t>(kBitWeights[i] * kBitWeights[j]) * stored(*this, number(column, row));
    }
  for (size_t c = 0; c < 3; ++c) color[c] = between(keys[0][c], keys[1][c], level, kBitLevels);
  return color;
}

uint64_t shader_image_elements(TexelFormat format, uint32_t width, uint32_t height) {
  return (uint64_t{width} * height * bits_of(format) + 31) / 32 + (format == TexelFormat::kGrey ? kRampKnots : 0);
}

std::array<uint32_t, 2> scaled_size(uint32_t width, uint32_t height, uint32_t longest) {
  const uint32_t most = std::max(width, height);
  const auto scaled = [&](uint32_t side) {
    return std::max(1u, static_cast<uint32_t>((uint64_t{side} * longest * 2 + most) / (uint64_t{most} * 2)));
  };
  return {scaled(width), scaled(height)};
}

uint32_t largest_image_side(TexelFormat format, uint32_t width, uint32_t height, uint64_t max_elements) {
  uint32_t low = 0, high = std::max(width, height) + 1; // low fits, high does not or is larger than the image
  while (high - low > 1) {
    const uint32_t middle = low + (high - low) / 2;
    const auto [w, h] = scaled_size(width, height, middle);
    (shader_image_elements(format, w, h) <= max_elements ? low : high) = middle;
  }
  return low;
}

ShaderImage encode_shader_image(const AlbedoTexture& source, TexelFormat format) {
  ShaderImage image;
  image.format = format, image.width = source.width, image.height = source.height;
  const uint64_t texels = source.rgb.size() / 3;
  image.words.resize((texels * bits_of(format) + 31) / 32);
  if (format == TexelFormat::kGrey) {
    encode_grey(source, image);
  } else if (format == TexelFormat::kBit) {
    const BitImage coded = encode_bits(source);
    image.keys = coded.keys;
    for (size_t i = 0; i < texels; ++i) set_texel(image, i, coded.bits[i]);
  } else {
    const std::vector<uint8_t> coded = encode_r2g4b2(source);
    image.keys = {Rgb8{coded[0], coded[1], coded[2]}, Rgb8{coded[3], coded[4], coded[5]}};
    for (size_t i = 0; i < texels; ++i) set_texel(image, i, coded[kR2G4B2KeyBytes + i]);
  }
  return image;
}

uint64_t encode_memory_bytes(uint32_t width, uint32_t height) { return uint64_t{width} * height * 20 + (1u << 16); }

ImageDifference difference_of(const ShaderImage& image, const AlbedoTexture& source) {
  ImageDifference result;
  uint64_t sum = 0;
  const uint8_t* from = source.rgb.data();
  for (uint32_t y = 0; y < image.height; ++y)
    for (uint32_t x = 0; x < image.width; ++x)
      for (const uint8_t value : image.texel(x, y)) {
        const auto d = static_cast<uint32_t>(std::abs(int32_t{*from++} - int32_t{value}));
        result.max_error = std::max(result.max_error, d);
        sum += uint64_t{d} * d;
      }
  result.psnr_db = 10.0 * std::log10(255.0 * 255.0 * static_cast<double>(source.rgb.size()) / static_cast<double>(sum));
  return result;
}

AlbedoTexture scaled_down(const AlbedoTexture& source, uint32_t longest) {
  const auto [width, height] = scaled_size(source.width, source.height, longest);
  AlbedoTexture result = source;
  result.width = width, result.height = height;
  if (width == source.width && height == source.height) return result;
  result.rgb.clear();
  result.rgb.reserve(size_t{3} * width * height);
  const std::array<float, 256>& linear = linear_of_srgb8();
  // In units of 1 / width of a source texel: texel i of the result covers i * source.width to (i + 1) * source.width.
  const auto covered = [](uint32_t texel, uint64_t from, uint64_t to, uint64_t side) {
    return static_cast<double>(std::min(uint64_t{texel + 1} * side, to) - std::max(uint64_t{texel} * side, from));
  };
  for (uint64_t y = 0; y < height; ++y)
    for (uint64_t x = 0; x < width; ++x) {
      const uint64_t left = x * source.width, right = left + source.width, top = y * source.height,
                     bottom = top + source.height;
      DVec3 sum(0.0);
      for (auto v = static_cast<uint32_t>(top / height); uint64_t{v} * height < bottom; ++v)
        for (auto u = static_cast<uint32_t>(left / width); uint64_t{u} * width < right; ++u) {
          const uint8_t* const c = &source.rgb[3 * (size_t{v} * source.width + u)];
          sum += covered(u, left, right, width) * covered(v, top, bottom, height) *
                 DVec3(linear[c[0]], linear[c[1]], linear[c[2]]);
        }
      sum /= static_cast<double>(source.width) * source.height;
      for (glm::length_t c = 0; c < 3; ++c) result.rgb.push_back(srgb8_of_linear(static_cast<float>(sum[c])));
    }
  return result;
}

} // namespace packtrace
