#pragma once

#include <span>
#include <string_view>

#include "pbrt_import/language/texture_parameters.h"

namespace packtrace {

/// All parameter names that pbrt-v3 looks up for a kind of material.
std::span<const std::string_view> parameter_names(std::string_view kind);

/// The type that pbrt-v3 expects of a material parameter.
TextureParameters::Kind parameter_kind(std::string_view material, std::string_view name);

} // namespace packtrace
