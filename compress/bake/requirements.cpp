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

/// Something that looks uvs up: texels along the two axes for a step of 1 in u and v.
struct LookUp {
  std::array<uint32_t, 2> size{};
  Vec2 uv_scale{1.0f};
};

class Analysis {
public:
  Analysis(const Scene& scene, const ScenePlan& scene_plan, const GeometryPlan& plan, const BakeConfig& config)
      : scene_(scene), plan_(plan), config_(config), slot_flags_(plan.slot_class.size()) {
    for (const uint32_t run : plan.material_runs)
      for (size_t slot = 0; slot < slot_flags_.size(); ++slot) {
        const Material& material = scene.materials[scene_plan.material_slots[run + slot]];
        slot_flags_[slot] |= material.flags;
        if ((material.flags & kAlphaMask) != 0) add_mask(material, material.alpha_mask);
        if ((material.flags & kShadowAlphaMask) != 0) add_mask(material, material.shadow_alpha_mask);
      }
  }

  GeometryNeeds run() {
    GeometryNeeds needs;
    Vec2 largest(0.0f);
    for (const GeometryPart& part : plan_.parts) {
      const Mesh& mesh = scene_.meshes[part.mesh];
      needs.parts.push_back(mesh.triangles.empty() ? PartNeeds{} : needs_of(mesh, slot_flags_[part.slot]));
      const PartNeeds& part_needs = needs.parts.back();
      if (!part_needs.store_uvs()) continue;
      largest = glm::max(largest, max_abs_uv(mesh));
      if (part_needs.uvs != baked::kForMask) look_ups_.push_back({{kAssumedTexels, kAssumedTexels}, Vec2(1.0f)});
    }
    const bool any =
        std::any_of(needs.parts.begin(), needs.parts.end(), [](const PartNeeds& p) { return p.store_uvs(); });
    for (size_t i = 0; any && i < look_ups_.size(); ++i)
      for (int axis = 0; axis < 2; ++axis) {
        const auto a = static_cast<size_t>(axis);
        const int32_t exponent = choose_uv_exponent(look_ups_[i].size[a], look_ups_[i].uv_scale[axis], largest[axis]);
        needs.uv_exponent[a] = i == 0 ? exponent : std::min(needs.uv_exponent[a], exponent);
      }
    return needs;
  }

private:
  void add_mask(const Material& material, uint32_t mask) {
    if (mask >= scene_.masks.size())
      throw Error(ErrorKind::kInput, "invalid scene: an alpha mask of material " + material.name + " does not exist");
    look_ups_.push_back({{scene_.masks[mask].width, scene_.masks[mask].height}, scene_.masks[mask].uv_scale});
  }

  PartNeeds needs_of(const Mesh& mesh, MaterialFlags flags) const {
    const bool shading = config_.purpose == baked::kShading;
    PartNeeds needs;
    if (!mesh.normals.empty())
      needs.normals = config_.keep_normals    ? baked::kOnRequest
                      : camera_visible(flags) ? baked::kForShading
                                              : baked::kUnused;
    if (needs_mask(flags)) // also without uvs in the source: (0, 0) is looked up then
      needs.uvs = baked::kForMask;
    else if (!mesh.uvs.empty())
      needs.uvs = config_.keep_uvs                           ? baked::kOnRequest
                  : shading && (flags & kAlbedoTexture) != 0 ? baked::kForTexture
                  : shading && (flags & kNormalMap) != 0     ? baked::kForNormalMap
                                                             : baked::kUnused;
    if ((flags & kNormalMap) != 0 && !mesh.uvs.empty())
      needs.tangents = shading ? baked::kForNormalMap : baked::kUnused;
    return needs;
  }

  const Scene& scene_;
  const GeometryPlan& plan_;
  const BakeConfig& config_;
  std::vector<MaterialFlags> slot_flags_; // of all materials of each slot
  std::vector<LookUp> look_ups_;
};

} // namespace

GeometryNeeds analyse_requirements(const Scene& scene, const ScenePlan& scene_plan, const GeometryPlan& plan,
                                   const BakeConfig& config) {
  return Analysis(scene, scene_plan, plan, config).run();
}

} // namespace packtrace
