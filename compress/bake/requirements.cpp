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

/// What texture coordinates have to find their way in.
struct TexelGrid {
  std::array<uint32_t, 2> size{};
  Vec2 uv_scale{1.0f};
  bool stored = true;
};

/// Of normal maps, which are not read.
constexpr TexelGrid kNormalMapGrid{{4096, 4096}, Vec2(1.0f), false};

void add_textures(const Scene& scene, const Material& material, bool textures, std::vector<TexelGrid>& to) {
  const auto add = [&](const auto& all, uint32_t number, const char* what) {
    if (number >= all.size())
      throw Error(ErrorKind::kInput,
                  std::string("invalid scene: ") + what + " of material " + material.name + " does not exist");
    to.push_back({{all[number].width, all[number].height}, all[number].uv_scale});
  };
  if ((material.flags & kAlphaMask) != 0) add(scene.masks, material.alpha_mask, "an alpha mask");
  if ((material.flags & kShadowAlphaMask) != 0) add(scene.masks, material.shadow_alpha_mask, "an alpha mask");
  if (!textures) return;
  if (material.albedo_texture != kNoTexture) add(scene.textures, material.albedo_texture, "the texture");
  if ((material.flags & kNormalMap) != 0) to.push_back(kNormalMapGrid);
}

} // namespace

GeometryNeeds analyse_requirements(const Scene& scene, const GeometryPlan& plan, bool textures) {
  GeometryNeeds needs;
  Vec2 largest(0.0f);
  std::vector<TexelGrid> looked_up;
  for (const GeometryPart& part : plan.parts) {
    const Mesh& mesh = scene.meshes[part.mesh];
    const size_t before = looked_up.size();
    add_textures(scene, scene.materials[part.material], textures, looked_up);
    needs.parts.push_back({!mesh.normals.empty(), looked_up.size() > before});
    if (looked_up.size() > before) largest = glm::max(largest, max_abs_uv(mesh));
  }
  for (size_t i = 0; i < looked_up.size(); ++i)
    for (size_t axis = 0; axis < 2; ++axis) {
      const float scale = looked_up[i].uv_scale[static_cast<int>(axis)];
      const int32_t exponent = choose_uv_exponent(looked_up[i].size[axis], scale, largest[static_cast<int>(axis)]);
      needs.uv_exponent[axis] = i == 0 ? exponent : std::min(needs.uv_exponent[axis], exponent);
      if (!looked_up[i].stored) continue;
      needs.texels_per_uv[axis] =
          std::max(needs.texels_per_uv[axis], std::abs(double{scale}) * looked_up[i].size[axis]);
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
