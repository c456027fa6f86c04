#pragma once

#include <string>

#include "pbrt_import/base/diagnostics.h"
#include "pbrt_import/import_scene.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace::fuzz {

/// Ends the process if a mesh violates the contract of scene.h.
void require_mesh_contract(const Mesh& mesh);

/// Ends the process if a whole scene violates that contract or the guarantees of import_scene(), if its counts
/// contradict each other, or if something was lost without a diagnostic.
void require_import_contract(const ImportResult& result, const Diagnostics& diagnostics);

/// Serialises an import: equal bytes exactly if the results are bitwise equal and the diagnostics have equal texts.
std::string fingerprint(const ImportResult& result, const Diagnostics& diagnostics);

} // namespace packtrace::fuzz
