#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json_fwd.hpp>

#include "runtime/denoise/denoiser_config.h"

namespace packtrace {

/// Adds --denoiser, --denoiser-set and --no-denoise. The strings must outlive the verb.
/// @param denoiser in: the default; out: "ours", "reference" or "off"
/// @param settings out: words of the form NAME=VALUE
void add_denoiser_options(CLI::App& verb, std::string& denoiser, std::vector<std::string>& settings);

/// The configuration of the two options; the default one with "off". Throws Error(kUsage) for unknown names,
/// values that are not allowed, and settings of a denoiser that is off.
DenoiserConfig denoiser_config(const std::string& denoiser, const std::vector<std::string>& settings);

/// Lists the settings of all denoisers with ranges and defaults, for the end of a help text.
std::string denoiser_settings_help();

/// The "denoiser" value of reports: the preset, and the settings that differ from their defaults.
nlohmann::json denoiser_json(bool denoise, const DenoiserConfig& config);

} // namespace packtrace
