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

GeometryNeeds analyse_requirements(const Scene& scene, const GeometryPlan& plan) {
  GeometryNeeds needs;
  Vec2 largest(0.0f);
  std::vector<const AlphaMask*> masks;
  for (const GeometryPart& part : plan.parts) {
    const Mesh& mesh = scene.meshes[part.mesh];
    const Material& material = scene.materials[part.material];
    needs.parts.push_back({!mesh.normals.empty(), needs_mask(material.flags)});
    if (!needs_mask(material.flags)) continue;
    largest = glm::max(largest, max_abs_uv(mesh));
    const auto add = [&](MaterialFlags flag, uint32_t mask) {
      if ((material.flags & flag) == 0) return;
      if (mask >= scene.masks.size())
        throw Error(ErrorKind::kInput, "invalid scene: an alpha mask of material " + material.name + " does not exist");
      masks.push_back(&scene.masks[mask]);
    };
    add(kAlphaMask, material.alpha_mask);
    add(kShadowAlphaMask, material.shadow_alpha_mask);
  }
  for (size_t i = 0; i < masks.size(); ++i) {
    const AlphaMask& mask = *masks[i];
    const std::array<int32_t, 2> exponent = {choose_uv_exponent(mask.width, mask.uv_scale.x, largest.x),
                                             choose_uv_exponent(mask.height, mask.uv_scale.y, largest.y)};
    needs.texels_per_uv[0] = std::max(needs.texels_per_uv[0], std::abs(double{mask.uv_scale.x}) * mask.width);
    needs.texels_per_uv[1] = std::max(needs.texels_per_uv[1], std::abs(double{mask.uv_scale.y}) * mask.height);
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
