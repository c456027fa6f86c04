#include "tests/benchmarks/trace_benchmark_inputs.h"

#include "assets/generator/displaced_mesh.h"
#include "assets/generator/forest.h"
#include "compress/bake/bake_scene.h"
#include "pbrt_import/base/error.h"
#include "pbrt_import/import_scene.h"
#include "pbrt_import/ply_sequence.h"
#include "pbrt_import/scene/separate_motion.h"
#include "tests/temporary_folder.h"

namespace packtrace {
namespace {

namespace fs = std::filesystem;

Scene import(const fs::path& scene_file) {
  Diagnostics diagnostics;
  Progress progress;
  return import_scene(scene_file, {}, diagnostics, progress).scene;
}

const fs::path kMeadow = fs::path(PACKTRACE_SOURCE_DIR) / "assets/meadow/meadow.pbrt";

BakedFile bake_moving_meadow() {
  Diagnostics diagnostics;
  Progress progress;
  ImportResult imported = import_scene(kMeadow, {}, diagnostics, progress);
  separate_motion(imported.scene);
  BakeConfig config;
  for (const char* const level : {"0", "1", "2", "3"})
    config.sequences.push_back(find_mesh_sequence(imported.scene, imported.files, kMeadow,
                                                  std::string("geometry/grass_") + level + "_%04d.ply", {}, 12.0));
  return BakedFile::from_bytes(bake_to_bytes(imported.scene, config, diagnostics, progress).bytes, "meadow");
}

} // namespace

Scene load_trace_scene(const std::string& name, const TraceInputOptions& options) {
  if (name == "town") return import(fs::path(PACKTRACE_SOURCE_DIR) / "assets/town/town.pbrt");
  if (name == "meadow") return import(kMeadow);
  if (name == "killeroo") return import(options.scenes / name / "killeroo-simple.pbrt");
  if (name == "house" || name == "spaceship" || name == "bunny") return import(options.scenes / name / "scene.pbrt");
  const TemporaryFolder folder;
  if (name == "mesh") {
    scenegen::DisplacedMeshConfig config;
    config.triangles = options.mesh_triangles;
    scenegen::generate_displaced_mesh(config, {folder.path(), true});
    return import(folder.path() / "mesh.pbrt");
  }
  if (name == "forest") {
    scenegen::ForestConfig config;
    config.instances = options.forest_instances;
    scenegen::generate_forest(config, {folder.path(), true});
    return import(folder.path() / "forest.pbrt");
  }
  if (fs::path(name).extension() == ".ptk")
    throw Error(ErrorKind::kUsage, name + ": a scene is needed, not a baked one");
  return import(name);
}

BakedFile bake_trace_scene(const Scene& scene, const std::string& name) {
  Diagnostics diagnostics;
  Progress progress;
  return BakedFile::from_bytes(bake_to_bytes(scene, {}, diagnostics, progress).bytes, name);
}

uint64_t TraceInput::unique_triangles() const {
  uint64_t triangles = 0;
  for (uint32_t g = 0; g < source.geometry_count(); ++g) triangles += source.counts(g).triangles;
  return triangles;
}

uint64_t TraceInput::placed_triangles() const {
  uint64_t triangles = 0;
  for (const PlacedGeometry& placed : source.instances()) triangles += source.counts(placed.geometry).triangles;
  return triangles;
}

std::unique_ptr<TraceInput> load_trace_input(const std::string& name, const TraceInputOptions& options) {
  const fs::path path(name);
  const std::string shown = path.has_extension() ? path.stem().string() : name;
  if (name == "meadow") return std::make_unique<TraceInput>(name, bake_moving_meadow());
  return std::make_unique<TraceInput>(shown, path.extension() == ".ptk"
                                                 ? BakedFile::open(path)
                                                 : bake_trace_scene(load_trace_scene(name, options), name));
}

} // namespace packtrace
