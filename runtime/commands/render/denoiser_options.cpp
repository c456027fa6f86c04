#include "runtime/commands/render/denoiser_options.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pbrt_import/base/error.h"
#include "runtime/commands/render/ao_options.h"

namespace packtrace {
namespace {

const char* preset_name(DenoiserKind kind) { return kind == DenoiserKind::kOurs ? "ours" : "reference"; }

} // namespace

void add_denoiser_options(CLI::App& verb, std::string& denoiser, std::vector<std::string>& settings) {
  CLI::Option* kind = add_word_option(verb, "denoiser", denoiser);
  verb.add_flag_callback(
          "--no-denoise", [&denoiser] { denoiser = "off"; }, "The same as --denoiser off")
      ->excludes(kind);
  verb.add_option("--denoiser-set", settings,
                  "Change a setting of the denoiser; repeat the option for several. packtrace help denoise "
                  "lists names, ranges and defaults")
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

std::string denoiser_settings_help() {
  std::string text;
  for (const DenoiserKind kind : {DenoiserKind::kOurs, DenoiserKind::kReference}) {
    DenoiserConfig config;
    config.kind = kind;
    text += fmt::format("Settings of --denoiser {} (--denoiser-set NAME=VALUE):\n", preset_name(kind));
    for (const SettingView& setting : denoiser_settings(config))
      text += fmt::format("  {}  {}, default {}\n      {}\n", setting.info.name,
                          setting.is_switch ? "on or off" : setting_range(setting.info),
                          setting.is_switch ? (setting.default_value != 0.0 ? "on" : "off")
                                            : setting_text(setting.default_value),
                          setting.info.help);
  }
  return text;
}

nlohmann::json denoiser_json(bool denoise, const DenoiserConfig& config) {
  nlohmann::json changed = nlohmann::json::object();
  if (denoise)
    for (const SettingView& setting : denoiser_settings(config))
      if (setting.value != setting.default_value)
        changed[std::string(setting.info.name)] = std::stod(setting_text(setting.value)); // the float's digits
  return {{"preset", denoise ? preset_name(config.kind) : "off"}, {"changed", changed}};
}

} // namespace packtrace
