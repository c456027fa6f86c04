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

/// Destination of a generator.
struct OutputConfig {
  std::filesystem::path folder;
  bool overwrite = false;
};

/// A view of the scene: pbrt LookAt, perspective camera and film.
struct ViewConfig {
  DVec3 eye{0, 2, -10};
  DVec3 target{0, 0, 0};
  double fov_degrees = 40.0; ///< along the shorter image axis
  uint32_t width_px = 1280;
  uint32_t height_px = 720;
  double end_time_s = 0.0; ///< of moving instances, which begin at 0, the camera's time; 0 if nothing moves
};

/// Material replacements, from the model's name to the object's: {"wall", "wall_rose"}.
using MaterialChoice = std::map<std::string, std::string, std::less<>>;

/// Statistics of the written scene.
struct SceneTotals {
  uint64_t instances = 0;
  uint64_t unique_triangles = 0; ///< triangles in PLY files
  uint64_t placed_triangles = 0; ///< triangles of all instances and world shapes
};

/// Writes a pbrt-v3 scene: FOLDER/NAME.pbrt, which includes NAME_objects.pbrt and NAME_instances.pbrt, and binary PLY
/// files under FOLDER/geometry. Instances are streamed to disk. All functions throw Error(kIo) if writing fails.
class SceneWriter {
public:
  /// @param comment '#' lines for the head of the scene file, describing the picture
  SceneWriter(const OutputConfig& config, std::string name, std::string_view comment, const ViewConfig& view);

  /// Adds a diffuse material; albedo in linear sRGB, [0,1].
  void material(std::string_view name, Vec3 albedo);

  /// Adds a diffuse material with an image over the texture coordinates; `file` is relative to the folder.
  void textured_material(std::string_view name, std::string_view file);

  /// Stores a finished model under a name. Its meshes are written when it is first used.
  void model(std::string_view model_name, Model model);
  /// Stores a model of one PLY file that the caller writes; `file` is relative to the folder.
  void ply_model(std::string_view model_name, std::string_view file, std::string_view material,
                 uint64_t triangle_count);
  /// Declares an object that uses a model, optionally with other materials. ObjectBegin is written with its first
  /// instance.
  void object(std::string_view object_name, std::string_view model_name, const MaterialChoice& choice = {});
  /// Writes an object although nothing instances it yet.
  void write_object(std::string_view object_name);
  /// Combines model() and object() under one name.
  void object(std::string_view object_name, Model model);
  /// Writes an instance of an object, and the object before its first instance.
  void instance(std::string_view object_name, const DAffine& world_from_object);
  /// Writes an instance that moves from one transform at time 0 to another at ViewConfig::end_time_s.
  void moving_instance(std::string_view object_name, const DAffine& world_from_object_begin,
                       const DAffine& world_from_object_end);
  /// Places a stored model once in the world, without a transform.
  void world_shape(std::string_view model_name);
  /// Places a PLY file that the caller wrote once in the world; `file` is relative to the folder.
  void world_file(std::string_view file, std::string_view material, uint64_t triangle_count);

  /// Completes all files and gives them their names.
  SceneTotals finish();

private:
  struct PlyPart {
    std::string file, material;
  };
  struct StoredModel {
    Model model; ///< empty once written
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
  const StoredModel& written_object(std::string_view object_name);
  void count_instance(std::string_view object_name);
  void write_shapes(const std::vector<PlyPart>& parts, const MaterialChoice& choice);

  OutputConfig config_;
  std::string name_;
  BufferedFile main_, objects_, instances_;
  std::map<std::string, StoredModel, std::less<>> models_;
  std::map<std::string, StoredObject, std::less<>> object_names_;
  SceneTotals totals_;
};

} // namespace packtrace::scenegen
