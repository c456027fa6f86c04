#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "compress/format/deformation/deformation_view.h"
#include "compress/format/deformation/frame_codec.h"
#include "compress/format/file/baked_file.h"

namespace packtrace {

/// Decodes the frames of one deforming geometry. Keeps the two frames around the current time, 24 bytes per vertex.
/// Moving to the next frame decodes one frame; any other frame is decoded from the begin of its group.
class DeformationPlayer final : public FrameVertices {
public:
  /// Starts at frame 0.
  /// @param file must outlive the player
  /// @param animation number in deformation_records()
  DeformationPlayer(const BakedFile& file, uint32_t animation);

  const baked::DeformationRecord& record() const { return view_.record(); }

  /// Moves to a frame; between two frames vertices move on straight lines, rounded to the lattice. Runs on all threads.
  /// @param frame 0 .. frame_count-1; a fraction lies between two frames. Others are clamped.
  void seek(double frame);

  /// Frame at a time in seconds, to be passed to seek().
  /// @param repeat true: after the last frame comes frame 0; false: the last frame stays
  double frame_at(double seconds, bool repeat) const;

  void read(uint32_t cluster, std::span<FramePoint> out) const override;

  /// The vertices of a frame in one cluster, decoded from the begin of its group; changes nothing.
  void decode(uint32_t frame, uint32_t cluster, std::span<FrameVertex> out) const;

  uint64_t bytes() const;

private:
  std::span<FrameVertex> vertices(uint32_t frame, uint32_t cluster);
  void advance(uint32_t cluster, uint32_t first, uint32_t last);
  void read_stored(uint32_t cluster, std::span<FrameVertex> out) const;

  const BakedFile& file_;
  const DeformationView view_;
  std::vector<uint32_t> begins_;                     ///< by cluster: first vertex
  std::array<std::vector<FrameVertex>, 2> vertices_; ///< frame i is in vertices_[i % 2]
  std::vector<uint64_t> next_bits_;                  ///< by cluster: where newest_ + 1 begins, in the block of newest_
  uint32_t newest_ = 0;                              ///< newest_ - 1 is decoded too, unless it is 0
  uint32_t frame_ = 0;                               ///< the current frame
  double fraction_ = 0.0;                            ///< of the way to the next one
};

} // namespace packtrace
