#include "compress/format/voxels/distance_field.h"

#include <algorithm>
#include <cmath>

namespace packtrace {
namespace {

using voxels::kBrickCells;
using voxels::kBrickSamples;
using voxels::kBrickSide;
using voxels::kFieldBand;

std::array<uint32_t, 3> bricks_for(const VoxelIndex& size) {
  std::array<uint32_t, 3> bricks{};
  for (size_t a = 0; a < 3; ++a) bricks[a] = (size[a] - 2) / kBrickCells + 1;
  return bricks;
}

/// How many bricks away, along the axis of the largest difference, the nearest stored brick is; by brick.
std::vector<uint32_t> brick_distances(const std::array<uint32_t, 3>& bricks, const std::vector<uint8_t>& stored) {
  std::vector<uint32_t> result(stored.size(), 1u << 16);
  std::vector<size_t> front, next;
  for (size_t i = 0; i < stored.size(); ++i)
    if (stored[i] != 0) result[i] = 0, front.push_back(i);
  for (uint32_t distance = 1; !front.empty() && distance < (1u << 16); ++distance, front.swap(next)) {
    next.clear();
    for (const size_t i : front) {
      const auto x = static_cast<int64_t>(i % bricks[0]), y = static_cast<int64_t>(i / bricks[0] % bricks[1]),
                 z = static_cast<int64_t>(i / bricks[0] / bricks[1]);
      for (int64_t c = std::max<int64_t>(z - 1, 0); c <= std::min<int64_t>(z + 1, bricks[2] - 1); ++c)
        for (int64_t b = std::max<int64_t>(y - 1, 0); b <= std::min<int64_t>(y + 1, bricks[1] - 1); ++b)
          for (int64_t a = std::max<int64_t>(x - 1, 0); a <= std::min<int64_t>(x + 1, bricks[0] - 1); ++a) {
            const auto at = static_cast<size_t>((c * bricks[1] + b) * bricks[0] + a);
            if (result[at] <= distance) continue;
            result[at] = distance;
            next.push_back(at);
          }
    }
  }
  return result;
}

} // namespace

DistanceField::DistanceField(const voxels::FieldHeader& header, std::vector<uint32_t> words)
    : header_(header), words_(std::move(words)), half_(header.sample_bits == 8 ? 127.0f : 32767.0f),
      samples_(size_t{header.bricks[0]} * header.bricks[1] * header.bricks[2]) {}

float DistanceField::value(size_t brick, uint32_t x, uint32_t y, uint32_t z) const {
  const size_t number = brick * kBrickSamples + (size_t{z} * kBrickSide + y) * kBrickSide + x;
  const uint32_t per_word = 32 / header_.sample_bits;
  const uint32_t code = words_[samples_ + number / per_word] >> (header_.sample_bits * (number % per_word)) &
                        ((1u << header_.sample_bits) - 1);
  return (static_cast<float>(code) / half_ - 1.0f) * float{kFieldBand};
}

float DistanceField::distance(glm::vec3 p) const {
  std::array<uint32_t, 3> cell{}, brick{};
  glm::vec3 f;
  for (int a = 0; a < 3; ++a) {
    const auto i = static_cast<size_t>(a);
    const float last = static_cast<float>(header_.size[i] - 1);
    const float at = p[a] > 0.0f ? std::min(p[a], last) : 0.0f;
    cell[i] = std::min(static_cast<uint32_t>(at), header_.size[i] - 2);
    f[a] = at - static_cast<float>(cell[i]);
    brick[i] = cell[i] / kBrickCells, cell[i] %= kBrickCells;
  }
  const uint32_t word = brick_word(brick[0], brick[1], brick[2]);
  if ((word & voxels::kStoredBrick) == 0) {
    const uint32_t away = word & 0x3fffffffu;
    // Points between samples are nearer than these by up to half a diagonal.
    const float least = std::max(float{kFieldBand} - 1.0f, static_cast<float>((away - 1) * kBrickCells));
    return (word & voxels::kInsideBrick) != 0 ? -least : least;
  }
  const size_t number = word & ~voxels::kStoredBrick;
  const auto [x, y, z] = cell;
  const auto row = [&](uint32_t j, uint32_t k) {
    return glm::mix(value(number, x, j, k), value(number, x + 1, j, k), f.x);
  };
  return glm::mix(glm::mix(row(y, z), row(y + 1, z), f.y), glm::mix(row(y, z + 1), row(y + 1, z + 1), f.y), f.z);
}

std::optional<float> DistanceField::sample(VoxelIndex v) const {
  std::array<uint32_t, 3> brick{}, in{};
  for (size_t a = 0; a < 3; ++a) {
    brick[a] = std::min(v[a] / kBrickCells, header_.bricks[a] - 1);
    in[a] = v[a] - brick[a] * kBrickCells;
  }
  const uint32_t word = brick_word(brick[0], brick[1], brick[2]);
  if ((word & voxels::kStoredBrick) == 0) return std::nullopt;
  return value(word & ~voxels::kStoredBrick, in[0], in[1], in[2]);
}

DistanceField encode_field(VoxelIndex size, std::span<const float> distances, uint32_t bits) {
  voxels::FieldHeader header{};
  header.size = size, header.bricks = bricks_for(size), header.sample_bits = bits;
  const auto [bx, by, bz] = header.bricks;
  const size_t brick_count = size_t{bx} * by * bz;
  const auto at = [&](uint32_t x, uint32_t y, uint32_t z) {
    return distances[(size_t{std::min(z, size[2] - 1)} * size[1] + std::min(y, size[1] - 1)) * size[0] +
                     std::min(x, size[0] - 1)];
  };
  const auto for_samples = [&](size_t brick, const auto& visit) {
    const auto x = static_cast<uint32_t>(brick % bx), y = static_cast<uint32_t>(brick / bx % by),
               z = static_cast<uint32_t>(brick / bx / by);
    for (uint32_t k = 0; k < kBrickSide; ++k)
      for (uint32_t j = 0; j < kBrickSide; ++j)
        for (uint32_t i = 0; i < kBrickSide; ++i)
          visit(at(x * kBrickCells + i, y * kBrickCells + j, z * kBrickCells + k));
  };
  std::vector<uint8_t> stored(brick_count);
  for (size_t b = 0; b < brick_count; ++b)
    for_samples(b, [&](float d) { stored[b] |= std::abs(d) < float{kFieldBand}; });
  const std::vector<uint32_t> away = brick_distances(header.bricks, stored);
  std::vector<uint32_t> words(brick_count);
  const float half = bits == 8 ? 127.0f : 32767.0f;
  uint64_t number = 0;
  for (size_t b = 0; b < brick_count; ++b) {
    if (stored[b] == 0) {
      float any = 0.0f;
      for_samples(b, [&](float d) { any = d; });
      words[b] = away[b] | (any < 0.0f ? voxels::kInsideBrick : 0);
      continue;
    }
    words[b] = voxels::kStoredBrick | header.stored_bricks++;
    for_samples(b, [&](float d) {
      const float scaled = std::clamp(d / float{kFieldBand}, -1.0f, 1.0f);
      const auto code = static_cast<uint32_t>(std::lround((scaled + 1.0f) * half));
      const uint32_t per_word = 32 / bits;
      if (number % per_word == 0) words.push_back(0);
      words.back() |= code << (bits * (number++ % per_word));
    });
  }
  header.word_count = words.size();
  return DistanceField(header, std::move(words));
}

std::optional<std::string_view> find_field_fault(const voxels::FieldHeader& header, std::span<const uint32_t> words) {
  for (const uint32_t n : header.size)
    if (n < 2 || n > kMaxGridSize + 2 * voxels::kFieldMargin) return "size of the field";
  if (header.bricks != bricks_for(header.size)) return "bricks";
  if (header.sample_bits != 8 && header.sample_bits != 16) return "bits of samples";
  if (header.word_count != words.size()) return "number of words";
  const uint64_t bricks = uint64_t{header.bricks[0]} * header.bricks[1] * header.bricks[2];
  const uint64_t samples = uint64_t{header.stored_bricks} * kBrickSamples, per_word = 32 / header.sample_bits;
  if (words.size() != bricks + (samples + per_word - 1) / per_word) return "size of the samples";
  uint32_t stored = 0;
  for (const uint32_t word : words.first(static_cast<size_t>(bricks))) {
    if ((word & voxels::kStoredBrick) != 0 ? word != (voxels::kStoredBrick | stored++)
                                           : (word & 0x3fffffffu) < 1 || (word & 0x3fffffffu) > 1u << 16)
      return "brick";
  }
  if (stored != header.stored_bricks) return "number of stored bricks";
  if (samples % per_word != 0 && words.back() >> (header.sample_bits * (samples % per_word)) != 0)
    return "bits behind the samples";
  return std::nullopt;
}

} // namespace packtrace
