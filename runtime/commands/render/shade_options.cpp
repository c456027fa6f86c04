#include "runtime/commands/render/shade_options.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pbrt_import/base/error.h"
#include "runtime/commands/cli/option_checks.h"
#include "runtime/commands/render/ao_options.h"
#include "runtime/frame/ao_names.h"

namespace packtrace {

void add_shade_options(CLI::App& verb, ShadeOptions& options) {
  constexpr const char* kGroup = "Shading";
  verb.add_option("--view", options.view,
                  "What to render. ao is ambient occlusion; pbr is shaded with the scene's materials and lights, with "
                  "reflections and glass; pbr+ao lets occlusion darken its ambient light. A .ptk file must be baked "
                  "with --for shading. voxels shows the proxies of a .ptk file, baked with --proxy voxels; sdf its "
                  "distance fields (default ao)")
      ->check(one_of({"ao", "pbr", "pbr+ao", "voxels", "sdf"}))
      ->default_str(options.view)
      ->group(kGroup);
  verb.add_option("--exposure", options.exposure,
                  "Exposure of shaded .png files in stops, -32..32 (default 0): each doubles the brightness")
      ->check(CLI::Range(-32.0f, 32.0f))
      ->type_name("STOPS")
      ->group(kGroup);
  add_word_option(verb, "tone-map", options.tone_map)->group(kGroup);
  verb.add_option("--shade-set", options.settings,
                  "Change a setting of shading; repeat the option for several. Names, ranges and defaults: "
                  "docs/shading.md")
      ->type_name("NAME=VALUE")
      ->allow_extra_args(false)
      ->group(kGroup);
}

void apply(const ShadeOptions& options, FrameConfig& config) {
  config.view = options.view == "pbr" ? FrameView::kPbr : options.shades() ? FrameView::kPbrAo : FrameView::kAo;
  for (const std::string& setting : options.settings)
    assign_setting(shade_settings(), setting, config.shade, "shading");
  config.tone_map = exposure(options).curve, config.exposure = options.exposure;
  if (options.shades()) return;
  const char* const option = !options.settings.empty()    ? "--shade-set"
                             : options.exposure != 0.0f   ? "--exposure"
                             : options.tone_map != "srgb" ? "--tone-map"
                                                          : nullptr;
  if (option) throw Error(ErrorKind::kUsage, fmt::format("{} requires --view pbr or pbr+ao", option));
}

Exposure exposure(const ShadeOptions& options) {
  return {value_of(kToneMapNames, options.tone_map, "tone-map"), options.exposure};
}

void add_shade_json(const ShadeOptions& options, const PictureReport& report, const FrameLoop& loop,
                    nlohmann::json& result) {
  result["view"] = options.view;
  if (!options.shades() || loop.shade_scene() == nullptr) return;
  const LightSet& lights = loop.shade_scene()->lights();
  const double seconds = report.times.shade_s;
  result["rays"]["shade"] = report.shade_rays;
  result["seconds"]["shade"] = seconds;
  result["mrays_per_s"]["shade"] = seconds > 0.0 ? static_cast<double>(report.shade_rays) / seconds / 1e6 : 0.0;
  result["lights"] = {{"count", lights.uses_sky() ? 0 : lights.light_count()},
                      {"triangles", lights.triangle_count()},
                      {"default_sky", lights.uses_sky()}};
}

std::string shade_text(const nlohmann::json& result) {
  if (!result.contains("lights")) return {};
  const nlohmann::json& lights = result.at("lights");
  std::string text =
      fmt::format("  shade     {:8.3f} s   {:.1f} Mrays/s; {} light{}, {} emitting triangle{}\n",
                  result.at("seconds").at("shade").get<double>(), result.at("mrays_per_s").at("shade").get<double>(),
                  lights.at("count").get<uint64_t>(), lights.at("count") == 1 ? "" : "s",
                  lights.at("triangles").get<uint64_t>(), lights.at("triangles") == 1 ? "" : "s");
  if (lights.at("default_sky").get<bool>())
    text += fmt::format("the scene has no lights: a white sky of radiance {} lights it\n", kDefaultSky);
  return text;
}

} // namespace packtrace
