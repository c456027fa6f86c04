#include "pbrt_import/builder/outer_sides.h"

#include <optional>
#include <unordered_map>
#include <vector>

#include "pbrt_import/builder/scene_pruning.h"

namespace packtrace {
namespace {

/// Whether most vertex normals point against the winding.
bool normals_oppose(const Mesh& mesh) {
  if (mesh.normals.empty()) return false;
  int64_t balance = 0;
  for (const Triangle& t : mesh.triangles) {
    const DVec3 a(mesh.positions[t.x]), b(mesh.positions[t.y]), c(mesh.positions[t.z]);
    const DVec3 normals = DVec3(mesh.normals[t.x]) + DVec3(mesh.normals[t.y]) + DVec3(mesh.normals[t.z]);
    const double side = glm::dot(glm::cross(b - a, c - a), normals);
    balance += side > 0.0 ? 1 : side < 0.0 ? -1 : 0;
  }
  return balance < 0;
}

} // namespace

void find_outer_sides(Scene& scene) {
  std::vector<std::optional<bool>> opposed(scene.meshes.size());
  std::unordered_map<uint32_t, uint32_t> copies; // by material
  for_each_shape(scene, [&](Shape& shape) {
    const SurfaceShading& shading = scene.materials[shape.material].shading;
    if (!shading.emits() && !shading.transmits()) return;
    std::optional<bool>& known = opposed[shape.mesh];
    if (!known) known = normals_oppose(scene.meshes[shape.mesh]);
    if (!*known) return;
    const auto [copy, inserted] = copies.try_emplace(shape.material, static_cast<uint32_t>(scene.materials.size()));
    if (inserted) {
      Material opposite = scene.materials[shape.material];
      opposite.shading.bits |= kOuterSideOpposite;
      scene.materials.push_back(std::move(opposite));
    }
    shape.material = copy->second;
  });
}

} // namespace packtrace
