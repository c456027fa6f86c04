#pragma once

#include <string>

#include "compress/exchange/scene/exported_file.h"
#include "compress/format/file/baked_file.h"
#include "pbrt_import/base/progress.h"

namespace packtrace {

/// Exports a baked file as a pbrt-v3 scene: text, binary PLY files and PNG images. Positions are those of the file, bit
/// for bit; shapes state their lattice, so that baking the scene gives it again. Materials are reduced to what the file
/// holds: matte, mirror, metal or glass with albedo or texture, alpha masks, area lights of radiance 1.
/// The bytes depend only on the arguments. Throws Error(kCancelled), Error(kLimitExceeded).
/// @param stem name of the main file without its ending; its other files are in the folder STEM_files
SceneExport export_pbrt(const BakedFile& file, const std::string& stem, Progress& progress);

} // namespace packtrace
