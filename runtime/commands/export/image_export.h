#pragma once

#include <string>

#include "runtime/commands/export/shader_export.h"

namespace packtrace {

/// Adds --texture, --image-format and --image-size.
void add_image_options(CLI::App& verb, ShaderOptions& options, const std::string& group);

/// Makes a shader of an image file or of a texture of a .ptk file. Throws like export_shader().
ShaderExport export_image(const std::string& input, const std::string& output, const ShaderOptions& options,
                          const MemoryBudget& budget, Progress& progress);

} // namespace packtrace
