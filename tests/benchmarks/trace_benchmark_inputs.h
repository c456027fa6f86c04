#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "compress/format/file/baked_file.h"
#include "pbrt_import/scene/scene.h"
#include "runtime/trace/source/packed_source.h"

namespace packtrace {

struct TraceInputOptions {
  std::filesystem::path scenes; ///< holds house, spaceship, bunny and killeroo
  uint64_t mesh_triangles = 6'000'000;
  uint64_t forest_instances = 50'000;
};

/// A packed scene that every system traces: float triangles are what is decoded from it.
struct TraceInput {
  TraceInput(std::string input_name, BakedFile baked)
      : name(std::move(input_name)), file(std::move(baked)), source(file) {}
  TraceInput(const TraceInput&) = delete;
  TraceInput& operator=(const TraceInput&) = delete;

  std::string name;
  BakedFile file;
  PackedSource source;

  /// Each geometry counted once, or with each of its instances.
  uint64_t unique_triangles() const;
  uint64_t placed_triangles() const;
};

/// A scene to be baked, by name as below; not of a .ptk file. Throws as import_scene(), and Error(kUsage).
Scene load_trace_scene(const std::string& name, const TraceInputOptions& options);

/// Bakes with the defaults. Throws as bake_to_bytes().
BakedFile bake_trace_scene(const Scene& scene, const std::string& name);

/// By name: house, spaceship, bunny, killeroo, town (in assets), mesh (generated, of unique triangles), forest
/// (generated, of instances); anything else is the path of a .ptk or .pbrt file. What is not packed is baked with the
/// defaults.
/// Throws as import_scene(), bake_to_bytes() and BakedFile::open().
std::unique_ptr<TraceInput> load_trace_input(const std::string& name, const TraceInputOptions& options);

} // namespace packtrace
