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

  /// Result of set_time().
  struct Update {
    bool moved = false;         ///< the time changed some vertices of used geometries
    uint32_t rebuilt_trees = 0; ///< instead of refitted
    uint64_t triangles = 0;     ///< of the geometries that were updated
    double decode_s = 0.0, refit_s = 0.0;
  };

  /// Moves geometries to a time. PackedTracer::previous_vertices() then gives the vertices at the time of the call
  /// before, also of geometries that were not used then. Geometries that are up to date are skipped.
  /// @param repeat whether animations begin again after their last frame
  /// @param used by geometry: others may stay as they are until they are used again; empty: all are used
  /// Throws as PackedTracer::deform() does: Error(kInput) if a damaged file has vertices outside its box.
  Update set_time(double seconds, bool repeat, PackedTracer& tracer, std::span<const uint8_t> used = {});

  uint64_t bytes() const;

private:
  /// Frames of a geometry: whole ones and between them.
  struct Frames {
    double now = 0.0, before = 0.0;
    bool operator==(const Frames&) const = default;
  };

  std::vector<double> frames_at(double seconds, bool repeat) const;
  void deform(std::span<const size_t> players, std::span<const double> frames, PackedTracer& tracer, Update& update);

  std::vector<DeformingGeometry> geometries_;
  std::vector<std::unique_ptr<DeformationPlayer>> players_;
  std::vector<uint32_t> triangles_; ///< by player
  std::vector<Frames> shown_;       ///< by player: those of its geometry
  std::vector<double> last_;        ///< by player: the frame at the time of the last set_time()
  double duration_ = 0.0;
};

} // namespace packtrace
