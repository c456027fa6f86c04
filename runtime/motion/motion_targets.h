#pragma once

#include <string>
#include <vector>

#include "pbrt_import/scene/scene.h"

namespace packtrace {

class BakedFile;

/// An instance as keys address and move it.
struct MotionTarget {
  std::string name; ///< of its geometry: the object, or the mesh of a shape outside objects; shared by many instances
  Affine placement{1.0f}; ///< world_from_object at rest
  Bounds box;             ///< of its geometry in object space; of all frames if it deforms
  bool fixed = false;     ///< part of the world's own tree, so it cannot move
};

/// The instances of a scene or file, and where the world's zero lies. Instances have the numbers of
/// SceneSource::instances().
struct MotionTargets {
  std::vector<MotionTarget> instances;
  DVec3 origin{0.0}; ///< Scene::origin
};

/// The point about which keys turn and scale an instance that name none: the centre of its box at rest.
Vec3 default_pivot(const MotionTarget& target);

/// Objects of a file that share a geometry have the name of the first of them.
MotionTargets motion_targets(const BakedFile& file);

/// @param scene after separate_motion(), as an instance of a file has the number that it has then
MotionTargets motion_targets(const Scene& scene);

/// Adds motion to motion: an instance or camera that moves already gets the added motion instead.
void add_motion(RigidMotion& motion, const RigidMotion& added);

} // namespace packtrace
