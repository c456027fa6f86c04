#pragma once

#include <string>
#include <vector>

#include "compress/exchange/scene/exported_file.h"
#include "compress/format/file/baked_file.h"
#include "pbrt_import/base/progress.h"

namespace packtrace {

/// Exports a baked file as Wavefront OBJ with an MTL file and PNG images. OBJ has no instances: each becomes a group of
/// triangles in world space, mirrored along x because OBJ is right-handed.
/// The bytes depend only on the arguments. Throws Error(kCancelled), Error(kLimitExceeded), and what the sink throws.
/// @param stem name of the main file without its ending; STEM.mtl and the folder STEM_files are beside it
/// @param sink takes the main file in pieces of about a mebibyte
/// @return the other files
SceneExport export_obj(const BakedFile& file, const std::string& stem, Progress& progress, const ByteSink& sink);

/// Names of the other files, in their order.
std::vector<std::string> obj_companions(const BakedFile& file, const std::string& stem);

} // namespace packtrace
