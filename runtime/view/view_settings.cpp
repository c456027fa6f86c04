#include "runtime/view/view_settings.h"

#include <algorithm>
#include <charconv>

#include "pbrt_import/base/closest_name.h"
#include "pbrt_import/base/error.h"
#include "runtime/frame/frame_settings.h"

namespace packtrace {
namespace {

constexpr std::string_view kToneMap = "tone-map", kAoPrefix = "ao.", kDenoiserPrefix = "denoiser.",
                           kShadePrefix = "shade.", kExposure = "exposure", kSeed = "seed";

std::string value_text(bool is_switch, double value) {
  if (is_switch) return value != 0.0 ? "on" : "off";
  return setting_text(value);
}

ViewSetting number_setting(std::string group, std::string_view prefix, const SettingInfo& info, bool is_switch,
                           bool is_integer, double value, double default_value) {
  ViewSetting setting;
  setting.group = std::move(group);
  setting.name = std::string(prefix) + std::string(info.name);
  setting.help = info.help;
  setting.is_switch = is_switch, setting.is_integer = is_integer;
  setting.low = info.low, setting.high = info.high, setting.rule = info.rule;
  setting.value = value_text(is_switch, value), setting.default_value = value_text(is_switch, default_value);
  return setting;
}

/// Lists the settings of a table.
template <typename Config>
void list(std::span<const Setting<Config>> table, const std::string& group, std::string_view prefix,
          const Config& config, std::vector<ViewSetting>& out) {
  for (const Setting<Config>& s : table)
    out.push_back(
        number_setting(group, prefix, s.info, s.is_switch(), s.is_integer(), s.get(config), s.default_value()));
}

ViewSetting word_view(const WordSetting& word, const FrameConfig& config) {
  ViewSetting setting;
  setting.group = word.name.starts_with("ao") ? "ao" : word.name == kToneMap ? "shading" : "denoiser";
  setting.name = word.name;
  setting.help = word.help;
  setting.words.assign(word.words.begin(), word.words.end());
  setting.value = word.get(config);
  setting.default_value = word.get(FrameConfig());
  return setting;
}

/// @return false if the word is none of the setting's
bool assign_word(const WordSetting& setting, std::string_view value, FrameConfig& config) {
  if (std::ranges::find(setting.words, value) == setting.words.end()) return false;
  setting.set(config, value);
  return true;
}

void assign_seed(FrameConfig& config, std::string_view value) {
  const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), config.ao.seed);
  if (error != std::errc() || end != value.data() + value.size())
    throw Error(ErrorKind::kUsage, "seed is " + std::string(value) + ", not a whole number, 0 or more");
}

ViewSetting seed_view(const FrameConfig& config) {
  ViewSetting setting;
  setting.group = "ao", setting.name = kSeed;
  setting.help = "Seed of the sample pattern. Another seed gives other noise";
  setting.is_integer = true, setting.high = 0x1p53;
  setting.value = std::to_string(config.ao.seed), setting.default_value = "0";
  return setting;
}

void refuse_word(const WordSetting& setting, std::string_view value) {
  std::string known;
  for (const std::string_view word : setting.words) known.append(known.empty() ? "" : ", ").append(word);
  throw Error(ErrorKind::kUsage, std::string(setting.name) + " is " + std::string(value) + ", not one of " + known +
                                     did_you_mean_text(closest_name(value, setting.words)));
}

void refuse_name(const FrameConfig& config, std::string_view name) {
  const std::vector<ViewSetting> settings = view_settings(config);
  std::vector<std::string_view> names;
  for (const ViewSetting& setting : settings) names.push_back(setting.name);
  throw Error(ErrorKind::kUsage,
              "no such setting: " + std::string(name) + did_you_mean_text(closest_name(name, names)));
}

} // namespace

std::vector<ViewSetting> view_settings(const FrameConfig& config) {
  std::vector<ViewSetting> all;
  list(frame_settings(), "frames", "", config, all);
  for (ViewSetting& setting : all)
    if (setting.name == kExposure) setting.group = "shading";
  for (const WordSetting& word : word_settings())
    if (word.name.starts_with("ao")) all.push_back(word_view(word, config));
  all.push_back(seed_view(config));
  list(ao_settings(), "ao", kAoPrefix, config.ao, all);
  all.push_back(word_view(word_setting("denoiser"), config));
  if (config.denoise)
    for (const SettingView& s : denoiser_settings(config.denoiser))
      all.push_back(
          number_setting("denoiser", kDenoiserPrefix, s.info, s.is_switch, s.is_integer, s.value, s.default_value));
  all.push_back(word_view(word_setting(kToneMap), config));
  list(shade_settings(), "shading", kShadePrefix, config.shade, all);
  return all;
}

void set_view_setting(FrameConfig& config, std::string_view name, std::string_view value) {
  FrameConfig changed = config;
  const auto words = std::ranges::find(word_settings(), name, &WordSetting::name);
  const std::string assignment(value);
  if (words != word_settings().end()) {
    if (!assign_word(*words, value, changed)) refuse_word(*words, value);
  } else if (name == kSeed) {
    assign_seed(changed, value);
  } else if (name.starts_with(kAoPrefix)) {
    assign_setting(ao_settings(), std::string(name.substr(kAoPrefix.size())) + "=" + assignment, changed.ao,
                   "ambient occlusion");
  } else if (name.starts_with(kShadePrefix)) {
    assign_setting(shade_settings(), std::string(name.substr(kShadePrefix.size())) + "=" + assignment, changed.shade,
                   "shading");
  } else if (name.starts_with(kDenoiserPrefix)) {
    if (!config.denoise) throw Error(ErrorKind::kUsage, std::string(name) + " changes nothing with the denoiser off");
    changed.denoiser.set(std::string(name.substr(kDenoiserPrefix.size())) + "=" + assignment);
    changed.denoiser.validate();
  } else if (std::ranges::any_of(frame_settings(), [&](const auto& s) { return s.info.name == name; })) {
    assign_setting(frame_settings(), std::string(name) + "=" + assignment, changed, "view");
  } else {
    refuse_name(config, name);
  }
  config = changed;
}

bool same_frames(const FrameConfig& a, const FrameConfig& b) {
  FrameConfig shown_alike = b;
  shown_alike.tone_map = a.tone_map, shown_alike.exposure = a.exposure;
  return a.size == b.size && a.lod_layers == b.lod_layers && a.shades() == b.shades() &&
         setting_words(a) == setting_words(shown_alike);
}

std::vector<std::string> setting_words(const FrameConfig& config) {
  std::vector<std::string> words;
  const auto option = [&](const std::string& name, const std::string& value) {
    words.push_back(name);
    words.push_back(value);
  };
  for (const ViewSetting& s : view_settings(config)) {
    if (s.value == s.default_value) continue;
    if (s.name.starts_with(kAoPrefix))
      option("--ao-set", s.name.substr(kAoPrefix.size()) + "=" + s.value);
    else if (s.name.starts_with(kDenoiserPrefix))
      option("--denoiser-set", s.name.substr(kDenoiserPrefix.size()) + "=" + s.value);
    else if (s.name.starts_with(kShadePrefix))
      option("--shade-set", s.name.substr(kShadePrefix.size()) + "=" + s.value);
    else if (s.name == "jitter")
      words.emplace_back("--no-jitter"); // the only value that is not the default
    else
      option("--" + s.name, s.value);
  }
  return words;
}

} // namespace packtrace
