#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "compress/format/baked_format.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// One mesh within a geometry.
struct GeometryPart {
  uint32_t mesh = 0;
  uint32_t material = 0;
  bool flip = false; ///< turn the winding over, so that it agrees with the carried geometric normal
  DAffine geometry_from_mesh{1.0};
};

/// What becomes one geometry of the file.
struct GeometryPlan {
  std::string name;
  std::vector<GeometryPart> parts;
  bool world_space = false; ///< on the scene's grid; otherwise on one of its own
  /// Largest factor by which an instance turns an error per object axis into an error per world axis.
  double max_stretch = 1.0;
};

struct ScenePlan {
  std::vector<GeometryPlan> geometries;
  /// The scene's shapes outside objects in order, then its object instances in order.
  std::vector<baked::InstanceRecord> instances;
  uint64_t shared_shapes = 0;    ///< world shapes that use another's geometry
  uint64_t shared_objects = 0;   ///< objects that use another's geometry
  uint64_t unused_objects = 0;   ///< never instanced, not stored
  uint64_t unused_triangles = 0; ///< theirs
};

/// Equal meshes smaller than this are not shared between world shapes: an instance transform is rounded to float, which
/// opens seams to neighbours, and a single cluster is not worth that.
inline constexpr size_t kMinSharedTriangles = 128;

/// Decides which shapes and objects share a geometry. Equality is of bytes, found by hash and verified.
/// Throws Error(kInput) where an index of the scene is out of range or a transform is not finite.
ScenePlan plan_scene(const Scene& scene);

} // namespace packtrace
