#include "runtime/commands/ao_options.h"

#include <array>
#include <utility>

#include <fmt/format.h>

#include "pbrt_import/base/error.h"
#include "runtime/commands/option_checks.h"

namespace packtrace {
namespace {

constexpr std::array<std::pair<const char*, SamplerKind>, 5> kSamplers{{{"net", SamplerKind::kSpaceTimeNet},
                                                                        {"sobol", SamplerKind::kPixelSobol},
                                                                        {"jitter", SamplerKind::kMultiJitter},
                                                                        {"lattice", SamplerKind::kLattice},
                                                                        {"independent", SamplerKind::kIndependent}}};

void add_rate_options(CLI::App& verb, AoOptions& options) {
  verb.add_option("--ao-resolution", options.resolution,
                  "Pixels for which ambient occlusion is traced. quarter traces one of 2 x 2 pixels, a quarter of the "
                  "rays, and interpolates the others along surfaces; about four times as fast, with softer contact "
                  "shadows (default full)")
      ->check(one_of({"full", "quarter"}))
      ->default_str(options.resolution);
  verb.add_option("--ao-rate", options.rate,
                  "Samples of a pixel and frame. full is --spp for all; checkerboard traces every other pixel, "
                  "alternating from frame to frame, half of the rays; adaptive gives more to surfaces that came into "
                  "view lately and fewer to others, --spp on average (default full)")
      ->check(one_of({"full", "checkerboard", "adaptive"}))
      ->default_str(options.rate);
}

} // namespace

void add_ao_options(CLI::App& verb, AoOptions& options) {
  add_rate_options(verb, options);
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
  verb.add_option("--ao-sampler", options.sampler,
                  "Sample pattern. net is stratified over pixels and frames, sobol over frames; jitter takes 83 "
                  "multi-jittered sets, lattice a lattice over the pixels; independent is random (default net)")
      ->check(one_of({"net", "sobol", "jitter", "lattice", "independent"}))
      ->default_str(options.sampler);
  verb.add_option("--ao-set", options.settings,
                  "Change a setting of ambient occlusion; repeat the option for several. Names, ranges and defaults: "
                  "docs/ambient_occlusion.md")
      ->type_name("NAME=VALUE")
      ->allow_extra_args(false);
}

void apply(const AoOptions& options, FrameConfig& config) {
  if (options.resolution == "quarter") config.ao_resolution = AoResolution::kQuarter;
  if (options.rate == "checkerboard") config.ao_rate = AoRate::kCheckerboard;
  if (options.rate == "adaptive") config.ao_rate = AoRate::kAdaptive;
  for (const auto& [name, kind] : kSamplers)
    if (options.sampler == name) config.ao.sampler = kind;
  if (options.radius && !(*options.radius > 0.0f))
    throw Error(ErrorKind::kUsage, fmt::format("--ao-radius {}: must be a positive number", *options.radius));
  config.ao.radius = options.radius.value_or(0.0f);
  config.ao.falloff = !options.no_falloff;
  config.ao.interreflection = options.interreflection.value_or(config.ao.interreflection);
  for (const std::string& setting : options.settings)
    assign_setting(ao_settings(), setting, config.ao, "ambient occlusion");
}

} // namespace packtrace
