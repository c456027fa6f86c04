#include "compress/bake/plan/requirements.h"

#include <algorithm>
#include <cmath>

#include "compress/format/cluster/uv_codec.h"
#include "pbrt_import/base/error.h"

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

/// A mask or texture that is looked up: its texels along u and v, and the scale of its coordinates.
struct LookUp {
  std::array<uint32_t, 2> size{};
  Vec2 uv_scale{1.0f};
  bool stored = true;
};

/// For textures that are not read.
constexpr LookUp kAssumedLookUp{{kAssumedTexels, kAssumedTexels}, Vec2(1.0f), false};

/// Combined needs of the materials of one slot.
struct SlotNeeds {
  MaterialFlags flags = 0;
  bool textured = false;   ///< shading looks up a colour texture
  bool stores_uvs = false; ///< some part of the slot stores UVs
  std::vector<LookUp> look_ups;
};

class Analysis {
public:
  Analysis(const Scene& scene, const ScenePlan& scene_plan, const GeometryPlan& plan, const BakeConfig& config)
      : scene_(scene), plan_(plan), config_(config), slots_(plan.slot_class.size()) {
    for (const uint32_t run : plan.material_runs)
      for (size_t slot = 0; slot < slots_.size(); ++slot)
        add_material(slots_[slot], scene.materials[scene_plan.material_slots[run + slot]]);
  }

  GeometryNeeds run() {
    GeometryNeeds needs;
    Vec2 largest(0.0f);
    bool on_request = false;
    for (const GeometryPart& part : plan_.parts) {
      const Mesh& mesh = scene_.meshes[part.mesh];
      if (mesh.triangles.empty()) { // if all meshes are empty, there are no slots
        needs.parts.emplace_back();
        continue;
      }
      SlotNeeds& slot = slots_[part.slot];
      needs.parts.push_back(needs_of(mesh, slot));
      const PartNeeds& part_needs = needs.parts.back();
      if (!part_needs.store_uvs()) continue;
      largest = glm::max(largest, max_abs_uv(mesh));
      slot.stores_uvs = true;
      on_request |= part_needs.uvs == baked::kOnRequest;
    }
    std::vector<LookUp> look_ups;
    if (on_request) look_ups.push_back(kAssumedLookUp);
    for (const SlotNeeds& slot : slots_)
      if (slot.stores_uvs) look_ups.insert(look_ups.end(), slot.look_ups.begin(), slot.look_ups.end());
    for (size_t i = 0; i < look_ups.size(); ++i)
      for (int axis = 0; axis < 2; ++axis) {
        const auto a = static_cast<size_t>(axis);
        const float scale = look_ups[i].uv_scale[axis];
        const int32_t exponent = choose_uv_exponent(look_ups[i].size[a], scale, largest[axis]);
        needs.uv_exponent[a] = i == 0 ? exponent : std::min(needs.uv_exponent[a], exponent);
        if (!look_ups[i].stored) continue;
        needs.texels_per_uv[a] = std::max(needs.texels_per_uv[a], std::abs(double{scale}) * look_ups[i].size[a]);
      }
    return needs;
  }

private:
  bool shading() const { return config_.purpose == baked::kShading; }

  void add_material(SlotNeeds& slot, const Material& material) const {
    slot.flags |= material.flags;
    const auto add = [&](const auto& all, uint32_t number, const char* what) {
      if (number >= all.size())
        throw Error(ErrorKind::kInput,
                    std::string("invalid scene: ") + what + " of material " + material.name + " does not exist");
      slot.look_ups.push_back({{all[number].width, all[number].height}, all[number].uv_scale});
    };
    if ((material.flags & kAlphaMask) != 0) add(scene_.masks, material.alpha_mask, "an alpha mask");
    if ((material.flags & kShadowAlphaMask) != 0) add(scene_.masks, material.shadow_alpha_mask, "an alpha mask");
    if (!shading()) return;
    if (config_.textures && material.albedo_texture != kNoTexture) {
      add(scene_.textures, material.albedo_texture, "the texture");
      slot.textured = true;
    } else if (!config_.textures && (material.flags & kAlbedoTexture) != 0) {
      slot.look_ups.push_back(kAssumedLookUp);
      slot.textured = true;
    }
    if ((material.flags & kNormalMap) != 0) slot.look_ups.push_back(kAssumedLookUp);
  }

  PartNeeds needs_of(const Mesh& mesh, const SlotNeeds& slot) const {
    PartNeeds needs;
    if (!mesh.normals.empty())
      needs.normals = config_.keep_normals         ? baked::kOnRequest
                      : camera_visible(slot.flags) ? baked::kForShading
                                                   : baked::kUnused;
    if (needs_mask(slot.flags)) // even without UVs in the source: then (0, 0) is looked up
      needs.uvs = baked::kForMask;
    else if (!mesh.uvs.empty())
      needs.uvs = config_.keep_uvs                              ? baked::kOnRequest
                  : slot.textured                               ? baked::kForTexture
                  : shading() && (slot.flags & kNormalMap) != 0 ? baked::kForNormalMap
                                                                : baked::kUnused;
    if ((slot.flags & kNormalMap) != 0 && !mesh.uvs.empty())
      needs.tangents = shading() ? baked::kForNormalMap : baked::kUnused;
    return needs;
  }

  const Scene& scene_;
  const GeometryPlan& plan_;
  const BakeConfig& config_;
  std::vector<SlotNeeds> slots_;
};

} // namespace

GeometryNeeds analyse_requirements(const Scene& scene, const ScenePlan& scene_plan, const GeometryPlan& plan,
                                   const BakeConfig& config) {
  return Analysis(scene, scene_plan, plan, config).run();
}

} // namespace packtrace
