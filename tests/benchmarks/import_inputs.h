#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace packtrace {

/// An input for import benchmarks, with the counts that an import of it must find.
struct ImportInput {
  std::string name;
  std::filesystem::path main_file;
  std::vector<std::filesystem::path> files; ///< the files to read: PLY files if there are any, otherwise all scene text
  uint64_t bytes = 0;                       ///< total size of `files`
  bool binary = false;                      ///< `files` are PLY, not text
  std::optional<uint64_t> triangles;        ///< stored triangles; nullopt: unknown
  std::optional<uint64_t> instances;
};

/// The names that make_input() accepts, in the order of docs/import_speed.md.
std::span<const std::string_view> input_names();

/// Writes an input into its own folder under `folder`, or reuses an earlier call's files. The bytes are equal on every
/// machine.
/// @param scale factor of the counts, in (0, 1]; at least one of each element is written
/// Throws Error(kUsage) for an unknown name or scale, Error(kIo) if writing fails.
ImportInput make_input(std::string_view name, const std::filesystem::path& folder, double scale);

/// An existing scene, which may have faults. Throws std::filesystem::filesystem_error if its folder cannot be listed.
ImportInput existing_scene(std::string_view name, const std::filesystem::path& main_file);

} // namespace packtrace
