#include "runtime/ao/sampler.h"

#include <array>

#include "runtime/ao/hash.h"
#include "runtime/ao/multi_jitter.h"
#include "runtime/camera/tiles.h"
#include "runtime/simd.h"

namespace packtrace {
namespace {

constexpr uint32_t kNumberBits = 16; // log2 of the sequence length; later samples repeat it with another scramble
constexpr uint32_t kBlockLog2 = 3;   // 8 x 8 pixels share a net
constexpr uint32_t kBlockBits = 2 * kBlockLog2;

/// One column of the generator matrices of x and y. Bit r is digit r after the point.
struct Column {
  uint32_t x, y;
};

/// Generator columns for the Morton code of a pixel within its block. They were found by a search such that, together
/// with the columns of sample numbers, these point sets are (0, m, 2)-nets: 2^a pixels aligned in Morton order at one
/// sample number, a <= 6; and 2 x 2 pixels over 4 aligned sample numbers, 4 x 4 over 16, 8 x 8 over 64. A test checks
/// all of them.
constexpr std::array<Column, kBlockBits> kPixelColumns = {
    {{0xb7ff, 0x854f}, {0x7e66, 0xef59}, {0x9c2d, 0x9ef5}, {0xad83, 0xf7c1}, {0xe44f, 0xbc30}, {0xc8fd, 0x1e43}}};

/// Steps of the lattice from pixel to pixel and from sample to sample, in 2^-32. Pixels: found by a search for the
/// smallest error of edges and squares in the unit square after box filters of 3 x 3 to 7 x 7 pixels and up to 8
/// samples. Samples: the R2 sequence.
/// Source: Roberts, "The unreasonable effectiveness of quasirandom sequences" (2018).
constexpr uint32_t kLatticeX[2] = {0x9a8d353du, 0x68baef85u}, kLatticeY[2] = {0xe98e138bu, 0x51c99870u};
constexpr uint32_t kLatticeSample[2] = {0xc13fa9a9u, 0x91e10da5u};

/// Digits of a sample number in the second Sobol dimension. The generator matrix is Pascal's triangle modulo 2, whose
/// entry (r, i) is 1 if r & ~i is 0; the first dimension's is the identity.
inline uint32_t sobol_y(uint32_t number) {
  number ^= (number >> 1) & 0x5555u;
  number ^= (number >> 2) & 0x3333u;
  number ^= (number >> 4) & 0x0f0fu;
  return number ^ ((number >> 8) & 0x00ffu);
}

inline float scrambled(uint32_t digits, uint32_t seed, uint32_t epoch_seed) {
  return unit_float(reverse_bits(scramble(digits, hash32(seed ^ epoch_seed))));
}

/// Seed that changes every 2^16 samples; 0 at first.
inline uint32_t epoch_seed(uint32_t sample) {
  return (sample >> kNumberBits) != 0u ? hash32(sample >> kNumberBits) : 0u;
}

inline Vec2 net_point(uint32_t x, uint32_t y, uint32_t seed_x, uint32_t seed_y, uint32_t sample) {
  const uint32_t number = sample & ((1u << kNumberBits) - 1), epoch = epoch_seed(sample);
  return {scrambled(x ^ number, seed_x, epoch), scrambled(y ^ sobol_y(number), seed_y, epoch)};
}

inline Vec2 independent_point(uint32_t seed_x, uint32_t seed_y, uint32_t sample) {
  const uint32_t seed = hash_combine(sample, 0);
  return {scrambled(0, seed_x, seed), scrambled(0, seed_y, seed)};
}

inline Vec2 lattice_point(uint32_t x, uint32_t y, uint32_t sample) {
  return {unit_float(x + sample * kLatticeSample[0]), unit_float(y + sample * kLatticeSample[1])};
}

/// A permutation of 0..63 for each seed.
uint32_t permuted(uint32_t index, uint32_t seed) {
  static_assert(kSetPoints == 64);
  for (uint32_t round = 0; round < 4; ++round) { // each step is a bijection modulo 64
    index ^= seed;
    index *= seed >> 6 | 1u;
    index = index % kSetPoints ^ index % kSetPoints >> 3;
    seed = hash32(seed);
  }
  return index;
}

/// Neighbouring pixels and samples take unrelated cells of a set. In the order of the cells, the points of a window of
/// pixels that takes a part of a block would lie in one part of the square.
/// @param number of the pixel in its block of `block` pixels
Vec2 multi_jitter_point(uint32_t number, uint32_t block, uint32_t seed, uint32_t sample) {
  const uint32_t per_set = kSetPoints / block; // samples for which a set lasts
  const uint32_t hash = hash_combine(seed, sample / per_set);
  const uint32_t index = permuted(sample % per_set * block + number, hash_combine(hash, 1));
  return multi_jitter_sets()[hash % kSetCount][index];
}

PACKTRACE_AVX2_CLONES
void fill_net_pixels(uint32_t base, bool shared, const uint32_t* x_px, const uint32_t* y_px, size_t count, uint32_t* x,
                     uint32_t* y, uint32_t* seed_x, uint32_t* seed_y) {
  const uint32_t shift = shared ? kBlockLog2 : 0, used = shared ? ~0u : 0u;
#pragma GCC ivdep
  for (size_t i = 0; i < count; ++i) {
    constexpr uint32_t kMask = (1u << kBlockLog2) - 1;
    const uint32_t seed = hash_combine(hash_combine(base, x_px[i] >> shift), y_px[i] >> shift);
    seed_x[i] = hash_combine(seed, 1), seed_y[i] = hash_combine(seed, 2);
    const uint32_t code = morton_code(x_px[i] & kMask, y_px[i] & kMask) ^ (hash_combine(seed, 3) >> (32 - kBlockBits));
    uint32_t digits_x = 0, digits_y = 0;
    for (uint32_t bit = 0; bit < kBlockBits; ++bit) {
      const uint32_t mask = 0u - ((code >> bit) & 1u);
      digits_x ^= kPixelColumns[bit].x & mask, digits_y ^= kPixelColumns[bit].y & mask;
    }
    x[i] = digits_x & used, y[i] = digits_y & used;
  }
}

struct PointArrays {
  const uint32_t *x, *y, *seed_x, *seed_y, *samples;
  float *out_x, *out_y;
};

PACKTRACE_AVX2_CLONES
void write_net_points(size_t count, const PointArrays& arrays) {
  const PointArrays a = arrays;
#pragma GCC ivdep
  for (size_t i = 0; i < count; ++i) {
    const Vec2 p = net_point(a.x[i], a.y[i], a.seed_x[i], a.seed_y[i], a.samples[i]);
    a.out_x[i] = p.x, a.out_y[i] = p.y;
  }
}

} // namespace

PixelSampler::PixelSampler(SamplerKind kind, uint64_t seed, uint32_t block_side)
    : kind_(kind), seed_(hash_combine(static_cast<uint32_t>(seed), static_cast<uint32_t>(seed >> 32))),
      block_side_(block_side) {}

PixelSampler::Pixel PixelSampler::pixel(uint32_t x_px, uint32_t y_px) const {
  Pixel pixel;
  switch (kind_) {
  case SamplerKind::kSpaceTimeNet:
  case SamplerKind::kPixelSobol:
  case SamplerKind::kIndependent:
    fill_net_pixels(seed_, kind_ == SamplerKind::kSpaceTimeNet, &x_px, &y_px, 1, &pixel.x, &pixel.y, &pixel.seed_x,
                    &pixel.seed_y);
    break;
  case SamplerKind::kMultiJitter:
    pixel.x = y_px % block_side_ * block_side_ + x_px % block_side_;
    pixel.seed_x = hash_combine(hash_combine(seed_, x_px / block_side_), y_px / block_side_);
    break;
  case SamplerKind::kLattice:
    pixel.x = hash_combine(seed_, 1) + x_px * kLatticeX[0] + y_px * kLatticeY[0];
    pixel.y = hash_combine(seed_, 2) + x_px * kLatticeX[1] + y_px * kLatticeY[1];
    break;
  }
  return pixel;
}

Vec2 PixelSampler::point(const Pixel& p, uint32_t sample) const {
  switch (kind_) {
  case SamplerKind::kSpaceTimeNet:
  case SamplerKind::kPixelSobol:
    return net_point(p.x, p.y, p.seed_x, p.seed_y, sample);
  case SamplerKind::kMultiJitter:
    return multi_jitter_point(p.x, block_side_ * block_side_, p.seed_x, sample);
  case SamplerKind::kLattice:
    return lattice_point(p.x, p.y, sample);
  case SamplerKind::kIndependent:
    break;
  }
  return independent_point(p.seed_x, p.seed_y, sample);
}

void PixelSampler::pixels(const uint32_t* x_px, const uint32_t* y_px, size_t count, Pixels& out) const {
  if (kind_ == SamplerKind::kSpaceTimeNet) // the usual one, at once
    return fill_net_pixels(seed_, true, x_px, y_px, count, out.x.data(), out.y.data(), out.seed_x.data(),
                           out.seed_y.data());
  for (size_t i = 0; i < count; ++i) {
    const Pixel p = pixel(x_px[i], y_px[i]);
    out.x[i] = p.x, out.y[i] = p.y, out.seed_x[i] = p.seed_x, out.seed_y[i] = p.seed_y;
  }
}

void PixelSampler::points(const Pixels& pixels, const uint32_t* samples, size_t count, float* x, float* y) const {
  if (kind_ == SamplerKind::kSpaceTimeNet || kind_ == SamplerKind::kPixelSobol)
    return write_net_points(
        count, {pixels.x.data(), pixels.y.data(), pixels.seed_x.data(), pixels.seed_y.data(), samples, x, y});
  for (size_t i = 0; i < count; ++i) {
    const Vec2 p = point({pixels.x[i], pixels.y[i], pixels.seed_x[i], pixels.seed_y[i]}, samples[i]);
    x[i] = p.x, y[i] = p.y;
  }
}

} // namespace packtrace
