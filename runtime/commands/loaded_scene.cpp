#include "runtime/commands/loaded_scene.h"

#include <algorithm>
#include <array>
#include <fstream>

#include "pbrt_import/scene/error.h"
#include "runtime/trace/float_source.h"
#include "runtime/trace/packed_source.h"

namespace packtrace {

bool is_baked_file(const std::filesystem::path& file) {
  if (file.extension() == ".ptk") return true;
  std::array<char, baked::kMagic.size()> start{};
  std::ifstream in(file, std::ios::binary);
  in.read(start.data(), static_cast<std::streamsize>(start.size()));
  return in && std::equal(start.begin(), start.end(), baked::kMagic.begin(),
                          [](char a, uint8_t b) { return static_cast<uint8_t>(a) == b; });
}

ImportResult import_for_command(const std::filesystem::path& file, bool strict, const GlobalOptions& globals,
                                Progress& progress, ProgressDisplay& display) {
  Diagnostics diagnostics;
  ImportOptions options;
  options.strict = strict;
  ImportResult result;
  try {
    result = import_scene(file, options, diagnostics, progress);
  } catch (const Error&) { // what was found until then may explain it
    display.finish();
    report_diagnostics(diagnostics, globals);
    throw;
  }
  display.finish();
  const bool empty = placed_triangle_count(result.scene) == 0;
  GlobalOptions shown = globals;
  if (empty) shown.verbosity = std::max(shown.verbosity, 1); // notes may say why
  report_diagnostics(diagnostics, shown);
  if (empty) throw Error(ErrorKind::kInput, file.string() + ": the scene has no triangles to work with");
  return result;
}

LoadedScene load_scene(const std::filesystem::path& file, bool strict, const GlobalOptions& globals, Progress& progress,
                       ProgressDisplay& display) {
  LoadedScene loaded;
  if (is_baked_file(file)) {
    loaded.baked.emplace(BakedFile::open(file));
    loaded.source = std::make_unique<PackedSource>(*loaded.baked);
  } else {
    loaded.imported = std::make_unique<Scene>(import_for_command(file, strict, globals, progress, display).scene);
    loaded.source = std::make_unique<FloatSource>(*loaded.imported);
  }
  return loaded;
}

} // namespace packtrace
