#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include <glm/glm.hpp>

#include "compress/format/voxels/occupancy_stream.h"

namespace packtrace {

/// The first voxel along a ray.
template <class Real>
struct VoxelHit {
  Real t; ///< where the ray enters the voxel, or its first t if that is inside
  VoxelIndex voxel;
  int axis; ///< of the face that it enters through; -1 if it begins inside
};

/// Traces rays through an occupancy stream, skipping empty cells of all sizes. Rays are in voxel units: voxel (i, j, k)
/// is the cube from (i, j, k) to (i + 1, j + 1, k + 1).
///
/// Planes between voxels are crossed in the order of (t, axis), where t is always (plane - origin) * (1 / direction) as
/// Real computes it. Thus the walk visits the same voxels, whatever it skips, as one that crosses plane after plane of
/// the dense grid, for every ray.
class VoxelTracer {
public:
  /// @param stream must outlive the tracer
  explicit VoxelTracer(const OccupancyStream& stream) : stream_(&stream) {}

  /// @param direction not zero; need not be of unit length
  /// @param t_min, t_max >= 0; voxels whose part of the ray lies outside do not count
  std::optional<VoxelHit<double>> first_hit(glm::dvec3 origin, glm::dvec3 direction, double t_min, double t_max) const;
  /// In floats, as shaders compute it.
  std::optional<VoxelHit<float>> first_hit(glm::vec3 origin, glm::vec3 direction, float t_min, float t_max) const;

  /// Like first_hit(), but ignores occupied voxels before the first empty one. A ray that starts on a surface thus
  /// passes the voxels that contain this surface.
  std::optional<VoxelHit<double>> first_hit_from_empty(glm::dvec3 origin, glm::dvec3 direction, double t_min,
                                                       double t_max) const;

  bool occluded(glm::dvec3 origin, glm::dvec3 direction, double t_min, double t_max) const;

  const OccupancyStream& stream() const { return *stream_; }

private:
  const OccupancyStream* stream_;
};

} // namespace packtrace
