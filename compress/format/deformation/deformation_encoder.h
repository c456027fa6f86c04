#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "compress/format/deformation/deformation_format.h"
#include "compress/format/deformation/frame_codec.h"

namespace packtrace {

/// An animation, encoded.
struct EncodedDeformation {
  baked::DeformationRecord record{}; ///< offsets are set by write_deformations()
  std::vector<uint64_t> group_begins;
  std::vector<uint32_t> offsets; ///< by group and cluster
  std::vector<uint8_t> data;
};

/// Encodes the frames of a geometry one after another. Keeps the two last frames and the blocks of the current group.
class DeformationEncoder {
public:
  /// @param record geometry, group_frames, lo, extent, frames_per_second and first_number are set
  /// @param clusters number of vertices of each cluster
  /// @param stored the file's vertices, cluster by cluster
  DeformationEncoder(const baked::DeformationRecord& record, std::span<const uint32_t> clusters,
                     std::vector<FrameVertex> stored);

  /// Adds the next frame. Runs on all threads; the bytes do not depend on their number.
  /// @param vertices in the order of `stored`, in steps from record.lo; within record.extent
  /// Throws Error(kLimitExceeded) after kMaxFrames frames, or if the blocks of a group exceed 4 GiB.
  void add(std::span<const FrameVertex> vertices);

  /// Returns the animation; the encoder is empty afterwards. Needs at least two frames.
  EncodedDeformation finish();

private:
  void end_group();

  EncodedDeformation out_;
  std::vector<uint32_t> begins_; ///< by cluster and one more: first vertex
  std::vector<FrameVertex> stored_, previous_, older_;
  std::vector<BitWriter> blocks_; ///< of the current group
  uint32_t in_group_ = 0;         ///< frames of the current group so far
};

/// Returns the bytes of the deformation section. Animations ascend by geometry; empty without animations and chains.
std::vector<uint8_t> write_deformations(std::span<const EncodedDeformation> animations,
                                        std::span<const baked::LevelChainRecord> chains = {});

} // namespace packtrace
