#include "runtime/view/layers.h"

#include <algorithm>
#include <array>
#include <span>

#include "pbrt_import/base/error.h"
#include "runtime/frame/surface_layers.h"
#include "runtime/frame/view_layers.h"
#include "runtime/view/layer_previews.h"

namespace packtrace {
namespace {

constexpr std::array kBaseLayers{"ao", "ao_raw", "depth", "normal", "instance", "albedo", "shaded"};
/// Layers that need LOD levels.
constexpr std::array kLodLayers{"lod", "lod-error"};

/// Layers of shaded images.
constexpr std::array kShadedLayers{"pbr", "direct", "specular"};

bool contains(const auto& names, const std::string& name) { return std::ranges::find(names, name) != names.end(); }

/// The layers of the result itself.
std::vector<std::string> result_layers(AvailableLayers available) {
  std::vector<std::string> names(kBaseLayers.begin(), kBaseLayers.end());
  if (available.shaded) names.insert(names.begin(), kShadedLayers.begin(), kShadedLayers.end());
  if (available.levels) names.insert(names.end(), kLodLayers.begin(), kLodLayers.end());
  return names;
}

std::span<const float> motion_floats(const std::vector<Vec2>& vectors) {
  static_assert(sizeof(Vec2) == 2 * sizeof(float));
  return {vectors.empty() ? nullptr : &vectors[0].x, vectors.size() * 2};
}

std::span<const float> floats_of(const std::vector<Vec3>& vectors) {
  static_assert(sizeof(Vec3) == 3 * sizeof(float));
  return {vectors.empty() ? nullptr : &vectors[0].x, vectors.size() * 3};
}

} // namespace

Layer exr_layer(const RenderedImage& image, const std::string& aov) {
  const std::vector<std::string> xyz{"X", "Y", "Z"}, rgb{"R", "G", "B"};
  if (aov == "ao") return {aov, {""}, std::span<const float>(image.ao)};
  if (aov == "ao_raw") return {aov, {""}, std::span<const float>(image.ao_raw)};
  if (aov == "depth") return {aov, {""}, std::span<const float>(image.depth)};
  if (aov == "normal") return {aov, xyz, floats_of(image.normal), true};
  if (aov == "instance") return {aov, {""}, std::span<const uint32_t>(image.instance)};
  if (aov == "lod") return {aov, {""}, std::span<const uint32_t>(image.lod)};
  if (aov == "material_flags") return {aov, {""}, std::span<const uint32_t>(image.material_flags)};
  if (aov == "cluster") return {aov, {""}, std::span<const uint32_t>(image.cluster)};
  if (aov == "lod-error") return {aov, {""}, std::span<const float>(image.lod_error)};
  if (aov == "motion") return {aov, {"X", "Y"}, motion_floats(image.motion)};
  if (const std::vector<float>* view = view_of(image, aov)) return {aov, {""}, std::span<const float>(*view)};
  if (aov == "pbr") return {aov, rgb, floats_of(image.pbr)};
  if (aov == "direct") return {aov, rgb, floats_of(image.direct)};
  if (aov == "specular") return {aov, rgb, floats_of(image.specular)};
  if (aov == "albedo") return {aov, rgb, floats_of(image.albedo), true};
  return {aov, rgb, floats_of(image.shaded), true};
}

std::vector<std::string> chosen_layers(const std::vector<std::string>& aovs, AvailableLayers available) {
  if (aovs.empty()) return {available.shaded ? "pbr" : "ao"};
  if (contains(aovs, "all")) {
    std::vector<std::string> names = result_layers(available);
    if (available.views) {
      names.insert(names.end(), kTracedViews.begin(), kTracedViews.end());
      names.insert(names.end(), kSurfaceLayers.begin(), kSurfaceLayers.end());
    }
    if (available.denoiser) names.insert(names.end(), kDenoiserViews.begin(), kDenoiserViews.end());
    return names;
  }
  std::vector<std::string> unique;
  for (const std::string& name : aovs) {
    if (!contains(aov_names(), name)) {
      std::string known = "all";
      for (const std::string& aov : aov_names()) known += ", " + aov;
      throw Error(ErrorKind::kUsage, "--aov " + name + ": no such layer; layers are " + known);
    }
    if (!contains(unique, name)) unique.push_back(name);
  }
  return unique;
}

std::vector<std::string> chosen_exr_layers(const std::vector<std::string>& aovs, AvailableLayers available) {
  return aovs.empty() ? result_layers(available) : chosen_layers(aovs, available);
}

bool has_denoiser_layer(const std::vector<std::string>& layers) {
  return std::ranges::any_of(layers, [](const std::string& layer) { return contains(kDenoiserViews, layer); });
}

bool has_view_layer(const std::vector<std::string>& layers) {
  return has_denoiser_layer(layers) ||
         std::ranges::any_of(layers, [](const std::string& layer) { return contains(kTracedViews, layer); });
}

uint32_t plain_layers_of(const std::string& layer) {
  static constexpr std::array<std::pair<const char*, PlainLayer>, 6> kLayers{{{"ao_raw", kAoRawLayer},
                                                                              {"depth", kDepthLayer},
                                                                              {"normal", kNormalLayer},
                                                                              {"albedo", kAlbedoLayer},
                                                                              {"shaded", kShadedLayer},
                                                                              {"instance", kInstanceLayer}}};
  for (const auto& [name, bit] : kLayers)
    if (layer == name) return bit;
  return 0;
}

bool has_shaded_layer(const std::vector<std::string>& layers) {
  return std::ranges::any_of(layers, [](const std::string& layer) { return contains(kShadedLayers, layer); });
}

bool has_surface_layer(const std::vector<std::string>& layers) {
  return std::ranges::any_of(layers, [](const std::string& layer) { return contains(kSurfaceLayers, layer); });
}

bool has_cost_layer(const std::vector<std::string>& layers) {
  return std::ranges::any_of(layers, [](const std::string& layer) { return contains(kCostLayers, layer); });
}

bool has_lod_layer(const std::vector<std::string>& layers) {
  return std::ranges::any_of(layers, [](const std::string& layer) { return contains(kLodLayers, layer); });
}

const std::vector<std::string>& aov_names() {
  static const std::vector<std::string> kNames = [] {
    std::vector<std::string> names(kBaseLayers.begin(), kBaseLayers.end());
    names.insert(names.end(), kShadedLayers.begin(), kShadedLayers.end());
    names.insert(names.end(), kTracedViews.begin(), kTracedViews.end());
    names.insert(names.end(), kDenoiserViews.begin(), kDenoiserViews.end());
    names.insert(names.end(), kSurfaceLayers.begin(), kSurfaceLayers.end());
    names.insert(names.end(), kCostLayers.begin(), kCostLayers.end());
    names.insert(names.end(), kLodLayers.begin(), kLodLayers.end());
    return names;
  }();
  return kNames;
}

} // namespace packtrace
