#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "compress/format/file/baked_file.h"
#include "compress/format/voxels/proxy_codec.h"
#include "runtime/voxels/thing_tree.h"

namespace packtrace {

/// Where a ray meets the voxels of an instance.
struct SceneVoxelHit {
  double t = 0.0;
  uint32_t instance = 0;
  VoxelIndex voxel{};
  DVec3 normal{0.0};    ///< unit, world space, of the face that the ray enters through, towards the ray's origin
  uint32_t placed = 0;  ///< number among the scene's instances
  double edge = 0.0;    ///< length of a voxel along the normal, world units
  DVec3 clearance{0.0}; ///< offset of the origins of rays that leave the surface, world space
  Vec3 albedo{0.8f};    ///< linear; of the voxel's swatch if it has one
};

/// Ambient occlusion of a distance field without rays, see FieldTracer.
struct FieldVisibility {
  float taps, cones;
};

/// Whether an instance's transform flattens it (see flattens()), or shrinks it to less than 2^-24 of the scene. Such
/// instances have no proxies.
/// @param object, world bounds of the geometry and of the scene
bool flattens(const DAffine& world_from_object, const Bounds& object, const Bounds& world);

/// The instances of a file as voxels or distance fields, in the coordinates of the file (relative to
/// BakedFile::origin()).
class VoxelScene {
public:
  /// @param wanted whether an instance takes part; called for those that have a proxy
  explicit VoxelScene(const BakedFile& file, const std::function<bool(uint32_t)>& wanted = {});
  VoxelScene(const VoxelScene&) = delete;
  VoxelScene& operator=(const VoxelScene&) = delete;

  /// The first voxel in [t_min, t_max).
  std::optional<SceneVoxelHit> first_hit(DVec3 origin, DVec3 direction, double t_min, double t_max) const;
  bool occluded(DVec3 origin, DVec3 direction, double t_min, double t_max) const;

  /// Whether a ray that leaves the surface at a hit meets anything before t_max. For the instance of the hit it starts
  /// at point + hit.clearance. For other instances the way from the point is shortened to their own clearance, because
  /// the clearance of coarse voxels may end within a finer instance.
  /// @param point of the hit
  bool occluded_from(const SceneVoxelHit& hit, DVec3 point, DVec3 direction, double t_max) const;

  /// Like first_hit(), for rays that start on the surfaces of the source triangles. If the origin lies in the grid of
  /// an instance, the ray ignores the instance's voxels up to one voxel diagonal from the origin, and from there up to
  /// the first empty voxel. Returns the ray parameter of the hit, or t_max if there is none.
  double first_distance(DVec3 origin, DVec3 direction, double t_min, double t_max) const;

  /// Visibility of a hit of a distance field by taps along its normal and by cones; none for voxels.
  /// @param point of the hit plus its clearance, in the file's coordinates
  /// @param radius world units
  std::optional<FieldVisibility> field_visibility(const SceneVoxelHit& hit, DVec3 point, double radius) const;

  size_t instance_count() const { return placed_.size(); }
  /// Instances with a proxy that are flat (see flattens() above); they are not traced.
  uint64_t flat_instances() const { return flat_; }
  uint64_t instances_without_proxy() const { return without_; }
  /// Bytes of all streams and of what is needed to trace them.
  uint64_t resident_bytes() const;
  const std::vector<Proxy>& proxies() const { return proxies_; }

private:
  struct Placed {
    uint32_t instance, proxy;
    DAffine grid_from_world;
    glm::dmat3 world_normal; ///< normals of the grid to the world, not of unit length
  };

  /// Traces one ray through all instances. `begin(placed, origin, direction)` gets the ray in the grid space of an
  /// instance, whose origin it may move by less than the margin of a field, and returns its RayStart.
  /// `found(placed, hit, t_max)` returns the new t_max; the search ends once that is at most t_min.
  template <class Begin, class Found>
  void search(DVec3 origin, DVec3 direction, double t_min, double t_max, const Begin& begin, const Found& found) const;

  std::vector<Proxy> proxies_;
  std::vector<Placed> placed_;
  ThingTree tree_;
  uint64_t flat_ = 0, without_ = 0;
};

} // namespace packtrace
