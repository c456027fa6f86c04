#include "runtime/frame/frame_settings.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <utility>

#include "runtime/frame/ao_names.h"

namespace packtrace {
namespace {

template <typename T, size_t kCount>
constexpr std::array<std::string_view, kCount> words_of(const NamedValues<T, kCount>& values) {
  std::array<std::string_view, kCount> words;
  for (size_t i = 0; i < kCount; ++i) words[i] = values[i].first;
  return words;
}

template <typename T, size_t kCount>
std::string_view word_of(const NamedValues<T, kCount>& values, T value) {
  return std::ranges::find(values, value, &std::pair<const char*, T>::second)->first;
}

constexpr auto kResolutions = words_of(kAoResolutionNames);
constexpr auto kRates = words_of(kAoRateNames);
constexpr auto kSamplers = words_of(kAoSamplerNames);
constexpr auto kToneMaps = words_of(kToneMapNames);
constexpr std::array<std::string_view, 3> kDenoisers{"ours", "reference", "off"}; // in the order of DenoiserKind

std::string_view denoiser_word(const FrameConfig& config) {
  return config.denoise ? kDenoisers[static_cast<size_t>(config.denoiser.kind)] : "off";
}

void set_denoiser(FrameConfig& config, std::string_view word) {
  config.denoise = word != "off";
  config.denoiser.kind = word == "reference" ? DenoiserKind::kReference : DenoiserKind::kOurs;
}

constexpr WordSetting kWordSettings[] = {
    {"ao-resolution",
     "Pixels for which ambient occlusion is traced. quarter traces one of 2 x 2 pixels, a quarter of the rays, and "
     "interpolates the others along surfaces; about four times as fast, with softer contact shadows",
     kResolutions, [](const FrameConfig& c) { return word_of(kAoResolutionNames, c.ao_resolution); },
     [](FrameConfig& c, std::string_view word) {
       c.ao_resolution = value_of(kAoResolutionNames, word, "ao-resolution");
     }},
    {"ao-rate",
     "Samples of a pixel and frame. full is --spp for all; checkerboard traces every other pixel, alternating from "
     "frame to frame, half of the rays; adaptive gives more to surfaces that came into view lately and fewer to "
     "others, --spp on average",
     kRates, [](const FrameConfig& c) { return word_of(kAoRateNames, c.ao_rate); },
     [](FrameConfig& c, std::string_view word) { c.ao_rate = value_of(kAoRateNames, word, "ao-rate"); }},
    {"ao-sampler",
     "Sample pattern. net is stratified over pixels and frames, sobol over frames; jitter takes 83 multi-jittered "
     "sets, lattice a lattice over the pixels; independent is random",
     kSamplers, [](const FrameConfig& c) { return word_of(kAoSamplerNames, c.ao.sampler); },
     [](FrameConfig& c, std::string_view word) { c.ao.sampler = value_of(kAoSamplerNames, word, "ao-sampler"); }},
    {"denoiser",
     "Denoiser of ambient occlusion. ours is the project's; reference is the pipeline of a public real-time sample, "
     "for comparison; off averages the frames",
     kDenoisers, denoiser_word, set_denoiser},
    {"tone-map", "Curve of shaded pictures. srgb clips at white, aces rolls highlights off", kToneMaps,
     [](const FrameConfig& c) { return word_of(kToneMapNames, c.tone_map); },
     [](FrameConfig& c, std::string_view word) { c.tone_map = value_of(kToneMapNames, word, "tone-map"); }},
};

constexpr Setting<FrameConfig> kFrameSettings[] = {
    {{"supersample",
      "Trace at this many times the width and height and filter down, for smooth edges in few frames. Time and memory "
      "grow with the square",
      1, 8},
     &FrameConfig::supersample},
    {{"jitter",
      "Shift the camera rays of each frame within their pixels while nothing moves, so that edges become smooth", 0, 1},
     &FrameConfig::jitter},
    {{"exposure", "Exposure of shaded pictures in stops: each doubles the brightness", -32, 32},
     &FrameConfig::exposure},
};

} // namespace

std::span<const WordSetting> word_settings() { return kWordSettings; }

const WordSetting& word_setting(std::string_view name) {
  const auto found = std::ranges::find(word_settings(), name, &WordSetting::name);
  assert(found != word_settings().end());
  return *found;
}

std::span<const Setting<FrameConfig>> frame_settings() { return kFrameSettings; }

} // namespace packtrace
