#include "tests/runtime/trace/test_scenes.h"

#include <cmath>
#include <numbers>

#include <glm/gtc/matrix_transform.hpp>

#include "pbrt_import/scene/camera_rays.h"
#include "runtime/camera/primary_visibility.h"
#include "runtime/trace/source/float_source.h"

namespace packtrace::test {

Mesh quad(Vec3 a, Vec3 u, Vec3 v) {
  Mesh mesh;
  mesh.name = "quad";
  mesh.positions = {a, a + u, a + u + v, a + v};
  mesh.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

Mesh box(Vec3 lo, Vec3 hi) {
  Mesh mesh;
  mesh.name = "box";
  for (uint32_t i = 0; i < 8; ++i)
    mesh.positions.push_back({i & 1 ? hi.x : lo.x, i & 2 ? hi.y : lo.y, i & 4 ? hi.z : lo.z});
  const uint32_t faces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (const auto& f : faces) {
    mesh.triangles.push_back({f[0], f[1], f[2]});
    mesh.triangles.push_back({f[0], f[2], f[3]});
  }
  return mesh;
}

Mesh sphere(Vec3 centre, float radius, uint32_t rings) {
  Mesh mesh;
  mesh.name = "sphere";
  const uint32_t columns = 2 * rings;
  for (uint32_t i = 0; i <= rings; ++i)
    for (uint32_t j = 0; j < columns; ++j) {
      const double theta = std::numbers::pi * i / rings, phi = 2 * std::numbers::pi * j / columns;
      const Vec3 n(DVec3(std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi)));
      mesh.positions.push_back(centre + radius * n);
      mesh.normals.push_back(n);
    }
  for (uint32_t i = 0; i < rings; ++i)
    for (uint32_t j = 0; j < columns; ++j) {
      const uint32_t a = i * columns + j, b = i * columns + (j + 1) % columns, c = a + columns, d = b + columns;
      if (i > 0) mesh.triangles.push_back({a, b, d});
      if (i + 1 < rings) mesh.triangles.push_back({a, d, c});
    }
  return mesh;
}

DAffine placed(DVec3 translation, DVec3 scale, double turn_degrees, DVec3 axis) {
  glm::dmat4 m = glm::translate(glm::dmat4(1.0), translation);
  m = glm::rotate(m, turn_degrees * std::numbers::pi / 180.0, glm::normalize(axis));
  m = glm::scale(m, scale);
  return DAffine(m);
}

namespace {

uint32_t add_mesh_and_material(Scene& scene, Mesh mesh, MaterialFlags flags) {
  scene.meshes.push_back(std::move(mesh));
  Material material;
  material.flags = flags;
  scene.materials.push_back(material);
  return static_cast<uint32_t>(scene.materials.size() - 1);
}

} // namespace

uint32_t add_shape(Scene& scene, Mesh mesh, MaterialFlags flags, const DAffine& world_from_mesh) {
  const uint32_t material = add_mesh_and_material(scene, std::move(mesh), flags);
  scene.shapes.push_back({static_cast<uint32_t>(scene.meshes.size() - 1), material, false, world_from_mesh});
  return static_cast<uint32_t>(scene.shapes.size() - 1);
}

uint32_t add_object(Scene& scene, Mesh mesh, MaterialFlags flags) {
  const uint32_t material = add_mesh_and_material(scene, std::move(mesh), flags);
  scene.objects.push_back(
      {"object", {{static_cast<uint32_t>(scene.meshes.size() - 1), material, false, DAffine(1.0)}}});
  return static_cast<uint32_t>(scene.objects.size() - 1);
}

GBuffer point_gbuffer(Vec3 position, Vec3 normal, float offset) {
  GBuffer gbuffer;
  gbuffer.resize({8, 8});
  for (size_t i = 0; i < gbuffer.size.pixels(); ++i) {
    gbuffer.view_z[i] = 1.0f;
    gbuffer.position[i] = position;
    gbuffer.geometric_normal[i] = gbuffer.normal[i] = normal;
    gbuffer.instance[i] = 0;
    gbuffer.offset[i] = offset;
  }
  return gbuffer;
}

double ao_at(const Scene& scene, Vec3 position, Vec3 normal, const AoConfig& config, float offset) {
  const FloatSource source(scene);
  const EmbreeTracer embree(source, {});
  Progress progress;
  AoFrame frame;
  trace_ao(source, embree, point_gbuffer(position, normal, offset), config, 0, frame, progress);
  double sum = 0.0;
  for (const float ao : frame.ao) sum += ao;
  return sum / static_cast<double>(frame.ao.size());
}

Camera camera_at(DVec3 eye, DVec3 target, double fov_degrees) {
  Camera camera;
  camera.world_from_camera = *look_at(eye, target, DVec3(0, 1, 0));
  camera.fov_degrees = fov_degrees;
  return camera;
}

Rendered render(const Scene& scene, const Camera& camera, ImageSize size, const AoConfig& config,
                EmbreeConfig embree_config) {
  const FloatSource source(scene);
  const EmbreeTracer embree(source, embree_config);
  const PrimaryCamera primary(camera, size);
  Progress progress;
  Rendered result;
  trace_primary(source, embree, primary, primary, result.gbuffer, progress);
  trace_ao(source, embree, result.gbuffer, config, 0, result.ao, progress);
  return result;
}

} // namespace packtrace::test
