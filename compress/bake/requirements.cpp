#include "compress/bake/requirements.h"

#include <algorithm>
#include <cmath>

#include "compress/format/uv_codec.h"
#include "pbrt_import/scene/error.h"

namespace packtrace {
namespace {

/// Largest finite |u| and |v|.
Vec2 max_abs_uv(const Mesh& mesh) {
  Vec2 largest(0.0f);
  for (const Vec2 uv : mesh.uvs)
    for (int axis = 0; axis < 2; ++axis)
      if (std::isfinite(uv[axis])) largest[axis] = std::max(largest[axis], std::abs(uv[axis]));
  return largest;
}

} // namespace

GeometryNeeds analyse_requirements(const Scene& scene, const ScenePlan& scene_plan, const GeometryPlan& plan) {
  GeometryNeeds needs;
  Vec2 largest(0.0f);
  std::vector<const AlphaMask*> masks;
  for (const GeometryPart& part : plan.parts) {
    const Mesh& mesh = scene.meshes[part.mesh];
    const bool masked = !mesh.triangles.empty() && (plan.slot_class[part.slot] & baked::kMaskedClass) != 0;
    needs.parts.push_back({!mesh.normals.empty(), masked});
    if (!masked) continue;
    largest = glm::max(largest, max_abs_uv(mesh));
    for (const uint32_t run : plan.material_runs) {
      const Material& material = scene.materials[scene_plan.material_slots[run + part.slot]];
      const auto add = [&](MaterialFlags flag, uint32_t mask) {
        if ((material.flags & flag) == 0) return;
        if (mask >= scene.masks.size())
          throw Error(ErrorKind::kInput,
                      "invalid scene: an alpha mask of material " + material.name + " does not exist");
        masks.push_back(&scene.masks[mask]);
      };
      add(kAlphaMask, material.alpha_mask);
      add(kShadowAlphaMask, material.shadow_alpha_mask);
    }
  }
  for (size_t i = 0; i < masks.size(); ++i) {
    const AlphaMask& mask = *masks[i];
    const std::array<int32_t, 2> exponent = {choose_uv_exponent(mask.width, mask.uv_scale.x, largest.x),
                                             choose_uv_exponent(mask.height, mask.uv_scale.y, largest.y)};
    for (size_t axis = 0; axis < 2; ++axis)
      needs.uv_exponent[axis] = i == 0 ? exponent[axis] : std::min(needs.uv_exponent[axis], exponent[axis]);
  }
  return needs;
}

uint64_t unneeded_uv_bytes(const Scene& scene, const GeometryPlan& plan, const GeometryNeeds& needs) {
  uint64_t bytes = 0;
  for (size_t i = 0; i < plan.parts.size(); ++i)
    if (!needs.parts[i].uvs) bytes += scene.meshes[plan.parts[i].mesh].uvs.size() * sizeof(Vec2);
  return bytes;
}

} // namespace packtrace
