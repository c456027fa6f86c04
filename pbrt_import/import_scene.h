#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "pbrt_import/base/diagnostics.h"
#include "pbrt_import/base/memory_budget.h"
#include "pbrt_import/base/progress.h"
#include "pbrt_import/scene/mesh_sequence.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace {

/// The axis that points upwards in a mesh file.
enum class UpAxis : uint8_t { kX, kY, kZ };

struct ImportOptions {
  bool strict = false;                          ///< any warning or error fails the import, after all are reported
  MemoryBudget memory = MemoryBudget();         ///< for all memory of the scene, during and after reading
  uint64_t max_file_bytes = 16ull << 30;        ///< content of one text file, after inflating
  uint32_t max_include_depth = 64;              ///< Include depth, the main file included
  uint64_t max_included_files = 1'000'000;      ///< total number of files opened
  uint32_t max_nesting = 1u << 16;              ///< open Attribute, Transform and Object blocks at once
  double tessellation_tolerance = 1e-3;         ///< relative to the radius of the curved shape, within [1e-6, 0.5]
  bool allow_files_outside_scene_folder = true; ///< exporters write "../textures/x.png"
  bool keep_textures = false;                   ///< fill Scene::textures; otherwise materials have average colours only
  bool keep_shading = false;                    ///< fill Material::shading, Scene::lights and Scene::environment_maps
  bool keep_unused_objects = false;             ///< otherwise objects without instances are left out, with a warning
  /// Number of the world (WorldBegin ... WorldEnd with its options) to read, from 1. Unset: the first, with a warning
  /// if there are more.
  std::optional<uint32_t> world;
  std::optional<double> time; ///< time at which animations are evaluated; unset: shutter opening of the camera
  double mesh_scale = 1.0;    ///< factor of the coordinates of mesh files, within [1e-30, 1e30]
  /// If set, keeps the frames of the glTF meshes that morph targets or skins deform (ImportResult::sequences), at about
  /// this rate, which is finite and positive. These meshes have their shape at 0 s then, and that at `time` otherwise.
  std::optional<double> frames_per_second;
  std::optional<std::string> animation; ///< of glTF files: name or number of the one that moves nodes; unset: the first
  bool allow_uris_outside_folder = false; ///< glTF files may name files outside their folder
  UpAxis mesh_up = UpAxis::kY;            ///< up axis of mesh files; scenes have y
};

/// Statistics of an import, for reports.
struct ImportStatistics {
  uint64_t directives = 0;
  uint64_t files_read = 0;                ///< scene text files (each time they are included), PLY files and images
  uint64_t bytes_read = 0;                ///< content of these files, inflated
  std::map<std::string, uint64_t> shapes; ///< Shape directives by kind, used or not
  uint64_t shapes_skipped = 0;            ///< shapes left out because of an error
  uint64_t shapes_absent = 0;             ///< shapes left out because their alpha is 0 everywhere
  uint64_t light_sources = 0;             ///< LightSource directives; only shading uses them
  uint64_t area_lights = 0;               ///< emissive shapes
  uint64_t textures_found = 0;            ///< distinct image files that textures name
  uint64_t textures_missing = 0;
  uint64_t triangles = 0;                    ///< unique_triangle_count() of the scene
  uint64_t worlds = 0;                       ///< worlds in the text; all other counts cover only the one that was read
  std::map<std::string, uint64_t> materials; ///< Material and MakeNamedMaterial directives by kind as written
  uint64_t animated_shapes = 0;              ///< shapes in the scene, counted once per object
  uint64_t animated_instances = 0;
  uint64_t animated_cameras = 0;
  uint64_t cameras_left_out = 0;           ///< cameras left out because of an error in them or in their transform
  std::array<uint64_t, 3> problems{};      ///< problems reported, by Severity
  std::map<std::string, uint64_t> ignored; ///< occurrences of unsupported features; names in docs/json_output.md
};

struct ImportResult {
  Scene scene;
  ImportStatistics statistics;
  std::vector<std::filesystem::path> files; ///< all files that the scene names, read or not, in no particular order
  /// Frames of the meshes that the animation of a glTF file deforms, if ImportOptions::frames_per_second is set; sorted
  /// by mesh. A file has round(span of its animation * frames_per_second) frames, but at least two. Their rate is count
  /// / span, so they repeat together with the tracks of nodes; frame k is at k / rate seconds.
  std::vector<MeshSequence> sequences;
  MemoryReservation memory; ///< reservation for the scene; must live as long as the scene
};

/// Reads a pbrt-v3 scene with all files that it includes, or a mesh file (see import_mesh_files()). Problems are
/// reported to diagnostics with their source location, and the rest of the scene is kept; a scene without any shape is
/// returned as such. The result and the diagnostics depend on the files only, not on the number of threads.
///
/// If there are several worlds, one is read together with the options before it, as if it were alone. The text of the
/// others is checked, but of the files that they name only included ones are opened. Everything animated is placed at
/// Scene::time; the animation keys are in Scene::animations, glTF files fill Scene::motion.
///
/// Scene::cameras[0] is the last camera of the file, which pbrt renders with; the others follow in file order. Objects
/// without instances are left out, and so are materials, masks, textures and meshes without users.
///
/// Throws Error(kUsage) if an option is out of range; Error(kInput) if the main file cannot be read or has no world of
/// the given number, or if options.strict is set and a warning or an error was reported; MemoryError, "PLACE: ...", if
/// the scene needs more than options.memory; Error(kCancelled) on cancellation.
ImportResult import_scene(const std::filesystem::path& main_file, const ImportOptions& options,
                          Diagnostics& diagnostics, Progress& progress);

/// Reads PLY, OBJ and STL files as one scene, which has no cameras. Their right-handed coordinates become the scene's
/// left-handed ones by mirroring x; options.mesh_scale and mesh_up apply.
/// @param files at least one; the formats are recognised by scene_format()
/// Throws like import_scene(); Error(kUsage) if there is a pbrt scene among several files.
ImportResult import_mesh_files(std::span<const std::filesystem::path> files, const ImportOptions& options,
                               Diagnostics& diagnostics, Progress& progress);

} // namespace packtrace
