#pragma once

#include <string>
#include <utility>

#include "tests/compress/bake_checks.h"

namespace packtrace::test {

/// Two triangles over [-half, half]^2 at height y.
inline Mesh floor_mesh(float half, float y) {
  Mesh mesh;
  mesh.name = "floor";
  mesh.positions = {{-half, y, -half}, {half, y, -half}, {half, y, half}, {-half, y, half}};
  mesh.triangles = {{0, 2, 1}, {0, 3, 2}};
  return mesh;
}

inline Camera camera_at(DVec3 eye, DVec3 target) {
  Camera camera;
  camera.fov_degrees = 45.0;
  camera.world_from_camera = look_at(eye, target, DVec3(0, 1, 0)).value();
  return camera;
}

inline void add_object(Scene& scene, const std::string& name, Mesh mesh) {
  Object object;
  object.name = name;
  object.shapes.emplace_back(static_cast<uint32_t>(scene.meshes.size()), 0u, false, DAffine(1.0));
  scene.meshes.push_back(std::move(mesh));
  scene.objects.push_back(std::move(object));
}

inline void add_instance(Scene& scene, uint32_t object, const DAffine& world_from_object) {
  scene.instances.push_back({object, Affine(world_from_object)});
}

inline double step_of(const baked::GeometryRecord& g) { return PositionGrid{g.step_mantissa, g.step_exponent}.step(); }

} // namespace packtrace::test
