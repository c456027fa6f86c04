#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "compress/format/file/baked_file.h"
#include "pbrt_import/scene/scene.h"
#include "runtime/trace/source/packed_source.h"

namespace packtrace {

struct TraceInputOptions {
  std::filesystem::path scenes; ///< folder with house, spaceship, bunny and killeroo
  uint64_t mesh_triangles = 6'000'000;
  uint64_t forest_instances = 50'000;
};

/// A packed scene for all systems. Float triangles are decoded from it.
struct TraceInput {
  TraceInput(std::string input_name, BakedFile baked)
      : name(std::move(input_name)), file(std::move(baked)), source(file) {}
  TraceInput(const TraceInput&) = delete;
  TraceInput& operator=(const TraceInput&) = delete;

  std::string name;
  BakedFile file;
  PackedSource source;

  /// Triangles with each geometry counted once, or once per instance.
  uint64_t unique_triangles() const;
  uint64_t placed_triangles() const;
};

/// Loads a scene to bake, by a name as below, but no .ptk file. Throws like import_scene(), and Error(kUsage).
Scene load_trace_scene(const std::string& name, const TraceInputOptions& options);

/// Bakes with default options. Throws like bake_to_bytes().
BakedFile bake_trace_scene(const Scene& scene, const std::string& name);

/// Loads an input by name: house, spaceship, bunny, killeroo, town and meadow (in assets; the meadow with all that
/// moves), mesh (generated, with mesh_triangles unique triangles), forest (generated, with forest_instances instances).
/// Any other name is the path of a .ptk or .pbrt file. Scenes are baked with default options.
/// Throws like import_scene(), bake_to_bytes() and BakedFile::open().
std::unique_ptr<TraceInput> load_trace_input(const std::string& name, const TraceInputOptions& options);

} // namespace packtrace
