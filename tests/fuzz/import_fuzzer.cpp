// Fuzzes import_scene() with whole scenes of several files (scene_files.h). Low limits keep each input within
// milliseconds.

#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>

#include <tbb/task_arena.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/import_scene.h"
#include "pbrt_import/scene_format.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/scene_contract.h"
#include "tests/fuzz/scene_files.h"

namespace packtrace::fuzz {
namespace {

ImportOptions small_limits() {
  ImportOptions options;
  options.memory = MemoryBudget(16u << 20);
  options.max_include_depth = 4;
  options.max_included_files = 16;
  options.max_nesting = 32;
  options.tessellation_tolerance = 0.05;
  options.keep_textures = true;
  options.allow_files_outside_scene_folder = false; // inputs must behave equally on every machine
  return options;
}

/// Returns the result of an import with the given number of threads as bytes, or the error's text if it fails.
std::string outcome(const std::filesystem::path& main_file, const ImportOptions& options, int threads) {
  Diagnostics diagnostics;
  Progress progress;
  try {
    tbb::task_arena arena(threads);
    const ImportResult result = arena.execute([&] { return import_scene(main_file, options, diagnostics, progress); });
    require_import_contract(result, diagnostics);
    if (options.strict)
      require(diagnostics.count(Severity::kWarning) + diagnostics.count(Severity::kError) == 0,
              "problems accepted in strict mode");
    (void)placed_triangle_count(result.scene);
    (void)world_bounds(result.scene);
    return fingerprint(result, diagnostics);
  } catch (const Error& error) {
    require(error.kind() == ErrorKind::kInput || error.kind() == ErrorKind::kLimitExceeded ||
                error.kind() == ErrorKind::kUnsupported,
            "kind of error");
    require(*error.what() != '\0', "error without a text");
    return error.what();
  }
}

/// The file to import: the first with a mesh format's ending, otherwise the main file.
std::filesystem::path chosen_file(std::string_view text, const std::filesystem::path& main_file) {
  for (const SceneFile& file : split_scene(text)) {
    const std::filesystem::path path = main_file.parent_path() / file.name;
    const SceneFormat format = scene_format(path);
    if (format == SceneFormat::kObj || format == SceneFormat::kStl || format == SceneFormat::kGltf) return path;
  }
  return main_file;
}

} // namespace
} // namespace packtrace::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace packtrace::fuzz;
  static SceneFilesFolder folder;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const std::filesystem::path main_file = chosen_file(text, folder.write(text));
  auto options = small_limits();
  options.keep_shading = std::hash<std::string_view>{}(text) % 2 == 0;
  const std::string alone = outcome(main_file, options, 1);
  constexpr size_t kRepeatInterval = 16; // these options repeat the import, so each is tried for few inputs only
  switch (std::hash<std::string_view>{}(text) % kRepeatInterval) {
  case 0:
    require(outcome(main_file, options, 2) == alone, "the result depends on the number of threads");
    break;
  case 1:
    options.strict = true;
    (void)outcome(main_file, options, 1);
    break;
  case 2:
    options.world = 2;
    options.time = 0.25;
    (void)outcome(main_file, options, 1);
    break;
  default:
    break;
  }
  return 0;
}
