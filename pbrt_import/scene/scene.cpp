#include "pbrt_import/scene/scene.h"

#include "pbrt_import/scene/motion_pose.h"
#include "pbrt_import/scene/shape_bounds.h"

namespace packtrace {
namespace {

uint64_t triangle_count(const Scene& scene, const std::vector<Shape>& shapes) {
  uint64_t total = 0;
  for (const Shape& shape : shapes) total += scene.meshes[shape.mesh].triangles.size();
  return total;
}

} // namespace

uint64_t bytes_of(const Mesh& mesh) {
  return mesh.positions.size() * sizeof(Vec3) + mesh.normals.size() * sizeof(Vec3) + mesh.uvs.size() * sizeof(Vec2) +
         mesh.triangles.size() * sizeof(Triangle);
}

DAffine interpolate(const AnimatedTransform& keys, double time) {
  if (time <= keys.start_time) return keys.start.map;
  if (time >= keys.end_time) return keys.end.map;
  const double s = (time - keys.start_time) / (keys.end_time - keys.start_time);
  const glm::dmat3 scale = keys.start.scale * (1.0 - s) + keys.end.scale * s;
  const glm::dmat3 linear = glm::mat3_cast(glm::slerp(keys.start.rotation, keys.end.rotation, s)) * scale;
  return DAffine(linear[0], linear[1], linear[2], glm::mix(keys.start.map[3], keys.end.map[3], s));
}

uint64_t unique_triangle_count(const Scene& scene) {
  uint64_t total = triangle_count(scene, scene.shapes);
  for (const Object& object : scene.objects) total += triangle_count(scene, object.shapes);
  return total;
}

uint64_t placed_triangle_count(const Scene& scene) {
  std::vector<uint64_t> per_object;
  for (const Object& object : scene.objects) per_object.push_back(triangle_count(scene, object.shapes));
  uint64_t total = triangle_count(scene, scene.shapes);
  for (const Instance& instance : scene.instances) total += per_object[instance.object];
  return total;
}

Bounds bounds_of_shapes(std::span<const Shape> shapes, std::span<const Bounds> meshes) {
  Bounds result;
  for (const Shape& shape : shapes) result.extend(transform_bounds(shape.parent_from_mesh, meshes[shape.mesh]));
  return result;
}

Bounds world_bounds(const Scene& scene) {
  std::vector<Bounds> mesh_bounds;
  for (const Mesh& mesh : scene.meshes) mesh_bounds.push_back(bounds_of(mesh.positions));
  Bounds result = bounds_of_shapes(scene.shapes, mesh_bounds);
  std::vector<Bounds> object_bounds;
  for (const Object& object : scene.objects) object_bounds.push_back(bounds_of_shapes(object.shapes, mesh_bounds));
  for (const Instance& instance : scene.instances)
    result.extend(transform_bounds(DAffine(instance.world_from_object), object_bounds[instance.object]));
  for (const InstanceMotion& moving : scene.motion.instances) {
    if (moving.instance < scene.shapes.size()) {
      const Shape& shape = scene.shapes[moving.instance];
      result.extend(swept_bounds(scene.motion, moving, Affine(shape.parent_from_mesh), mesh_bounds[shape.mesh]));
    } else {
      const Instance& instance = scene.instances[moving.instance - scene.shapes.size()];
      result.extend(swept_bounds(scene.motion, moving, instance.world_from_object, object_bounds[instance.object]));
    }
  }
  return result;
}

} // namespace packtrace
