#include "runtime/measure/stability_cases.h"

#include <cmath>
#include <numbers>
#include <utility>

namespace packtrace {
namespace {

constexpr double kEye = 4.0; ///< distance of cameras from the centre of unit-sized scenes

/// Latitude-longitude sphere around the origin, outward winding.
Mesh sphere(int rings, bool normals) {
  Mesh mesh;
  mesh.name = "sphere";
  const int segments = 2 * rings;
  for (int ring = 0; ring <= rings; ++ring)
    for (int segment = 0; segment < segments; ++segment) {
      const double theta = std::numbers::pi * ring / rings, phi = 2.0 * std::numbers::pi * segment / segments;
      const double radius = ring == 0 || ring == rings ? 0.0 : std::sin(theta);
      mesh.positions.push_back(Vec3(DVec3(radius * std::cos(phi), std::cos(theta), radius * std::sin(phi))));
    }
  if (normals) mesh.normals = mesh.positions;
  const auto vertex = [&](int ring, int segment) {
    return static_cast<uint32_t>(ring * segments + segment % segments);
  };
  for (int ring = 0; ring < rings; ++ring)
    for (int segment = 0; segment < segments; ++segment) {
      if (ring > 0)
        mesh.triangles.push_back({vertex(ring, segment), vertex(ring, segment + 1), vertex(ring + 1, segment)});
      if (ring + 1 < rings)
        mesh.triangles.push_back({vertex(ring, segment + 1), vertex(ring + 1, segment + 1), vertex(ring + 1, segment)});
    }
  return mesh;
}

/// Box with half sizes h around the origin, outward winding.
Mesh box(DVec3 h) {
  Mesh mesh;
  mesh.name = "box";
  for (int i = 0; i < 8; ++i)
    mesh.positions.push_back(
        Vec3(DVec3((i & 1) != 0 ? h.x : -h.x, (i & 2) != 0 ? h.y : -h.y, (i & 4) != 0 ? h.z : -h.z)));
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

/// Two triangles over [-h, h]^2 at y = 0.
Mesh square(double h) {
  Mesh mesh;
  mesh.name = "square";
  for (int i = 0; i < 4; ++i) mesh.positions.push_back(Vec3(DVec3((i & 1) != 0 ? h : -h, 0.0, (i & 2) != 0 ? h : -h)));
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}};
  return mesh;
}

DAffine placed(DVec3 scale, DVec3 at) {
  return DAffine(DVec3(scale.x, 0, 0), DVec3(0, scale.y, 0), DVec3(0, 0, scale.z), at);
}

/// Camera at `eye` that looks at `target`.
Camera camera(DVec3 eye, DVec3 target, double fov_degrees) {
  Camera result;
  result.world_from_camera = look_at(eye, target, DVec3(0, 1, 0)).value_or(DAffine(1.0));
  result.fov_degrees = fov_degrees;
  return result;
}

void add(Scene& scene, Mesh mesh, const DAffine& placement = DAffine(1.0)) {
  if (scene.materials.empty()) scene.materials.emplace_back();
  scene.shapes.emplace_back(static_cast<uint32_t>(scene.meshes.size()), 0u, false, placement);
  scene.meshes.push_back(std::move(mesh));
}

StabilityCase alone(std::string name, Mesh mesh, const DAffine& placement, StabilityShape shape) {
  StabilityCase result{std::move(name), {}, 1.0, shape};
  add(result.scene, std::move(mesh), placement);
  result.scene.cameras.push_back(camera(DVec3(0.4, 0.6, -1.0) * kEye, DVec3(0.0), 40.0));
  return result;
}

/// A sphere and a box on a floor, scaled and moved: positions are floats of the result.
StabilityCase still_life(std::string name, double scale, DVec3 extents) {
  StabilityCase result{std::move(name), {}, 0.5 * scale, StabilityShape::kAny};
  const DVec3 origin = extents * 4.0 * scale;
  const auto put = [&](Mesh mesh, DVec3 at) {
    for (Vec3& p : mesh.positions) p = Vec3((DVec3(p) + at) * scale + origin);
    add(result.scene, std::move(mesh));
  };
  put(square(2.0), DVec3(0.0));
  put(sphere(12, false), DVec3(-0.7, 1.0, 0.0));
  put(box(DVec3(0.4)), DVec3(0.9, 0.4, -0.4));
  result.scene.cameras.push_back(
      camera(DVec3(0.8, 2.4, -5.0) * scale + origin, DVec3(0.0, 0.6, 0.0) * scale + origin, 40.0));
  return result;
}

/// The same in a world far away: meshes lie near their zero, and transforms have all digits.
StabilityCase placed_still_life(std::string name, double extents) {
  StabilityCase result = still_life(std::move(name), 1.0, DVec3(0.0));
  const DVec3 origin = DVec3(1.0, 0.25, -0.5) * extents * 4.0 + DVec3(0.3, 0.7, 0.1);
  for (Shape& shape : result.scene.shapes) shape.parent_from_mesh[3] += origin;
  for (Camera& c : result.scene.cameras) c.world_from_camera[3] += origin;
  return result;
}

void add_scales(std::vector<StabilityCase>& cases) {
  for (const int exponent : {-40, -12, -6, 0, 6, 12})
    cases.push_back(still_life("scale 1e" + std::to_string(exponent), std::pow(10.0, exponent), DVec3(0.0)));
  for (const int exponent : {3, 5, 7})
    cases.push_back(still_life("moved by 1e" + std::to_string(exponent) + " extents", 1.0,
                               DVec3(1.0, 0.25, -0.5) * std::pow(10.0, exponent)));
  for (const int exponent : {3, 5, 7})
    cases.push_back(
        placed_still_life("placed 1e" + std::to_string(exponent) + " extents away", std::pow(10.0, exponent)));
}

void add_shapes(std::vector<StabilityCase>& cases) {
  using enum StabilityShape;
  cases.push_back(alone("sphere", sphere(12, false), DAffine(1.0), kConvex));
  cases.push_back(alone("flat box", square(1.0), DAffine(1.0), kConvex));
  StabilityCase needle = alone("needle box 1 : 1e6", box(DVec3(1.0, 1e-6, 1e-6)), DAffine(1.0), kConvex);
  needle.scene.cameras[0] = camera(DVec3(-2e-6, 3e-6, -6e-6), DVec3(1e-6, 0.0, 0.0), 40.0);
  cases.push_back(std::move(needle));
  cases.push_back(alone("plate 1e6 : 1", box(DVec3(1.0, 1e-6, 1.0)), DAffine(1.0), kConvex));
  Mesh triangle = square(1.0);
  triangle.triangles.resize(1);
  cases.push_back(alone("one triangle", triangle, DAffine(1.0), kConvex));
  Mesh point = square(1.0);
  for (Vec3& p : point.positions) p = Vec3(0.25f);
  StabilityCase with_point = alone("sphere with a mesh without extent", sphere(12, false), DAffine(1.0), kConvex);
  add(with_point.scene, point);
  cases.push_back(std::move(with_point));
  cases.push_back(
      alone("one axis scaled by 1e-6", sphere(12, false), placed(DVec3(1.0, 1e-6, 1.0), DVec3(0.0)), kConvex));
  StabilityCase long_axis =
      alone("one axis scaled by 1e6", sphere(12, false), placed(DVec3(1e6, 1.0, 1.0), DVec3(0.0)), kConvex);
  long_axis.scene.cameras[0] = camera(DVec3(0.0, 3.0, -8.0), DVec3(0.0), 60.0);
  cases.push_back(std::move(long_axis));
}

void add_surfaces(std::vector<StabilityCase>& cases) {
  StabilityCase stack = still_life("1,000 coinciding floors", 1.0, DVec3(0.0));
  for (int i = 0; i < 999; ++i) stack.scene.shapes.push_back(stack.scene.shapes[0]);
  cases.push_back(std::move(stack));
  cases.push_back(alone("normals at the Z-sign equator", sphere(24, true), DAffine(1.0), StabilityShape::kConvex));
  Mesh textured = square(2.0);
  for (const Vec3& p : textured.positions) textured.uvs.push_back(Vec2(p.x, p.z) * 1e30f);
  StabilityCase huge_uv = still_life("texture coordinates of 1e30", 1.0, DVec3(0.0));
  huge_uv.scene.meshes[0] = textured;
  cases.push_back(std::move(huge_uv));
}

void add_views(std::vector<StabilityCase>& cases) {
  for (auto& [name, mesh] : {std::pair("inside a box", box(DVec3(1.0))), {"inside a sphere", sphere(12, false)}}) {
    StabilityCase inside = alone(name, mesh, DAffine(1.0), StabilityShape::kClosed);
    inside.scene.cameras[0] = camera(DVec3(0.3, -0.2, -0.5), DVec3(0.1, 0.2, 1.0), 90.0);
    inside.ao_radius = 10.0;
    cases.push_back(std::move(inside));
  }
  StabilityCase far = still_life("camera at 1e9 units", 1.0, DVec3(0.0));
  const DVec3 direction = glm::normalize(DVec3(0.1, 0.5, -1.0));
  far.scene.cameras[0] = camera(direction * 1e9, DVec3(0.0, 0.5, 0.0), 2.0 * 2e-9 * 180.0 / std::numbers::pi);
  cases.push_back(std::move(far));
}

} // namespace

std::vector<StabilityCase> stability_cases() {
  std::vector<StabilityCase> cases;
  add_scales(cases);
  add_shapes(cases);
  add_surfaces(cases);
  add_views(cases);
  return cases;
}

} // namespace packtrace
