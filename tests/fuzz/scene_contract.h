#pragma once

#include <string>

#include "pbrt_import/import_scene.h"
#include "pbrt_import/base/diagnostics.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace::fuzz {

/// Ends the process where a mesh breaks the contract of scene.h.
void require_mesh_contract(const Mesh& mesh);

/// The same for a whole scene, for what import_scene() promises, and for counts that contradict each other or
/// losses that no diagnostic tells of.
void require_import_contract(const ImportResult& result, const Diagnostics& diagnostics);

/// All of an import as bytes: equal exactly where the results, bit for bit, and the texts of the diagnostics are.
std::string fingerprint(const ImportResult& result, const Diagnostics& diagnostics);

} // namespace packtrace::fuzz
