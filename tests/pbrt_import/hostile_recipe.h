#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "pbrt_import/import_scene.h"

namespace packtrace {

/// Files of a hostile scene, the main one under the name "scene.pbrt", and the options of its import.
struct HostileInput {
  std::vector<std::pair<std::string, std::string>> files; ///< names and contents
  ImportOptions options;
};

/// Makes the files that a recipe describes; tests/pbrt_import/hostile/README.md lists its lines.
/// Throws std::runtime_error("line N: ...") if a line is malformed.
HostileInput parse_recipe(std::string_view recipe);

/// Content of the single file that the lines of a recipe describe, without the line "file NAME".
std::string recipe_bytes(std::string_view lines);

} // namespace packtrace
