#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "compress/bake/level_chain.h"
#include "compress/format/deformation/deformation_format.h"
#include "compress/format/layout/baked_format.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// One mesh within a geometry.
struct GeometryPart {
  uint32_t mesh = 0;
  uint32_t slot = 0; ///< index of the material slot within the geometry
  bool flip = false; ///< reverse the winding, so that it agrees with the stored geometric normal
  DAffine geometry_from_mesh{1.0};
  /// SequenceMeasure::same_path of a mesh that moves; null for others.
  const std::vector<uint32_t>* same_path = nullptr;
};

/// Transforms points of a part's mesh into geometry space. Skips the transform if it is the identity, as it is for most
/// parts.
class PartMap {
public:
  /// @param part must outlive this object
  explicit PartMap(const GeometryPart& part)
      : geometry_from_mesh_(&part.geometry_from_mesh), is_identity_(*geometry_from_mesh_ == DAffine(1.0)) {}

  bool is_identity() const { return is_identity_; }

  /// Returns the same as transform_point() for finite points. Adding 0 turns -0 into 0, as a transform does.
  DVec3 operator()(Vec3 p) const {
    return is_identity_ ? DVec3(p) + 0.0 : transform_point(*geometry_from_mesh_, DVec3(p));
  }

private:
  const DAffine* geometry_from_mesh_;
  bool is_identity_;
};

/// A vertex of the source: a part of the plan and a vertex of its mesh.
struct SourceVertex {
  uint32_t part = 0, vertex = 0;
};

/// Plan of one geometry of the file.
struct GeometryPlan {
  std::string name;
  std::vector<GeometryPart> parts;
  std::vector<uint32_t> slot_class; ///< material class per slot, ascending
  /// First entries of this geometry's runs in ScenePlan::material_slots: one run for each distinct assignment of
  /// materials among its instances. The materials of one slot have the same class but may differ otherwise.
  std::vector<uint32_t> material_runs;
  bool world_space = false; ///< on the scene's grid; otherwise on its own grid
  /// Largest factor by which an instance scales an error per object axis to an error per world axis.
  double max_stretch = 1.0;
  bool deforms = false; ///< some part's mesh moves; never in world space
};

/// Plan of all geometries and instances of a file.
struct ScenePlan {
  std::vector<GeometryPlan> geometries;
  /// First the scene's shapes outside objects in order, then its object instances in order. The geometry is kNone for
  /// shapes and instances that are left out.
  std::vector<baked::InstanceRecord> instances;
  std::vector<uint32_t> material_slots; ///< material numbers; instances refer to runs of them
  std::vector<baked::LevelChainRecord> chains;
  uint64_t shared_shapes = 0;    ///< world shapes that reuse another shape's geometry
  uint64_t instanced_shapes = 0; ///< world shapes on a grid of their geometry's own, because they share it
  uint64_t shared_objects = 0;   ///< objects that reuse another object's geometry
  uint64_t unused_objects = 0;   ///< never instanced, so not stored
  uint64_t unused_triangles = 0; ///< triangles of the unused objects
  /// Messages about shapes and instances that exceed the float range where they are placed, and by how much.
  std::vector<std::string> left_out;
};

/// Smallest mesh for which world shapes with equal meshes of different indices share a geometry. Smaller ones stay on
/// the world's grid: they are more often tiles of one surface than copies of one object, and a separate grid would
/// open seams.
inline constexpr size_t kMinSharedTriangles = 128;

/// Whether all coordinates of the bounds are in the range of floats.
bool within_float_range(const Bounds& box);

/// Returns "NAME leaves the float range: its coordinates reach 1e40".
std::string beyond_float_range(const std::string& name, const Bounds& box);

/// Decides which shapes and objects share a geometry: those with equal triangles, winding and material classes. Equal
/// means equal bytes, found by hash and verified. Materials may differ, as each instance has its own.
///
/// World shapes with different transforms share a geometry if they use the same mesh index, or if their meshes are
/// equal and have at least kMinSharedTriangles triangles. Every shape has an instance record anyway, so sharing saves
/// all copies of the geometry but the first.
/// World shapes that move (Scene::motion) have a geometry in the space of their mesh, never in world space.
/// @param deforming meshes that move: they share a geometry with no equal mesh, and are not in world space
/// @param chains their objects are kept even if nothing instances them; instances scale errors of all levels
/// Throws Error(kInput) if an index of the scene is out of range or a transform is not finite, and Error(kUsage) for
/// chains that cannot be: two objects with one geometry, other material slots, a chain without instances.
ScenePlan plan_scene(const Scene& scene, std::span<const uint32_t> deforming = {},
                     std::span<const LevelChain> chains = {});

} // namespace packtrace
