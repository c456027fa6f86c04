#pragma once

#include "assets/generator/scene_writer.h"

namespace packtrace::scenegen {

/// Writes FOLDER/leaf.png: 96 x 128 texels of 8-bit grey, 255 inside a lobed leaf with holes that points up, 0 outside.
/// Throws Error(kIo) if writing fails.
void generate_leaf_mask(const OutputConfig& output);

} // namespace packtrace::scenegen
