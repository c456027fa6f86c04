#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pbrt_import/base/diagnostics.h"
#include "pbrt_import/base/memory_budget.h"
#include "pbrt_import/base/progress.h"
#include "pbrt_import/scene/scene.h"

namespace packtrace {

struct ImportOptions {
  bool strict = false;                          ///< any warning or error fails the import, once all are reported
  MemoryBudget memory = MemoryBudget();         ///< for all that the scene takes while it is read and afterwards
  uint64_t max_file_bytes = 16ull << 30;        ///< content of one file of text, after inflating
  uint32_t max_include_depth = 64;              ///< files open at once
  uint64_t max_included_files = 1'000'000;      ///< opened in all
  uint32_t max_nesting = 1u << 16;              ///< open Attribute, Transform and Object blocks
  double tessellation_tolerance = 1e-3;         ///< relative to the curved shape's radius, within [1e-6, 0.5]
  bool allow_files_outside_scene_folder = true; ///< exporters write "../textures/x.png"
  bool keep_textures = false;                   ///< fill Scene::textures; else materials have averages only
  /// Which WorldBegin ... WorldEnd with its options, from 1. None: the first, with a warning where there are more.
  std::optional<uint32_t> world;
  std::optional<double> time; ///< when to look at what moves; none: as the camera's shutter opens
};

/// What an import read, for reports.
struct ImportStatistics {
  uint64_t directives = 0;
  uint64_t files_read = 0;                ///< scene text (each time it is included), PLY and image files
  uint64_t bytes_read = 0;                ///< their content, inflated
  std::map<std::string, uint64_t> shapes; ///< Shape directives by kind, whether or not they could be used
  uint64_t shapes_skipped = 0;            ///< not in the scene because of an error in them
  uint64_t shapes_absent = 0;             ///< not in the scene because their alpha is 0 everywhere
  uint64_t light_sources = 0;             ///< LightSource directives; ambient occlusion has no use for them
  uint64_t area_lights = 0;               ///< shapes that emit
  uint64_t textures_found = 0;            ///< image files that textures name, each once
  uint64_t textures_missing = 0;
  uint64_t triangles = 0; ///< stored, unique_triangle_count()
  uint64_t worlds = 0;    ///< in the text; one of them was read, and only its things are counted here
  std::map<std::string, uint64_t> materials; ///< Material and MakeNamedMaterial directives by kind as written
  uint64_t animated_shapes = 0;              ///< in the scene, those of objects once
  uint64_t animated_instances = 0;
  uint64_t animated_cameras = 0;
  uint64_t cameras_left_out = 0;           ///< not in the scene because of an error in them or in their transform
  std::array<uint64_t, 3> problems{};      ///< reported, by Severity
  std::map<std::string, uint64_t> ignored; ///< features met that nothing is made of, docs/json_output.md names them
};

struct ImportResult {
  Scene scene;
  ImportStatistics statistics;
  std::vector<std::filesystem::path> files; ///< that the scene is made of: all it names, read or not, in no order
  MemoryReservation memory; ///< of the scene; to be kept as long as it
};

/// Reads a pbrt-v3 scene with everything it includes. Problems are reported to diagnostics, each with its place, and
/// the rest of the scene is kept; a scene without a single shape is returned as such. The same files give the same
/// result and diagnostics for any thread count.
///
/// Of several worlds one is read with the options before it, as if it stood alone; the text of the others is checked,
/// files they name (but includes) are not opened. Everything stands where it is at one time, Scene::time; the keys of
/// what moves are in Scene::animations.
///
/// Scene::cameras[0] is the camera pbrt renders with, the file's last one; earlier ones follow in file order. Objects
/// that are never instanced, and materials, masks and meshes that nothing uses, are left out.
///
/// Throws Error(kUsage) if an option is out of range, Error(kInput) if the main file cannot be read at all or has no
/// world of that number, Error(kInput) if options.strict and a warning or an error was reported, MemoryError, "PLACE:
/// ...", where the scene needs more than options.memory, Error(kCancelled) on cancellation.
ImportResult import_scene(const std::filesystem::path& main_file, const ImportOptions& options,
                          Diagnostics& diagnostics, Progress& progress);

} // namespace packtrace
