#include "pbrt_import/language/texture_parameters.h"

#include <algorithm>
#include <cmath>

#include "pbrt_import/base/error.h"
#include "pbrt_import/language/spectrum.h"
#include "pbrt_import/text/input_file.h"
#include "pbrt_import/text/tokenizer.h"

namespace packtrace {
namespace {

constexpr std::initializer_list<ParameterType> kSpectrumTypes = {ParameterType::kRgb, ParameterType::kXyz,
                                                                 ParameterType::kBlackbody, ParameterType::kSpectrum};

} // namespace

const Parameter* TextureParameters::find(std::string_view name, std::initializer_list<ParameterType> types) const {
  if (const Parameter* const found = first_.find(name, types)) return found;
  return second_ ? second_->find(name, types) : nullptr;
}

std::optional<TextureParameters::Node> TextureParameters::find_texture(const Parameter& parameter,
                                                                       const ScopedNames& names,
                                                                       const ScopedNames& others,
                                                                       std::string_view kind) const {
  if (parameter.strings.size() != 1) {
    context_.reporter.error(parameter.place, "parameter " + describe(parameter) + " takes the name of one texture");
    return std::nullopt;
  }
  bool unknown_escape = false;
  const std::string name = unescape(parameter.strings[0], unknown_escape);
  if (const std::optional<uint32_t> node = names.find(name)) return node;
  std::string message =
      "no " + std::string(kind) + " texture " + in_quotes(name) + " for parameter " + describe(parameter);
  if (others.find(name))
    message += "; a texture of that name has the other value type, float or spectrum";
  else
    message += did_you_mean(names.closest(name));
  context_.reporter.error(parameter.place, std::move(message));
  return std::nullopt;
}

std::optional<TextureParameters::Node> TextureParameters::find_spectrum(std::string_view name) const {
  if (const Parameter* const texture = find(name, {ParameterType::kTexture}))
    return find_texture(*texture, context_.state.spectrum_textures, context_.state.float_textures, "spectrum");
  const Parameter* const value = find(name, kSpectrumTypes);
  const std::optional<Vec3> rgb = value ? rgb_value(*value) : std::nullopt;
  if (!rgb) return std::nullopt;
  return context_.graph.constant(*rgb);
}

TextureParameters::Node TextureParameters::spectrum(std::string_view name, Vec3 fallback) const {
  const std::optional<Node> node = find_spectrum(name);
  return node ? *node : context_.graph.constant(fallback);
}

std::optional<TextureParameters::Node> TextureParameters::find_float(std::string_view name) const {
  if (const Parameter* const texture = find(name, {ParameterType::kTexture}))
    return find_texture(*texture, context_.state.float_textures, context_.state.spectrum_textures, "float");
  const Parameter* const value = find(name, {ParameterType::kFloat});
  if (!value) return std::nullopt;
  if (value->floats.size() != 1) {
    context_.reporter.error(value->place, "parameter " + describe(*value) + " takes one number, found " +
                                              std::to_string(value->floats.size()) + "; its default is used");
    return std::nullopt;
  }
  if (!std::isfinite(value->floats[0])) {
    context_.reporter.error(value->place, "parameter " + describe(*value) + " is not finite; its default is used");
    return std::nullopt;
  }
  return context_.graph.constant(Vec3(value->floats[0]));
}

TextureParameters::Node TextureParameters::float_texture(std::string_view name, float fallback) const {
  const std::optional<Node> node = find_float(name);
  return node ? *node : context_.graph.constant(Vec3(fallback));
}

Vec3 TextureParameters::constant_spectrum(std::string_view name, Vec3 fallback) const {
  const Parameter* const value = find(name, kSpectrumTypes);
  const std::optional<Vec3> rgb = value ? rgb_value(*value) : std::nullopt;
  return rgb ? *rgb : fallback;
}

std::optional<Vec3> TextureParameters::rgb_value(const Parameter& parameter) const {
  if (!parameter.strings.empty()) return rgb_from_file(parameter);
  const std::span<const float> v = parameter.floats;
  const bool one_value = parameter.type == ParameterType::kSpectrum
                             ? v.size() >= 2
                             : v.size() == (parameter.type == ParameterType::kBlackbody ? 2 : 3);
  if (!one_value) {
    context_.reporter.error(parameter.place,
                            "parameter " + describe(parameter) + " does not hold one colour; its default is used");
    return std::nullopt;
  }
  if (!std::all_of(v.begin(), v.end(), [](float value) { return std::isfinite(value); })) {
    context_.reporter.error(parameter.place,
                            "parameter " + describe(parameter) + " is not finite; its default is used");
    return std::nullopt;
  }
  if (parameter.type == ParameterType::kBlackbody && v[0] <= 0.0f)
    context_.reporter.warning(parameter.place, "parameter " + describe(parameter) +
                                                   " has a temperature that is not above 0 kelvin: it is black");
  Vec3 rgb;
  if (parameter.type == ParameterType::kSpectrum)
    rgb = rgb_from_samples(v);
  else if (parameter.type == ParameterType::kBlackbody)
    rgb = rgb_from_blackbody(v[0], v[1]);
  else
    rgb = parameter.type == ParameterType::kXyz ? rgb_from_xyz({v[0], v[1], v[2]}) : Vec3(v[0], v[1], v[2]);
  if (is_finite(rgb)) return rgb;
  context_.reporter.error(parameter.place,
                          "parameter " + describe(parameter) + " is out of range; its default is used");
  return std::nullopt;
}

std::optional<Vec3> TextureParameters::rgb_from_file(const Parameter& parameter) const {
  const std::filesystem::path path =
      context_.file_names.resolve(parameter.strings[0], parameter.place, context_.reporter);
  if (path.empty()) return std::nullopt;
  try {
    constexpr uint64_t kMaxSpdBytes = 16u << 20;
    const std::vector<std::byte> bytes = read_whole_file(path, kMaxSpdBytes);
    const auto pairs = parse_spd({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    if (!pairs) throw Error(ErrorKind::kInput, "not a list of wavelength and value pairs");
    const Vec3 rgb = rgb_from_samples(*pairs);
    if (!is_finite(rgb)) throw Error(ErrorKind::kInput, "its values are not finite");
    return rgb;
  } catch (const Error& error) {
    std::error_code ignored;
    if (metal_by_name(parameter.strings[0]) && !std::filesystem::exists(path, ignored))
      return std::nullopt; // the caller has the data of this metal
    context_.reporter.error(parameter.place, "cannot read spectrum file " + in_quotes(path.string(), kMaxShownPath) +
                                                 ": " + error.what());
    return std::nullopt;
  }
}

std::string_view TextureParameters::spectrum_file(std::string_view name) const {
  const Parameter* const value = find(name, {ParameterType::kSpectrum});
  return value && value->strings.size() == 1 ? std::string_view(value->strings[0]) : std::string_view();
}

bool TextureParameters::has(std::string_view name) const {
  return find(name, {ParameterType::kTexture, ParameterType::kFloat, ParameterType::kString, ParameterType::kRgb,
                     ParameterType::kXyz, ParameterType::kBlackbody, ParameterType::kSpectrum}) != nullptr;
}

float TextureParameters::get_float(std::string_view name, float fallback) const {
  return first_.get_float(name, second_ ? second_->get_float(name, fallback) : fallback);
}

bool TextureParameters::get_bool(std::string_view name, bool fallback) const {
  return first_.get_bool(name, second_ ? second_->get_bool(name, fallback) : fallback);
}

std::string TextureParameters::get_string(std::string_view name, std::string_view fallback) const {
  return first_.get_string(name, second_ ? second_->get_string(name, fallback) : std::string(fallback));
}

void TextureParameters::check(std::string_view name, Kind kind) const {
  find(name, {}); // registers the name as known, whatever its type
  const auto unread = [&](const Parameter& parameter) { return parameter.name == name && !parameter.used; };
  if (std::none_of(first_.all().begin(), first_.all().end(), unread)) return;
  switch (kind) {
  case Kind::kFloat:
    find_float(name);
    return;
  case Kind::kSpectrum:
    find_spectrum(name);
    return;
  case Kind::kBool:
    first_.get_bool(name, false);
    return;
  case Kind::kString:
    first_.get_string(name, "");
    return;
  }
}

void TextureParameters::mark_used(std::span<const std::string_view> names) const {
  first_.mark_used(names);
  if (second_) second_->mark_used(names);
}

} // namespace packtrace
