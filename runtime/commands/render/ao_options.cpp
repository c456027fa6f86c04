#include "runtime/commands/render/ao_options.h"

#include <fmt/format.h>

#include "pbrt_import/base/error.h"
#include "runtime/commands/cli/option_checks.h"
#include "runtime/frame/frame_settings.h"

namespace packtrace {

CLI::Option* add_word_option(CLI::App& verb, std::string_view name, std::string& value) {
  const WordSetting& setting = word_setting(name);
  return verb.add_option(fmt::format("--{}", name), value, fmt::format("{} (default {})", setting.help, value))
      ->check(one_of({setting.words.begin(), setting.words.end()}))
      ->default_str(value);
}

void add_ao_options(CLI::App& verb, AoOptions& options) {
  add_word_option(verb, "ao-resolution", options.resolution);
  add_word_option(verb, "ao-rate", options.rate);
  verb.add_option(
          "--ao-radius", options.radius,
          "Distance up to which surfaces occlude, in world units (default: 10 % of the scene's diagonal). Small "
          "radii darken creases only, large ones whole rooms")
      ->type_name("R");
  verb.add_flag("--ao-no-falloff", options.no_falloff,
                "Let every hit within the radius occlude fully, instead of fading with its distance");
  verb.add_option("--ao-interreflection", options.interreflection,
                  "Fraction of light that occluding surfaces reflect, 0..1 (default 0, off). Brightens creases between "
                  "light surfaces")
      ->type_name("RHO");
  add_word_option(verb, "ao-sampler", options.sampler);
  verb.add_option("--ao-set", options.settings,
                  "Change a setting of ambient occlusion; repeat the option for several. Names, ranges and defaults: "
                  "docs/ambient_occlusion.md")
      ->type_name("NAME=VALUE")
      ->allow_extra_args(false);
}

void apply(const AoOptions& options, FrameConfig& config) {
  word_setting("ao-resolution").set(config, options.resolution); // the options' checks accept only known words
  word_setting("ao-rate").set(config, options.rate);
  word_setting("ao-sampler").set(config, options.sampler);
  if (options.radius && !(*options.radius > 0.0f))
    throw Error(ErrorKind::kUsage, fmt::format("--ao-radius {}: must be a positive number", *options.radius));
  config.ao.radius = options.radius.value_or(0.0f);
  config.ao.falloff = !options.no_falloff;
  config.ao.interreflection = options.interreflection.value_or(config.ao.interreflection);
  for (const std::string& setting : options.settings)
    assign_setting(ao_settings(), setting, config.ao, "ambient occlusion");
}

} // namespace packtrace
