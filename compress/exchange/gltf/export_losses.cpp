#include "compress/exchange/gltf/export_losses.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

#include "pbrt_import/scene/material_flags.h"

namespace packtrace {
namespace {

/// Whether the screen window is off-centre.
bool is_shifted(const Camera& camera) {
  if (!camera.screen_window) return false;
  constexpr double kTolerance = 1e-6; // of the window's size
  const glm::dvec4& w = *camera.screen_window;
  return std::abs(w.x + w.y) > kTolerance * std::abs(w.y - w.x) ||
         std::abs(w.z + w.w) > kTolerance * std::abs(w.w - w.z);
}

/// Whether a surface has shading parameters besides its colour and material flags.
bool has_parameters(const SurfaceShading& s) {
  return s.specular != Vec3(0.0f) || s.emits() || s.transmits() || s.roughness != 0.0f || s.sigma != 0.0f ||
         s.metal_k != Vec3(0.0f);
}

class Finder {
public:
  Finder(const BakedFile& file, ExportFormat format, const GltfKeeps& gltf)
      : file_(file), format_(format), gltf_(gltf), is_gltf_(format == ExportFormat::kGltf),
        is_pbrt_(format == ExportFormat::kPbrt), is_obj_(format == ExportFormat::kObj) {}

  std::vector<ExportLoss> run() {
    add_materials();
    add_images();
    if (file_.has_shading()) {
      const ShadingData shading = file_.shading();
      add("surface_parameters", "materials lose their reflectance, roughness or strength of emission",
          static_cast<uint64_t>(std::ranges::count_if(shading.materials, has_parameters)));
      add("lights", "light sources that are not surfaces were left out", shading.lights.size());
    }
    add_cameras();
    if (!is_gltf_ || !gltf_.levels)
      add("levels", "levels of detail of geometries were left out",
          file_.geometries().size() - file_.base_geometry_count());
    if (is_obj_)
      add("expanded_instances", "instances became triangles",
          static_cast<uint64_t>(std::ranges::count_if(file_.instances(), [&](const baked::InstanceRecord& instance) {
            return (file_.geometries()[instance.geometry].flags & baked::kWorldSpace) == 0;
          })));
    return std::move(losses_);
  }

private:
  void add(std::string_view key, std::string_view what, uint64_t count) {
    if (count > 0) losses_.push_back({key, what, count});
  }

  uint64_t materials_with(const std::function<bool(const baked::MaterialRecord&)>& property) const {
    return static_cast<uint64_t>(std::ranges::count_if(file_.sections().materials, property));
  }

  void add_materials() {
    if (format_ == ExportFormat::kStreams) return; // which hold the flags
    const auto flagged = [&](MaterialFlags flag) {
      return materials_with([flag](const baked::MaterialRecord& m) { return (m.flags & flag) != 0; });
    };
    add("normal_maps", "materials lose the flag that they have a normal or bump map", flagged(kNormalMap));
    if (is_gltf_ && !gltf_.transmission)
      add("blended_materials", "transmitting materials blend instead, without their image", flagged(kTransmissive));
    if (is_pbrt_) return add("instanced_lights", "materials of objects lose their emission", emissive_in_objects());
    add("shadow_masks", "masks for occlusion rays only were left out", materials_with([](const auto& m) {
          const bool same = (m.flags & kAlphaMask) != 0 && m.alpha_mask == m.shadow_alpha_mask;
          return (m.flags & kShadowAlphaMask) != 0 && m.shadow_alpha_mask != baked::kNone && !same;
        }));
    add("invisible_materials", "materials that only occlude became visible", flagged(kInvisible));
    add("unshadowing_materials", "materials that do not occlude now do", flagged(kNoShadow));
  }

  uint64_t emissive_in_objects() const {
    std::set<uint32_t> found;
    for (uint32_t i = 0; i < file_.instances().size(); ++i)
      if ((file_.geometries()[file_.instances()[i].geometry].flags & baked::kWorldSpace) == 0)
        for (const uint32_t material : file_.instance_materials(i))
          if ((file_.sections().materials[material].flags & kEmissive) != 0) found.insert(material);
    return found.size();
  }

  void add_images() {
    if (is_gltf_ || is_obj_) {
      const auto black = [](uint32_t wrap) { return static_cast<WrapMode>(wrap) == WrapMode::kBlack; };
      uint64_t count = 0;
      for (const baked::TextureRecord& texture : file_.sections().textures) count += black(texture.wrap);
      for (const baked::MaskRecord& mask : file_.sections().masks) count += black(mask.wrap);
      add("black_borders", "images with black around them repeat their border instead", count);
    }
    if (is_pbrt_ || is_obj_)
      add("image_names", "images have numbers instead of their names",
          static_cast<uint64_t>(std::ranges::count_if(file_.sections().textures,
                                                      [](const baked::TextureRecord& t) { return t.name.bytes > 0; })));
    if (format_ == ExportFormat::kStreams)
      add("images", "images and masks were left out", file_.sections().textures.size() + file_.sections().masks.size());
  }

  void add_cameras() {
    const std::vector<Camera> cameras = file_.cameras();
    if (is_gltf_) {
      add("shifted_windows", "cameras lost the shift of their window",
          static_cast<uint64_t>(std::ranges::count_if(cameras, [](const Camera& camera) {
            return camera.projection != Projection::kEnvironment && is_shifted(camera);
          })));
      return; // GltfReport::skipped_cameras counts those that are left out
    }
    const uint64_t kept = is_pbrt_ ? 1 : 0;
    add("cameras", "cameras were left out", cameras.size() - std::min<uint64_t>(cameras.size(), kept));
  }

  const BakedFile& file_;
  const ExportFormat format_;
  const GltfKeeps gltf_;
  const bool is_gltf_, is_pbrt_, is_obj_;
  std::vector<ExportLoss> losses_;
};

} // namespace

std::vector<ExportLoss> find_losses(const BakedFile& file, ExportFormat format, const GltfKeeps& gltf) {
  return Finder(file, format, gltf).run();
}

} // namespace packtrace
