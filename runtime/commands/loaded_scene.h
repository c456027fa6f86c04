#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "compress/format/file/baked_file.h"
#include "pbrt_import/base/progress.h"
#include "pbrt_import/import_scene.h"
#include "runtime/commands/cli_support.h"
#include "runtime/commands/progress_display.h"
#include "runtime/trace/source/scene_source.h"

namespace packtrace {

/// True for .ptk files: by the name, or by the first bytes where the name says something else.
bool is_baked_file(const std::filesystem::path& file);

/// Memory for what a .ptk of codec fast or small is decoded to, as far as its header can be read. Throws MemoryError.
MemoryReservation reserve_decoded(const std::filesystem::path& file, const MemoryBudget& budget);

/// How verbs read a pbrt scene; as in ImportOptions.
struct SceneOptions {
  bool strict = false;
  std::optional<uint32_t> world;
  std::optional<double> time;
};

/// Adds --strict, --world and --time to a verb; options must outlive it.
void add_scene_options(CLI::App& verb, SceneOptions& options);

/// Throws Error(kUsage) where options ask for what only a .pbrt scene has: a baked file holds one world at one time.
void require_no_scene_choice(const std::filesystem::path& file, const SceneOptions& options);

/// Imports a pbrt file, prints its diagnostics, and refuses scenes without triangles, and outputs in the place of files
/// that the scene is made of.
/// @param keep_textures as in ImportOptions
/// Throws Error(kInput) where the file cannot be read, lacks the world asked for, nothing is left of it, or strict is
/// set and there was a problem; Error(kUsage) like refuse_to_replace().
ImportResult import_for_command(const std::filesystem::path& file, const SceneOptions& scene_options,
                                const GlobalOptions& globals, Progress& progress, ProgressDisplay& display,
                                bool keep_textures = false);

/// A line on cameras that the scene has and the import could not use; empty if there are none.
std::string left_out_cameras_text(const ImportResult& imported);

/// How many problems an import reported: {notes, warnings, errors}.
nlohmann::json problems_json(const ImportStatistics& statistics);

/// A scene on disk, packed or not, ready to be traced.
struct LoadedScene {
  std::vector<std::byte> copy;         ///< of the file, where baked is to be over that
  std::optional<BakedFile> baked;      ///< of a .ptk
  std::unique_ptr<Scene> imported;     ///< of a .pbrt
  std::unique_ptr<SceneSource> source; ///< over one of the two
  MemoryReservation memory;            ///< of what is held in memory

  /// Reads a .ptk into copy and puts baked over that.
  void copy_file(const std::filesystem::path& file, const MemoryBudget& budget);
};

/// @param private_copy read a .ptk into memory instead of mapping it
/// Throws like BakedFile::open(), reserve_decoded(), require_no_scene_choice() and import_for_command().
LoadedScene load_scene(const std::filesystem::path& file, const SceneOptions& scene_options,
                       const GlobalOptions& globals, Progress& progress, ProgressDisplay& display,
                       bool private_copy = false);

} // namespace packtrace
