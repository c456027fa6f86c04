#include "runtime/view/layer_previews.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "pbrt_import/scene/material_flag_names.h"
#include "runtime/image/false_color.h"
#include "runtime/image/legend.h"
#include "runtime/image/painted.h"
#include "runtime/view/layers.h"

namespace packtrace {
namespace {

/// Applies the sRGB transfer to linear colours.
Image display_picture(ImageSize size, const std::vector<Vec3>& linear) {
  return painted(size, [&](size_t i) {
    Vec3 encoded;
    for (int k = 0; k < 3; ++k) encoded[k] = srgb_from_linear(std::clamp(linear[i][k], 0.0f, 1.0f));
    return encoded;
  });
}

/// The radiance of a shaded layer; null for other layers.
const std::vector<Vec3>* radiance_of(const RenderedImage& image, const std::string& aov) {
  if (aov == "pbr") return &image.pbr;
  if (aov == "direct") return &image.direct;
  return aov == "specular" ? &image.specular : nullptr;
}

Image exposed_picture(ImageSize size, const std::vector<Vec3>& radiance, const Exposure& exposure) {
  return painted(size, [&](size_t i) { return display_of_radiance(radiance[i], exposure); });
}

float longest_motion(const RenderedImage& image) {
  std::vector<float> lengths;
  lengths.reserve(image.motion.size());
  for (const Vec2& motion : image.motion) lengths.push_back(glm::length(motion));
  return scale_end(lengths);
}

/// The values of a layer of depths; null for other layers.
const std::vector<float>* depths_of(const RenderedImage& image, const std::string& aov) {
  return aov == "depth" ? &image.depth : aov == "previous_depth" ? &image.previous_depth : nullptr;
}

/// Returns the picture of a layer without background.
Image plain_preview(const RenderedImage& image, const std::string& aov) {
  if (aov == "ao") return ao_preview(image.size, image.ao);
  if (aov == "ao_raw") return ao_preview(image.size, image.ao_raw);
  if (const std::vector<float>* depth = depths_of(image, aov)) return depth_preview(image.size, *depth);
  if (aov == "normal") return normal_preview(image.size, image.normal);
  if (aov == "instance") return id_preview(image.size, image.instance);
  if (aov == "cluster") return id_preview(image.size, image.cluster);
  if (aov == "material_flags") return id_preview(image.size, image.material_flags);
  if (aov == "lod") return level_preview(image.size, image.lod, image.cluster, image.ao);
  if (aov == "lod-error") return heat_map(image.size, image.lod_error, static_cast<float>(image.max_lod_error_px));
  if (aov == "motion") return vector_preview(image.size, image.motion, longest_motion(image));
  if (const std::vector<float>* view = view_of(image, aov)) return scalar_preview(image.size, *view, scale_end(*view));
  return display_picture(image.size, aov == "albedo" ? image.albedo : image.shaded);
}

Legend depth_legend(const char* title, const std::vector<float>& depths) {
  const DepthRange range = depth_preview_range(depths);
  const double ratio =
      range.nearest > 0.0f ? static_cast<double>(range.farthest) / static_cast<double>(range.nearest) : 1;
  return {title, depth_preview_color, even_ticks([&](float t) {
            return static_cast<double>(range.nearest) * std::pow(ratio, static_cast<double>(t));
          })};
}

Legend level_legend(const RenderedImage& image) {
  uint32_t coarsest = 0;
  for (size_t i = 0; i < image.lod.size(); ++i)
    if (image.coverage[i] > 0.0f) coarsest = std::max(coarsest, image.lod[i]);
  constexpr uint32_t kLastColor = 8; // last level with its own level_color()
  std::vector<std::pair<Vec3, std::string>> bands;
  for (uint32_t level = 0; level <= std::min(coarsest, kLastColor); ++level)
    bands.emplace_back(level_color(level), level < kLastColor ? std::to_string(level) : "8+");
  return banded_legend("level of detail, 0 is the finest", bands);
}

Legend error_legend(double max_error_px) {
  return {"bound of the error, pixels", heat_color,
          even_ticks([&](float t) { return max_error_px * static_cast<double>(t); })};
}

Legend motion_legend(const RenderedImage& image) {
  return {fmt::format("direction of the motion; full colour from {:.3g} pixels on", longest_motion(image)),
          direction_color,
          {{0.0f, "right"}, {0.25f, "down"}, {0.5f, "left"}, {0.75f, "up"}, {1.0f, "right"}}};
}

/// The combinations of flags that cover most pixels.
Legend flags_legend(const RenderedImage& image) {
  constexpr size_t kMaxBands = 6;
  std::map<uint32_t, size_t> pixels;
  for (size_t i = 0; i < image.material_flags.size(); ++i)
    if (image.coverage[i] > 0.0f) ++pixels[image.material_flags[i]];
  std::vector<std::pair<uint32_t, size_t>> sorted(pixels.begin(), pixels.end());
  std::ranges::stable_sort(sorted, std::greater<>(), &std::pair<uint32_t, size_t>::second);
  sorted.resize(std::min(sorted.size(), kMaxBands));
  if (sorted.empty()) sorted.emplace_back(0, 0);
  std::vector<std::pair<Vec3, std::string>> bands;
  for (const auto& [flags, count] : sorted) bands.emplace_back(id_color(flags), material_flag_words(flags));
  return banded_legend("material flags", bands);
}

/// The legend of a view that is one number per pixel.
Legend view_legend(const std::string& aov, const std::vector<float>& values) {
  static const std::map<std::string, const char*> kTitles{
      {"hit_distance", "mean distance of hits, scene units"},
      {"local_variance", "variance of the samples in 7 x 7 pixels"},
      {"variance", "variance of the mean occlusion"},
      {"history", "history, frames"},
      {"disocclusion", "1: the history began with the last movement"},
      {"visited_nodes", "nodes that a camera ray visits"},
      {"visited_leaves", "leaves that a camera ray visits"},
      {"tested_triangles", "triangles that a camera ray tests"}};
  const auto end = static_cast<double>(scale_end(values));
  return {kTitles.at(aov), scalar_color, even_ticks([end](float t) { return end * static_cast<double>(t); })};
}

} // namespace

const std::vector<float>* view_of(const RenderedImage& image, const std::string& aov) {
  if (aov == "hit_distance") return &image.hit_distance;
  if (aov == "previous_depth") return &image.previous_depth;
  if (aov == "local_variance") return &image.local_variance;
  if (aov == "variance") return &image.variance;
  if (aov == "history") return &image.history;
  if (aov == "visited_nodes") return &image.visited_nodes;
  if (aov == "visited_leaves") return &image.visited_leaves;
  if (aov == "tested_triangles") return &image.tested_triangles;
  return aov == "disocclusion" ? &image.disocclusion : nullptr;
}

Image layer_preview(const RenderedImage& image, const std::string& aov, const PreviewStyle& style) {
  if (const std::vector<Vec3>* radiance = radiance_of(image, aov)) {
    const Image exposed = exposed_picture(image.size, *radiance, style.exposure);
    return style.background ? over_background(exposed, image.coverage, *style.background) : exposed;
  }
  const bool picture = aov == "albedo" || aov == "shaded";
  const Background usual =
      picture ? Background{Background::Kind::kSky, Vec3(0)} : Background{Background::Kind::kColor, kDefaultBackground};
  Image preview = plain_preview(image, aov);
  if (!has_cost_layer({aov}))
    preview = over_background(std::move(preview), image.coverage, style.background.value_or(usual));
  if (!style.legend) return preview;
  if (const std::vector<float>* depths = depths_of(image, aov))
    return with_legend(
        preview,
        depth_legend(aov == "depth" ? "depth, scene units" : "depth in the previous picture, scene units", *depths));
  if (aov == "lod") return with_legend(preview, level_legend(image));
  if (aov == "lod-error") return with_legend(preview, error_legend(image.max_lod_error_px));
  if (aov == "motion") return with_legend(preview, motion_legend(image));
  if (aov == "material_flags") return with_legend(preview, flags_legend(image));
  if (const std::vector<float>* view = view_of(image, aov)) return with_legend(preview, view_legend(aov, *view));
  return preview;
}

} // namespace packtrace
