#pragma once

#include <optional>

#include "pbrt_import/language/parser.h"
#include "pbrt_import/language/texture_parameters.h"

namespace packtrace {

/// The node that a Texture directive stands for: an expression over constants and images, or the mean of a procedural
/// texture. Float textures have three equal components. Reports problems, among them missing image files.
/// @return none if the directive is unusable; the name stays undefined
std::optional<TextureGraph::Node> make_texture(const Directive& directive, const TextureContext& context);

} // namespace packtrace
