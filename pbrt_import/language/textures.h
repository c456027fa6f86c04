#pragma once

#include <optional>

#include "pbrt_import/language/parser.h"
#include "pbrt_import/language/texture_parameters.h"

namespace packtrace {

/// Creates the graph node of a Texture directive: an expression over constants and images, or the mean of a procedural
/// texture. Float textures have three equal components. Reports problems, including missing image files.
/// @return nullopt if the directive is unusable; its name then stays undefined
std::optional<TextureGraph::Node> make_texture(const Directive& directive, const TextureContext& context);

} // namespace packtrace
