#include "pbrt_import/language/material_parameters.h"

#include <algorithm>
#include <iterator>

namespace packtrace {

std::span<const std::string_view> parameter_names(std::string_view kind) {
  static constexpr std::string_view kMatte[] = {"Kd", "sigma", "bumpmap"};
  static constexpr std::string_view kPlastic[] = {"Kd", "Ks", "roughness", "remaproughness", "bumpmap"};
  static constexpr std::string_view kUber[] = {"Kd",         "Ks",  "Kr",    "Kt",      "roughness",      "uroughness",
                                               "vroughness", "eta", "index", "opacity", "remaproughness", "bumpmap"};
  static constexpr std::string_view kTranslucent[] = {
      "Kd", "Ks", "reflect", "transmit", "roughness", "remaproughness", "bumpmap"};
  static constexpr std::string_view kSubstrate[] = {"Kd",     "Ks", "uroughness", "vroughness", "remaproughness",
                                                    "bumpmap"};
  static constexpr std::string_view kMirror[] = {"Kr", "bumpmap"};
  static constexpr std::string_view kGlass[] = {
      "Kr", "Kt", "eta", "index", "uroughness", "vroughness", "remaproughness", "bumpmap"};
  static constexpr std::string_view kMetal[] = {
      "eta", "k", "roughness", "uroughness", "vroughness", "remaproughness", "bumpmap"};
  static constexpr std::string_view kDisney[] = {"color",        "metallic",       "eta",       "roughness",
                                                 "speculartint", "anisotropic",    "sheen",     "sheentint",
                                                 "clearcoat",    "clearcoatgloss", "spectrans", "scatterdistance",
                                                 "thin",         "flatness",       "difftrans", "bumpmap"};
  static constexpr std::string_view kHair[] = {"sigma_a", "color",  "eumelanin", "pheomelanin",
                                               "eta",     "beta_m", "beta_n",    "alpha"};
  static constexpr std::string_view kSubsurface[] = {
      "name",       "sigma_a",    "sigma_s",        "Kr",     "Kt", "eta", "g", "scale", "roughness",
      "uroughness", "vroughness", "remaproughness", "bumpmap"};
  static constexpr std::string_view kKdSubsurface[] = {
      "Kd",     "mfp", "Kr", "Kt", "eta", "g", "scale", "roughness", "uroughness", "vroughness", "remaproughness",
      "bumpmap"};
  static constexpr std::string_view kFourier[] = {"bsdffile", "bumpmap"};
  static constexpr std::string_view kMix[] = {"amount", "namedmaterial1", "namedmaterial2"};
  struct Entry {
    std::string_view kind;
    std::span<const std::string_view> names;
  };
  static constexpr Entry kEntries[] = {
      {"matte", kMatte},
      {"plastic", kPlastic},
      {"uber", kUber},
      {"translucent", kTranslucent},
      {"substrate", kSubstrate},
      {"mirror", kMirror},
      {"glass", kGlass},
      {"metal", kMetal},
      {"disney", kDisney},
      {"hair", kHair},
      {"subsurface", kSubsurface},
      {"kdsubsurface", kKdSubsurface},
      {"fourier", kFourier},
      {"mix", kMix},
      {"none", {}},
      {"", {}},
  };
  for (const Entry& entry : kEntries)
    if (entry.kind == kind) return entry.names;
  return {};
}

TextureParameters::Kind parameter_kind(std::string_view material, std::string_view name) {
  using Kind = TextureParameters::Kind;
  constexpr std::string_view kSpectra[] = {
      "Kd",      "Ks",      "Kr",  "Kt", "opacity", "reflect", "transmit", "color", "scatterdistance",
      "sigma_a", "sigma_s", "mfp", "k",  "amount"};
  constexpr std::string_view kStrings[] = {"name", "namedmaterial1", "namedmaterial2", "bsdffile"};
  constexpr std::string_view kBools[] = {"remaproughness", "thin"};
  const auto is_in = [&](const auto& names) {
    return std::find(std::begin(names), std::end(names), name) != std::end(names);
  };
  if (is_in(kSpectra) || (name == "eta" && material == "metal")) return Kind::kSpectrum;
  return is_in(kStrings) ? Kind::kString : is_in(kBools) ? Kind::kBool : Kind::kFloat;
}

} // namespace packtrace
