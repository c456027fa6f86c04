#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "compress/format/file/baked_file.h"
#include "pbrt_import/base/progress.h"
#include "pbrt_import/import_scene.h"
#include "runtime/commands/cli/cli_support.h"
#include "runtime/commands/cli/progress_display.h"
#include "runtime/trace/source/scene_source.h"

namespace packtrace {

/// Whether the file is a baked file: its name ends in .ptk, or it starts with the magic bytes of the format.
bool is_baked_file(const std::filesystem::path& file);

/// Reserves memory for decoding a .ptk file with codec fast or small. Reserves nothing for codec none, or if the header
/// cannot be read. Throws MemoryError.
MemoryReservation reserve_decoded(const std::filesystem::path& file, const MemoryBudget& budget);

/// Options for importing a scene or mesh file; see ImportOptions.
struct SceneOptions {
  bool strict = false;
  std::optional<uint32_t> world;
  std::optional<double> time;
  std::optional<std::string> up;           ///< axis of mesh files: "x", "y" or "z"
  std::optional<double> scale;             ///< of mesh files
  bool allow_outside = false;              ///< glTF files may name files outside their folder
  std::optional<std::string> animation;    ///< name or number of a glTF file's animation
  std::optional<double> frames_per_second; ///< as in ImportOptions; no option of its own
  std::vector<std::string> joined_files;   ///< further mesh files of the scene; no option of its own
  bool keep_unused_objects = false;        ///< as in ImportOptions; no option of its own
  bool keep_shading = false;               ///< as in ImportOptions; no option of its own
};

/// Adds --strict, --world, --time, --animation, --up, --scale and --allow-outside to a verb. `options` must outlive the
/// verb.
void add_scene_options(CLI::App& verb, SceneOptions& options);

/// The given options as words of a command line.
std::vector<std::string> scene_words(const SceneOptions& options);

/// Name of the first given option that a file cannot follow: all but --strict for a baked file, --world for a mesh
/// file, --time and --animation for one that is not glTF, --up, --scale and --animation for a pbrt scene; null if there
/// is none.
const char* option_without_use(const std::filesystem::path& file, const SceneOptions& options);

/// Throws Error(kUsage) if an option chooses what was chosen when a baked file was made.
void require_no_scene_choice(const std::filesystem::path& file, const SceneOptions& options);

/// The options of an import.
/// @param keep_textures as in ImportOptions
ImportOptions import_options(const SceneOptions& scene_options, const GlobalOptions& globals, bool keep_textures);

/// Imports a pbrt or mesh file, with options.joined_files, and prints its diagnostics.
/// @param keep_textures as in ImportOptions
/// Throws Error(kInput) if the file cannot be read, does not have the requested world, or has no triangles, or if
/// strict is set and there was a problem. Throws Error(kUsage) if an output would replace one of the scene's files.
ImportResult import_for_command(const std::filesystem::path& file, const SceneOptions& scene_options,
                                const GlobalOptions& globals, Progress& progress, ProgressDisplay& display,
                                bool keep_textures = false);

/// One line about the scene's cameras that could not be imported; empty if there are none.
std::string left_out_cameras_text(const ImportResult& imported);

/// Numbers of problems that an import reported: {"notes", "warnings", "errors"}.
nlohmann::json problems_json(const ImportStatistics& statistics);

/// A loaded .ptk or .pbrt file, ready for tracing.
struct LoadedScene {
  std::vector<std::byte> copy;         ///< the file's bytes, if `baked` refers to a private copy
  std::optional<BakedFile> baked;      ///< set for .ptk files
  std::unique_ptr<Scene> imported;     ///< set for .pbrt files
  std::unique_ptr<SceneSource> source; ///< view of `baked` or `imported`
  MemoryReservation memory;            ///< reservation for the loaded data

  /// Reads a .ptk file into `copy` and lets `baked` refer to it. Throws MemoryError, and like
  /// BakedFile::borrow_bytes().
  void copy_file(const std::filesystem::path& file, const MemoryBudget& budget);
};

/// Loads a .ptk file, or imports a .pbrt scene.
/// @param private_copy read a .ptk file into memory instead of mapping it
/// Throws like BakedFile::open(), reserve_decoded(), require_no_scene_choice() and import_for_command().
LoadedScene load_scene(const std::filesystem::path& file, const SceneOptions& scene_options,
                       const GlobalOptions& globals, Progress& progress, ProgressDisplay& display,
                       bool private_copy = false);

} // namespace packtrace
