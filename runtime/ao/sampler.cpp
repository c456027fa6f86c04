#include "runtime/ao/sampler.h"

#include <array>
#include <cmath>

#include "runtime/camera/tiles.h"

namespace packtrace {
namespace {

constexpr uint32_t kNumberBits = 16; // log2 of the sequence length; later samples repeat it with another scramble
constexpr uint32_t kBlockLog2 = 3;   // 8 x 8 pixels share a net
constexpr uint32_t kBlockBits = 2 * kBlockLog2;

/// One column of the generator matrices of x and y. Bit r is digit r after the point.
struct Column {
  uint32_t x, y;
};

/// The first two Sobol dimensions: the identity, and Pascal's triangle modulo 2, whose entry (r, i) is 1 if
/// r & ~i is 0.
constexpr std::array<Column, kNumberBits> number_columns() {
  std::array<Column, kNumberBits> columns{};
  for (uint32_t i = 0; i < kNumberBits; ++i) {
    columns[i].x = 1u << i;
    for (uint32_t r = 0; r <= i; ++r) columns[i].y |= (r & ~i) == 0 ? 1u << r : 0u;
  }
  return columns;
}
constexpr std::array<Column, kNumberBits> kNumberColumns = number_columns();

/// Generator columns for the Morton code of a pixel within its block. They were found by a search such that, together
/// with kNumberColumns, these point sets are (0, m, 2)-nets: 2^a pixels aligned in Morton order at one sample number,
/// a <= 6; and 2 x 2 pixels over 4 aligned sample numbers, 4 x 4 over 16, 8 x 8 over 64. A test checks all of them.
constexpr std::array<Column, kBlockBits> kPixelColumns = {
    {{0xb7ff, 0x854f}, {0x7e66, 0xef59}, {0x9c2d, 0x9ef5}, {0xad83, 0xf7c1}, {0xe44f, 0xbc30}, {0xc8fd, 0x1e43}}};

/// Bijective hash. Source: Wellons, "Prospecting for hash functions" (2018), lowbias32.
constexpr uint32_t hash32(uint32_t x) {
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  return x ^ (x >> 16);
}

constexpr uint32_t combine(uint32_t seed, uint32_t value) { return hash32(seed + 0x9e3779b9u + hash32(value)); }

/// Owen's nested uniform scrambling by hashing: whether bit i flips depends only on the lower bits, which are the
/// preceding digits. Source: Laine, Karras, "Stratified sampling for stochastic transparency" (2011); constants by
/// Vegdahl, "Building a better LK hash" (2021).
inline uint32_t scramble(uint32_t digits, uint32_t seed) {
  digits ^= digits * 0x3d20adeau;
  digits += seed;
  digits *= (seed >> 16) | 1u;
  digits ^= digits * 0x05526c56u;
  digits ^= digits * 0x53a22864u;
  return digits;
}

inline uint32_t reverse_bits(uint32_t v) {
  v = ((v & 0x55555555u) << 1) | ((v >> 1) & 0x55555555u);
  v = ((v & 0x33333333u) << 2) | ((v >> 2) & 0x33333333u);
  v = ((v & 0x0f0f0f0fu) << 4) | ((v >> 4) & 0x0f0f0f0fu);
  v = ((v & 0x00ff00ffu) << 8) | ((v >> 8) & 0x00ff00ffu);
  return (v << 16) | (v >> 16);
}

inline float unit_float(uint32_t bits) { return static_cast<float>(bits >> 8) * 0x1p-24f; }

} // namespace

PixelSampler::PixelSampler(SamplerKind kind, uint64_t seed)
    : kind_(kind), seed_(combine(static_cast<uint32_t>(seed), static_cast<uint32_t>(seed >> 32))) {}

PixelSampler::Pixel PixelSampler::pixel(uint32_t x_px, uint32_t y_px) const {
  const bool shared = kind_ == SamplerKind::kSpaceTimeNet;
  const uint32_t shift = shared ? kBlockLog2 : 0;
  const uint32_t seed = combine(combine(seed_, x_px >> shift), y_px >> shift);
  Pixel pixel{0, 0, combine(seed, 1), combine(seed, 2)};
  if (!shared) return pixel;
  constexpr uint32_t kMask = (1u << kBlockLog2) - 1;
  const uint32_t code = morton_code(x_px & kMask, y_px & kMask) ^ (combine(seed, 3) >> (32 - kBlockBits));
  for (uint32_t i = 0; i < kBlockBits; ++i) {
    if (!((code >> i) & 1u)) continue;
    pixel.x ^= kPixelColumns[i].x;
    pixel.y ^= kPixelColumns[i].y;
  }
  return pixel;
}

PixelSampler::Number PixelSampler::number(uint64_t sample) const {
  if (kind_ == SamplerKind::kIndependent)
    return {0, 0, combine(static_cast<uint32_t>(sample), static_cast<uint32_t>(sample >> 32))};
  const auto epoch = static_cast<uint32_t>(sample >> kNumberBits);
  Number number{0, 0, epoch == 0 ? 0 : hash32(epoch)};
  for (uint32_t i = 0; i < kNumberBits; ++i) {
    if (!((sample >> i) & 1u)) continue;
    number.x ^= kNumberColumns[i].x;
    number.y ^= kNumberColumns[i].y;
  }
  return number;
}

Vec2 PixelSampler::point(const Pixel& pixel, const Number& number) {
  const uint32_t seed_x = hash32(pixel.seed_x ^ number.seed), seed_y = hash32(pixel.seed_y ^ number.seed);
  return {unit_float(reverse_bits(scramble(pixel.x ^ number.x, seed_x))),
          unit_float(reverse_bits(scramble(pixel.y ^ number.y, seed_y)))};
}

Vec3 cosine_direction(Vec2 point) {
  constexpr float kQuarterPi = 0.785398163f;
  const float a = 2.0f * point.x - 1.0f, b = 2.0f * point.y - 1.0f;
  const bool wide = std::abs(a) > std::abs(b);
  const float radius = wide ? a : b;
  const float angle = radius != 0.0f ? kQuarterPi * (wide ? b : a) / radius : 0.0f; // in [-pi/4, pi/4]
  // Taylor polynomials: the error is below 4e-7 on this range, and the bits do not depend on the C library.
  const float s = angle * angle;
  const float sine = angle * (1.0f + s * (-1.0f / 6 + s * (1.0f / 120 + s * (-1.0f / 5040))));
  const float cosine = 1.0f + s * (-0.5f + s * (1.0f / 24 + s * (-1.0f / 720 + s * (1.0f / 40320))));
  const float z = std::sqrt(std::max(0.0f, 1.0f - radius * radius));
  return {radius * (wide ? cosine : sine), radius * (wide ? sine : cosine), z};
}

} // namespace packtrace
