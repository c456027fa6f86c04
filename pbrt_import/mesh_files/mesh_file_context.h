#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "pbrt_import/import_scene.h"
#include "pbrt_import/mesh_files/directive_feed.h"

namespace packtrace {

/// Shared state of the readers of mesh files.
struct MeshFileContext {
  const ImportOptions& options;
  DirectiveFeed& feed;
  SourceFiles& files;                        ///< receives the files that are read
  FileNames& file_names;                     ///< receives images within files
  ImportStatistics& statistics;              ///< files and bytes read are added
  std::vector<std::filesystem::path>& named; ///< receives the files that the file names
  Progress& progress;
};

/// Content of a text file, followed by kScannerReach zeros.
struct PaddedText {
  std::vector<std::byte> bytes;
  MemoryReservation memory;
  std::string_view text; ///< without the zeros
};

/// Reads a file, inflated if it is compressed, and counts it. Throws Error like read_whole_file(); MemoryError.
PaddedText read_padded(const std::filesystem::path& file, const MeshFileContext& context);

/// Adds a file that another one names, and returns its number in SourceFiles.
uint32_t add_source(const std::filesystem::path& file, std::optional<Place> named_at, const MeshFileContext& context);

} // namespace packtrace
