#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "tests/temporary_folder.h"

namespace packtrace::fuzz {

/// A text can represent a scene of several files. The main file extends to the first line "#file NAME"; each such line
/// starts another file. NAME consists of letters, digits, '.', '_' and '-'; other such lines are content. A file's
/// content ends before the line end in front of the next "#file" line, so it may be binary.
struct SceneFile {
  std::string_view name;
  std::string_view content;
};

/// Splits a text into files; the first is named scene.pbrt. Returns at most kMaxSceneFiles files and drops the rest of
/// the text.
inline constexpr size_t kMaxSceneFiles = 8;
std::vector<SceneFile> split_scene(std::string_view text);

/// A temporary folder, in memory if the system has such folders; removed by the destructor.
class SceneFilesFolder {
public:
  SceneFilesFolder();

  /// Replaces the folder's files.
  /// @return the main file
  std::filesystem::path write(std::string_view text);

private:
  TemporaryFolder folder_;
  std::vector<std::filesystem::path> files_;
};

} // namespace packtrace::fuzz
