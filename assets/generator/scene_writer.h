#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "assets/generator/buffered_file.h"
#include "assets/generator/model.h"

namespace packtrace::scenegen {

/// Where a generator writes.
struct OutputConfig {
  std::filesystem::path folder;
  bool overwrite = false;
};

/// A view of the scene: pbrt LookAt, perspective camera and film.
struct ViewConfig {
  DVec3 eye{0, 2, -10};
  DVec3 target{0, 0, 0};
  double fov_degrees = 40.0; ///< across the shorter image axis
  uint32_t width_px = 1280;
  uint32_t height_px = 720;
};

/// Which material takes the place of which: {"wall", "wall_rose"}.
using MaterialChoice = std::map<std::string, std::string, std::less<>>;

/// Counts of what went to disk.
struct SceneTotals {
  uint64_t instances = 0;
  uint64_t unique_triangles = 0; ///< those in PLY files
  uint64_t placed_triangles = 0; ///< instances and world shapes
};

/// Writes a pbrt-v3 scene: FOLDER/NAME.pbrt, which includes NAME_objects.pbrt and NAME_instances.pbrt, and binary PLY
/// files under FOLDER/geometry. Instances stream to disk. Every function throws Error(kIo) if the disk refuses.
class SceneWriter {
public:
  /// @param comment '#' lines for the head of the scene file: what is to be seen
  SceneWriter(const OutputConfig& config, std::string name, std::string_view comment, const ViewConfig& view);

  /// Diffuse, linear sRGB in [0,1].
  void material(std::string_view name, Vec3 albedo);

  /// Remembers a finished model under a name; its meshes go to disk when something first shows it.
  void model(std::string_view model_name, Model model);
  /// A model under a name of its own, with other materials if chosen; ObjectBegin is written with its first instance.
  void object(std::string_view object_name, std::string_view model_name, const MaterialChoice& choice = {});
  /// model() and object() in one.
  void object(std::string_view object_name, Model model);
  void instance(std::string_view object_name, const DAffine& world_from_object);
  /// A stored model placed once, in the world, as it is.
  void world_shape(std::string_view model_name);
  /// A PLY file under the folder that the caller wrote itself, placed once in the world.
  void world_file(std::string_view file, std::string_view material, uint64_t triangle_count);

  /// Ends and names all files.
  SceneTotals finish();

private:
  struct PlyPart {
    std::string file, material;
  };
  struct StoredModel {
    Model model; ///< emptied once written
    std::vector<PlyPart> parts;
    uint64_t triangle_count = 0;
    bool written = false;
  };
  struct StoredObject {
    std::string model;
    MaterialChoice choice;
    bool written = false;
  };
  const StoredModel& written_model(std::string_view name);
  void write_shapes(const std::vector<PlyPart>& parts, const MaterialChoice& choice);

  OutputConfig config_;
  std::string name_;
  BufferedFile main_, objects_, instances_;
  std::map<std::string, StoredModel, std::less<>> models_;
  std::map<std::string, StoredObject, std::less<>> object_names_;
  SceneTotals totals_;
};

} // namespace packtrace::scenegen
