#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "compress/format/layout/baked_format.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// One mesh within a geometry.
struct GeometryPart {
  uint32_t mesh = 0;
  uint32_t slot = 0; ///< of the geometry's materials
  bool flip = false; ///< turn the winding over, so that it agrees with the carried geometric normal
  DAffine geometry_from_mesh{1.0};
};

/// What becomes one geometry of the file.
struct GeometryPlan {
  std::string name;
  std::vector<GeometryPart> parts;
  std::vector<uint32_t> slot_class; ///< material class by slot, ascending
  /// Where the slots' materials lie in ScenePlan::material_slots, once for each different choice of materials among the
  /// instances. Materials of one slot agree in their class only.
  std::vector<uint32_t> material_runs;
  bool world_space = false; ///< on the scene's grid; otherwise on one of its own
  /// Largest factor by which an instance turns an error per object axis into an error per world axis.
  double max_stretch = 1.0;
};

struct ScenePlan {
  std::vector<GeometryPlan> geometries;
  /// The scene's shapes outside objects in order, then its object instances in order. The geometry is kNone where
  /// something is left out.
  std::vector<baked::InstanceRecord> instances;
  std::vector<uint32_t> material_slots; ///< materials, in runs that instances begin at
  uint64_t shared_shapes = 0;           ///< world shapes that use another's geometry
  uint64_t instanced_shapes = 0;        ///< world shapes that lie on a grid of their geometry's own, as they share it
  uint64_t shared_objects = 0;          ///< objects that use another's geometry
  uint64_t unused_objects = 0;          ///< never instanced, not stored
  uint64_t unused_triangles = 0;        ///< theirs
  std::vector<std::string> left_out;    ///< what leaves the range of floats where it is placed, and how far
};

/// World shapes with equal meshes of different indices share a geometry from this size on. Below they stay on the
/// world's grid: they are tiles of one surface more often than copies of one thing, and an own grid opens seams.
inline constexpr size_t kMinSharedTriangles = 128;

/// Whether all coordinates of the box are floats.
bool within_float_range(const Bounds& box);

/// "NAME leaves the float range: its coordinates reach 1e40".
std::string beyond_float_range(const std::string& name, const Bounds& box);

/// Decides which shapes and objects share a geometry: those with equal triangles, winding and material classes.
/// Equality is of bytes, found by hash and verified. Materials may differ, each instance has its own.
///
/// World shapes with different transforms share where the scene says that they are one mesh (the same index), or from
/// kMinSharedTriangles on. As every shape has an instance record in any case, sharing saves all but the first geometry.
/// Throws Error(kInput) where an index of the scene is out of range or a transform is not finite.
ScenePlan plan_scene(const Scene& scene);

} // namespace packtrace
