#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>

#include "pbrt_import/scene/material_flags.h"

namespace packtrace {

/// Words for users, by bit.
inline constexpr std::array<std::string_view, 12> kMaterialFlagNames{
    "alpha mask", "shadow alpha mask", "transmissive",   "mirror",     "emissive", "emits both sides", "invisible",
    "absent",     "no shadow",         "albedo texture", "normal map", "metal"};
static_assert(kAllMaterialFlags == (1u << kMaterialFlagNames.size()) - 1);

/// The names of the flags that are set, separated by ", "; "none" if none is.
inline std::string material_flag_words(MaterialFlags flags) {
  std::string list;
  for (size_t i = 0; i < kMaterialFlagNames.size(); ++i)
    if ((flags >> i & 1u) != 0) list.append(list.empty() ? "" : ", ").append(kMaterialFlagNames[i]);
  return list.empty() ? "none" : list;
}

} // namespace packtrace
