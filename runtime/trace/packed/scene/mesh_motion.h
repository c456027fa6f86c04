#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "compress/format/deformation/deformation_player.h"
#include "runtime/trace/packed/scene/packed_tracer.h"

namespace packtrace {

/// The deforming geometries of a file and their current frames. Use: construct it, pass geometries() to PackedTracer's
/// constructor, then call set_time() once before each picture.
class MeshMotion {
public:
  /// Starts at time 0.
  /// @param file must outlive the motion
  explicit MeshMotion(const BakedFile& file);

  bool empty() const { return players_.empty(); }
  std::span<const DeformingGeometry> geometries() const { return geometries_; }
  /// Seconds from frame 0 to the last frame of the longest animation; 0 if nothing deforms.
  double duration() const { return duration_; }

  /// What set_time() did.
  struct Update {
    bool moved = false;         ///< some vertices changed
    uint32_t rebuilt_trees = 0; ///< instead of refitted
    uint64_t triangles = 0;     ///< of the geometries that were updated
    double decode_s = 0.0, refit_s = 0.0;
  };

  /// Moves all geometries to a time. PackedTracer::previous_vertices() then gives the vertices of the call before; a
  /// second call with the same time makes them equal to the current ones. Nothing is done if they are already.
  /// @param repeat whether animations begin again after their last frame
  /// Throws as PackedTracer::deform() does: Error(kInput) if a damaged file has vertices outside its box.
  Update set_time(double seconds, bool repeat, PackedTracer& tracer);

  uint64_t bytes() const;

private:
  std::vector<DeformingGeometry> geometries_;
  std::vector<std::unique_ptr<DeformationPlayer>> players_;
  std::vector<uint32_t> triangles_; ///< by player
  std::vector<double> frames_;      ///< by player: its current frame
  bool still_ = true;               ///< current and previous vertices are equal
  double duration_ = 0.0;
};

} // namespace packtrace
