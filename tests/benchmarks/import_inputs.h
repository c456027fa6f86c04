#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace packtrace {

/// Something to import, with what an import of it must find.
struct ImportInput {
  std::string name;
  std::filesystem::path main_file;
  std::vector<std::filesystem::path> files; ///< what there is to read: the PLY files, or else all scene text
  uint64_t bytes = 0;                       ///< of these files
  bool binary = false;                      ///< they are PLY, not text
  std::optional<uint64_t> triangles;        ///< stored; none: not known
  std::optional<uint64_t> instances;
};

/// The names make_input() takes, in the order of docs/import_speed.md.
std::span<const std::string_view> input_names();

/// Writes an input into a folder of its own under `folder`; what an earlier call wrote there is used again. The same
/// bytes on every machine.
/// @param scale of the counts, in (0, 1]; at least one of everything is written
/// Throws Error(kUsage) for an unknown name or scale, Error(kIo) if the disk refuses.
ImportInput make_input(std::string_view name, const std::filesystem::path& folder, double scale);

/// A scene that exists; it may have faults. Throws std::filesystem::filesystem_error if its folder cannot be listed.
ImportInput existing_scene(std::string_view name, const std::filesystem::path& main_file);

} // namespace packtrace
