#pragma once

#include <array>
#include <string>
#include <string_view>
#include <utility>

#include "pbrt_import/base/error.h"
#include "runtime/frame/frame_config.h"

namespace packtrace {

template <typename T, size_t kCount>
using NamedValues = std::array<std::pair<const char*, T>, kCount>;

// Values of the options that choose how occlusion rays are spent and how radiance is displayed; the first is the
// default.
inline constexpr NamedValues<AoResolution, 2> kAoResolutionNames{
    {{"full", AoResolution::kFull}, {"quarter", AoResolution::kQuarter}}};
inline constexpr NamedValues<AoRate, 3> kAoRateNames{
    {{"full", AoRate::kFull}, {"checkerboard", AoRate::kCheckerboard}, {"adaptive", AoRate::kAdaptive}}};
inline constexpr NamedValues<SamplerKind, 5> kAoSamplerNames{{{"net", SamplerKind::kSpaceTimeNet},
                                                              {"sobol", SamplerKind::kPixelSobol},
                                                              {"jitter", SamplerKind::kMultiJitter},
                                                              {"lattice", SamplerKind::kLattice},
                                                              {"independent", SamplerKind::kIndependent}}};

inline constexpr NamedValues<ToneMap, 2> kToneMapNames{{{"srgb", ToneMap::kSrgb}, {"aces", ToneMap::kAces}}};

/// Returns the value of a name. Throws Error(kUsage) for other names.
/// @param option what the name is given for, in messages
template <typename T, size_t kCount>
T value_of(const NamedValues<T, kCount>& values, std::string_view name, std::string_view option) {
  std::string known;
  for (const auto& [known_name, value] : values) {
    if (name == known_name) return value;
    known += (known.empty() ? "" : ", ") + std::string(known_name);
  }
  throw Error(ErrorKind::kUsage, std::string(option) + "=\"" + std::string(name) + "\": choose one of " + known);
}

} // namespace packtrace
