#include "tests/compress/test_scenes.h"

#include <cmath>

#include <glm/gtc/constants.hpp>

namespace packtrace::test {

std::array<uint32_t, 3> rotated_to_smallest(const Triangle& t) {
  return std::min({std::array{t.x, t.y, t.z}, std::array{t.y, t.z, t.x}, std::array{t.z, t.x, t.y}});
}

uint32_t Random::bits() {
  state_ = state_ * 6364136223846793005u + 1442695040888963407u;
  return static_cast<uint32_t>((state_ ^ (state_ >> 22)) >> 29);
}

float Random::uniform(float lo, float hi) { return lo + (hi - lo) * static_cast<float>(bits() >> 8) * 0x1p-24f; }

Mesh grid_mesh(uint32_t n, float bump, bool normals) {
  Mesh mesh;
  mesh.name = "grid";
  const auto scale = 1.0f / static_cast<float>(n);
  for (uint32_t y = 0; y <= n; ++y)
    for (uint32_t x = 0; x <= n; ++x) {
      const float u = static_cast<float>(x) * scale, v = static_cast<float>(y) * scale;
      mesh.positions.emplace_back(u, v, bump * std::sin(9.0f * u) * std::cos(7.0f * v));
      mesh.uvs.emplace_back(u, v);
      if (normals)
        mesh.normals.push_back(glm::normalize(Vec3(-bump * 9.0f * std::cos(9.0f * u) * std::cos(7.0f * v),
                                                   bump * 7.0f * std::sin(9.0f * u) * std::sin(7.0f * v), 1.0f)));
    }
  for (uint32_t y = 0; y < n; ++y)
    for (uint32_t x = 0; x < n; ++x) {
      const uint32_t a = y * (n + 1) + x, b = a + 1, c = a + n + 1, d = c + 1;
      mesh.triangles.emplace_back(a, b, d);
      mesh.triangles.emplace_back(a, d, c);
    }
  return mesh;
}

Mesh sphere_mesh(uint32_t rings, float radius) {
  Mesh mesh;
  mesh.name = "sphere";
  const uint32_t segments = 2 * rings;
  const auto point = [&](Vec3 n) {
    mesh.normals.push_back(glm::normalize(n));
    mesh.positions.push_back(mesh.normals.back() * radius);
  };
  point({0, 0, 1});
  for (uint32_t r = 1; r < rings; ++r)
    for (uint32_t s = 0; s < segments; ++s) {
      const float theta = glm::pi<float>() * static_cast<float>(r) / static_cast<float>(rings);
      const float phi = glm::two_pi<float>() * static_cast<float>(s) / static_cast<float>(segments);
      point({std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)});
    }
  point({0, 0, -1});
  const auto at = [&](uint32_t r, uint32_t s) { return 1 + (r - 1) * segments + s % segments; };
  const auto last = static_cast<uint32_t>(mesh.positions.size() - 1);
  for (uint32_t s = 0; s < segments; ++s) {
    mesh.triangles.emplace_back(0, at(1, s), at(1, s + 1));
    for (uint32_t r = 1; r + 1 < rings; ++r) {
      mesh.triangles.emplace_back(at(r, s), at(r + 1, s), at(r + 1, s + 1));
      mesh.triangles.emplace_back(at(r, s), at(r + 1, s + 1), at(r, s + 1));
    }
    mesh.triangles.emplace_back(last, at(rings - 1, s + 1), at(rings - 1, s));
  }
  return mesh;
}

Mesh soup_mesh(uint32_t triangles, uint32_t seed) {
  Mesh mesh;
  mesh.name = "soup";
  Random random(seed);
  for (uint32_t i = 0; i < 3 * triangles; ++i)
    mesh.positions.emplace_back(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
  for (uint32_t i = 0; i < triangles; ++i) mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  return mesh;
}

DAffine translation(DVec3 by) {
  DAffine m(1.0);
  m[3] = by;
  return m;
}

DAffine scaling(DVec3 by) {
  DAffine m(1.0);
  for (int axis = 0; axis < 3; ++axis) m[axis][axis] = by[axis];
  return m;
}

void add_shape(Scene& scene, Mesh mesh, const DAffine& world_from_mesh, uint32_t material) {
  Shape shape;
  shape.mesh = static_cast<uint32_t>(scene.meshes.size());
  shape.material = material;
  shape.parent_from_mesh = world_from_mesh;
  scene.meshes.push_back(std::move(mesh));
  scene.shapes.push_back(shape);
}

Scene scene_of(Mesh mesh, const DAffine& world_from_mesh) {
  Scene scene;
  scene.materials.push_back({"plain", 0, Vec3(0.5f), kNoMask, kNoMask});
  add_shape(scene, std::move(mesh), world_from_mesh);
  return scene;
}

AlphaMask striped_mask() {
  AlphaMask mask;
  mask.width = 64, mask.height = 32;
  mask.words.assign(2 * 32, 0x0f0f0f0fu);
  return mask;
}

Scene mixed_scene() {
  Scene scene = scene_of(sphere_mesh(20));
  scene.masks.push_back(striped_mask());
  scene.masks[0].uv_scale = Vec2(2.0f), scene.masks[0].uv_offset = Vec2(0.25f);
  scene.materials.push_back({"leaf", kAlphaMask, Vec3(0.5f), 0, kNoMask});
  add_shape(scene, grid_mesh(40, 0.3f, true), translation({-3, 2, 1}), 1);
  add_shape(scene, soup_mesh(300, 4));
  scene.meshes.push_back(sphere_mesh(9));
  scene.objects.push_back({"ball", {Shape{3, 0, false, DAffine(1.0)}, Shape{1, 1, true, scaling({2, 2, -2})}}});
  for (const double x : {5.0, -5.0}) scene.instances.push_back({0, Affine(translation({x, 5, 5}))});
  return scene;
}

BakedScene bake(const Scene& scene, const BakeConfig& config) {
  Diagnostics diagnostics;
  Progress progress;
  return bake_to_bytes(scene, config, diagnostics, progress);
}

Decoded decode(const BakedFile& file, uint32_t geometry) {
  Decoded out;
  for (uint32_t i = 0; i < file.clusters(geometry).size(); ++i) {
    const ClusterView view = file.cluster(geometry, i);
    const size_t vertex = out.positions.size(), triangle = out.triangles.size();
    out.positions.resize(vertex + view.vertex_count());
    out.normals.resize(out.positions.size(), Vec3(0.0f));
    out.uvs.resize(out.positions.size(), Vec2(0.0f));
    out.triangles.resize(triangle + view.triangle_count());
    decode_positions(view, std::span(out.positions).subspan(vertex));
    decode_indices(view, static_cast<uint32_t>(vertex), std::span(out.triangles).subspan(triangle));
    if (view.has_normals()) decode_normals(view, std::span(out.normals).subspan(vertex));
    if (view.has_uvs()) decode_uvs(view, std::span(out.uvs).subspan(vertex));
    out.slots.resize(out.triangles.size(), view.material_slot());
  }
  return out;
}

} // namespace packtrace::test
