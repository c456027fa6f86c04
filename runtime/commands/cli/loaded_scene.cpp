#include "runtime/commands/cli/loaded_scene.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pbrt_import/base/file_bytes.h"
#include "pbrt_import/base/file_error.h"
#include "pbrt_import/base/output_file.h"
#include "pbrt_import/base/regular_file.h"
#include "pbrt_import/base/with_file.h"
#include "pbrt_import/scene/separate_motion.h"
#include "pbrt_import/scene_format.h"
#include "pbrt_import/text/input_file.h"
#include "runtime/commands/cli/option_checks.h"
#include "runtime/measure/knobs.h"
#include "runtime/trace/source/float_source.h"
#include "runtime/trace/source/packed_source.h"

namespace packtrace {

bool is_baked_file(const std::filesystem::path& file) {
  if (ending_of(file) == ".ptk") return true;
  const std::string start = read_file_start(file, baked::kMagic.size());
  return std::equal(start.begin(), start.end(), baked::kMagic.begin(), baked::kMagic.end(),
                    [](char a, uint8_t b) { return static_cast<uint8_t>(a) == b; });
}

MemoryReservation reserve_decoded(const std::filesystem::path& file, const MemoryBudget& budget) {
  baked::PagedHeader header;
  const std::string start = read_file_start(file, sizeof header);
  MemoryReservation memory(budget);
  if (start.size() < sizeof header || !is_paged_file(std::as_bytes(std::span(start)))) return memory;
  std::memcpy(&header, start.data(), sizeof header);
  with_file(file, [&] { memory.resize(header.resident_bytes, "decoding the file"); });
  return memory;
}

void add_scene_options(CLI::App& verb, SceneOptions& options) {
  constexpr const char* kGroup = "Options for .pbrt scenes and mesh files";
  verb.add_flag("--strict", options.strict,
                "Fail if reading the scene reports any warning or error, instead of continuing with the rest")
      ->group(kGroup);
  verb.add_option("--world", options.world,
                  "Number of the world to read from a file with several WorldBegin blocks, from 1 (default 1)")
      ->check(CLI::Range(1u, UINT32_MAX))
      ->type_name("N")
      ->group(kGroup);
  verb.add_option("--time", options.time,
                  "Time at which to evaluate animated transforms, in the unit of TransformTimes (default: the time at "
                  "which the camera's shutter opens); of glTF files seconds (default 0)")
      ->type_name("T")
      ->group(kGroup);
  constexpr const char* kMeshGroup = "Options for mesh files (.ply, .obj, .stl, .gltf, .glb)";
  verb.add_option("--up", options.up, "Axis of the file that points upwards (default y; scenes have y)")
      ->check(one_of({"x", "y", "z"}))
      ->group(kMeshGroup);
  verb.add_option("--scale", options.scale, "Factor of all coordinates (default 1)")
      ->check(number_in(1e-30, 1e30))
      ->group(kMeshGroup);
  verb.add_option("--animation", options.animation, "Animation of a glTF file, by name or by number from 0 (default 0)")
      ->type_name("NAME|N")
      ->group(kMeshGroup);
  verb.add_flag("--allow-outside", options.allow_outside, "Read files outside a glTF file's folder that it names")
      ->group(kMeshGroup);
}

std::vector<std::string> scene_words(const SceneOptions& options) {
  std::vector<std::string> words;
  const auto add = [&](const char* name, const std::string& value) { words.insert(words.end(), {name, value}); };
  if (options.world) add("--world", std::to_string(*options.world));
  if (options.time) add("--time", number_text(*options.time));
  if (options.animation) add("--animation", *options.animation);
  if (options.up) add("--up", *options.up);
  if (options.scale) add("--scale", number_text(*options.scale));
  if (options.allow_outside) words.emplace_back("--allow-outside");
  if (options.strict) words.emplace_back("--strict");
  return words;
}

const char* option_without_use(const std::filesystem::path& file, const SceneOptions& options) {
  const bool baked = is_baked_file(file), mesh = !baked && scene_format(file) != SceneFormat::kPbrt;
  if (baked || mesh) {
    const bool gltf = mesh && scene_format(file) == SceneFormat::kGltf;
    if (options.time && !gltf) return "--time";
    if (options.animation && !gltf) return "--animation";
    if (options.world.value_or(1) != 1) return "--world";
  }
  if (!mesh) return options.up ? "--up" : options.scale ? "--scale" : options.animation ? "--animation" : nullptr;
  return nullptr;
}

void require_no_scene_choice(const std::filesystem::path& file, const SceneOptions& options) {
  if (const char* const option = option_without_use(file, options))
    throw FileError(ErrorKind::kUsage, file,
                    std::string(option) + " does not apply to a .ptk file: bake has chosen its world, time, and size");
}

namespace {

/// Throws Error(kInput) for files that are obviously not pbrt scenes. The parser would report them byte by byte.
void require_scene_text(const std::filesystem::path& file) {
  std::array<char, 512> start{};
  size_t size = 0;
  try {
    size = InputFile(file, start.size()).read(start); // decompresses .gz files
  } catch (const Error&) {
    return; // the import reports the error
  }
  const std::string_view text(start.data(), size);
  if (is_baked_file(file))
    throw FileError(ErrorKind::kInput, file, "already a baked file; use the .pbrt scene it was made from");
  if (text.find('\0') != std::string::npos)
    throw FileError(ErrorKind::kInput, file, "not a text file, so not a pbrt-v3 scene");
}

} // namespace

std::string left_out_cameras_text(const ImportResult& imported) {
  const uint64_t left_out = imported.statistics.cameras_left_out;
  if (left_out == 0) return {};
  return fmt::format("{} camera{} skipped because of the errors above; {}\n", left_out,
                     left_out == 1 ? " was" : "s were",
                     imported.scene.cameras.empty() ? "render will show the whole scene"
                                                    : "camera 0 is the last of the remaining ones");
}

nlohmann::json problems_json(const ImportStatistics& statistics) {
  const auto count = [&](Severity severity) { return statistics.problems[static_cast<size_t>(severity)]; };
  return {
      {"notes", count(Severity::kNote)}, {"warnings", count(Severity::kWarning)}, {"errors", count(Severity::kError)}};
}

ImportOptions import_options(const SceneOptions& scene_options, const GlobalOptions& globals, bool keep_textures) {
  ImportOptions options;
  options.strict = scene_options.strict;
  options.world = scene_options.world;
  options.time = scene_options.time;
  const std::string up = scene_options.up.value_or("y");
  options.mesh_up = up == "x" ? UpAxis::kX : up == "z" ? UpAxis::kZ : UpAxis::kY;
  options.allow_uris_outside_folder = scene_options.allow_outside;
  options.mesh_scale = scene_options.scale.value_or(1.0);
  options.keep_textures = keep_textures;
  options.keep_unused_objects = scene_options.keep_unused_objects;
  options.keep_shading = scene_options.keep_shading;
  options.memory = globals.memory;
  options.animation = scene_options.animation;
  options.frames_per_second = scene_options.frames_per_second;
  return options;
}

ImportResult import_for_command(const std::filesystem::path& file, const SceneOptions& scene_options,
                                const GlobalOptions& globals, Progress& progress, ProgressDisplay& display,
                                bool keep_textures) {
  const SceneFormat format = scene_format(file);
  if (format == SceneFormat::kPbrt) require_scene_text(file);
  if (const char* const option = option_without_use(file, scene_options))
    throw FileError(ErrorKind::kUsage, file,
                    std::string(option) + (format == SceneFormat::kPbrt ? " only applies to mesh files"
                                                                        : " only applies to .pbrt scenes"));
  Diagnostics diagnostics;
  const ImportOptions options = import_options(scene_options, globals, keep_textures);
  ImportResult result;
  try {
    if (scene_options.joined_files.empty()) {
      result = import_scene(file, options, diagnostics, progress);
    } else {
      std::vector<std::filesystem::path> files{file};
      files.insert(files.end(), scene_options.joined_files.begin(), scene_options.joined_files.end());
      result = import_mesh_files(files, options, diagnostics, progress);
    }
  } catch (const Error&) { // earlier diagnostics may explain the error
    display.finish();
    report_diagnostics(diagnostics, globals);
    throw;
  }
  display.finish();
  refuse_to_replace(result.files);
  const bool empty = placed_triangle_count(result.scene) == 0;
  GlobalOptions shown = globals;
  if (empty) shown.verbosity = std::max(shown.verbosity, 1); // notes may explain why
  report_diagnostics(diagnostics, shown);
  if (empty) throw FileError(ErrorKind::kInput, file, "the scene has no triangles to work with");
  return result;
}

void LoadedScene::copy_file(const std::filesystem::path& file, const MemoryBudget& budget) {
  std::error_code unknown; // reading the file reports the error
  const uint64_t bytes = std::filesystem::file_size(file, unknown);
  with_file(file, [&] { memory.merge(MemoryReservation(budget, unknown ? 0 : bytes, "a private copy")); });
  copy = read_file_bytes(file, unknown ? 0 : bytes);
  baked.emplace(BakedFile::borrow_bytes(copy, file.string()));
}

LoadedScene load_scene(const std::filesystem::path& file, const SceneOptions& scene_options,
                       const GlobalOptions& globals, Progress& progress, ProgressDisplay& display, bool private_copy) {
  LoadedScene loaded;
  if (is_baked_file(file)) {
    require_no_scene_choice(file, scene_options);
    refuse_to_replace({file});
    loaded.memory = reserve_decoded(file, globals.memory);
    if (private_copy)
      loaded.copy_file(file, globals.memory);
    else
      loaded.baked.emplace(BakedFile::open(file));
    loaded.source = std::make_unique<PackedSource>(*loaded.baked);
  } else {
    ImportResult imported = import_for_command(file, scene_options, globals, progress, display, true);
    loaded.imported = std::make_unique<Scene>(std::move(imported.scene));
    separate_motion(*loaded.imported); // as bake does, so that instances have the same numbers
    loaded.memory = std::move(imported.memory);
    loaded.source = std::make_unique<FloatSource>(*loaded.imported);
  }
  return loaded;
}

} // namespace packtrace
