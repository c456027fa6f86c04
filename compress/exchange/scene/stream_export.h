#pragma once

#include <string>

#include "compress/exchange/scene/exported_file.h"
#include "compress/format/file/baked_file.h"
#include "pbrt_import/base/progress.h"

namespace packtrace {

/// Exports what a baked file stores as NumPy arrays (.npy) with a JSON description: positions, lattice coordinates,
/// normals, texture coordinates, triangles and instances. docs/streams.md describes them.
/// The bytes depend only on the arguments. Throws Error(kCancelled).
/// @param stem name of the JSON file without its ending; the arrays are in the folder STEM_files
SceneExport export_streams(const BakedFile& file, const std::string& stem, Progress& progress);

} // namespace packtrace
