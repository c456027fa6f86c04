#include "runtime/commands/denoiser_options.h"

#include "pbrt_import/base/error.h"
#include "runtime/commands/option_checks.h"

namespace packtrace {

void add_denoiser_options(CLI::App& verb, std::string& denoiser, std::vector<std::string>& settings) {
  CLI::Option* kind = verb.add_option("--denoiser", denoiser,
                                      "Denoiser of ambient occlusion. ours is the default; reference is the pipeline "
                                      "of a public real-time sample, for comparison; off averages the frames")
                          ->check(one_of({"ours", "reference", "off"}))
                          ->default_str(denoiser);
  verb.add_flag_callback(
          "--no-denoise", [&denoiser] { denoiser = "off"; }, "The same as --denoiser off")
      ->excludes(kind);
  verb.add_option("--denoiser-set", settings,
                  "Change a setting of the denoiser; repeat the option for several. Names, ranges and defaults: "
                  "docs/denoiser.md")
      ->type_name("NAME=VALUE")
      ->allow_extra_args(false);
}

DenoiserConfig denoiser_config(const std::string& denoiser, const std::vector<std::string>& settings) {
  DenoiserConfig config;
  if (denoiser == "off" && !settings.empty())
    throw Error(ErrorKind::kUsage, "--denoiser-set changes nothing with --denoiser off");
  if (denoiser == "reference") config.kind = DenoiserKind::kReference;
  for (const std::string& setting : settings) config.set(setting);
  config.validate();
  return config;
}

} // namespace packtrace
