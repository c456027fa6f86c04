#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "compress/format/voxels/field_format.h"
#include "compress/format/voxels/voxel_set.h"

namespace packtrace {

/// Distances to a surface in a narrow band around it, in bricks: field_format.h describes the words.
class DistanceField {
public:
  DistanceField() = default;
  /// The words must match the header; find_field_fault() checks those of unknown origin.
  DistanceField(const voxels::FieldHeader& header, std::vector<uint32_t> words);

  const voxels::FieldHeader& header() const { return header_; }
  std::span<const uint32_t> words() const { return words_; }
  const VoxelIndex& size() const { return header_.size; }
  uint64_t bits() const { return words_.size() * uint64_t{32}; }
  /// Largest error of a stored distance within the band, in voxels.
  double quantum() const { return 0.5 * double{voxels::kFieldBand} / half_; }

  /// Distance at a point between the samples, interpolated within the band; elsewhere a lower bound of the distance,
  /// with the sign of the side. In voxels, as the point is. Points outside the samples count as if at their border.
  float distance(glm::vec3 p) const;
  /// A sample of the band; nothing if its brick is not stored.
  std::optional<float> sample(VoxelIndex v) const;

private:
  uint32_t brick_word(uint32_t x, uint32_t y, uint32_t z) const {
    return words_[(size_t{z} * header_.bricks[1] + y) * header_.bricks[0] + x];
  }
  float value(size_t brick, uint32_t x, uint32_t y, uint32_t z) const;

  voxels::FieldHeader header_{};
  std::vector<uint32_t> words_;
  float half_ = 127.0f;
  size_t samples_ = 0; // first word
};

/// Encodes distances.
/// @param distances of all samples, x fastest, in voxels; exact where they are within the band
/// @param bits 8 or 16
DistanceField encode_field(VoxelIndex size, std::span<const float> distances, uint32_t bits);

/// Returns why header or words are damaged; nullopt if DistanceField may read them.
std::optional<std::string_view> find_field_fault(const voxels::FieldHeader& header, std::span<const uint32_t> words);

} // namespace packtrace
