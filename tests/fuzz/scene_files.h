#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "tests/temporary_folder.h"

namespace packtrace::fuzz {

/// One text that stands for a scene of several files: the main file goes up to the first line "#file NAME", each such
/// line starts another file. NAME is of letters, digits, '.', '_' and '-'; other such lines are content. A file's
/// content ends before the line end that precedes the next such line, so it may be binary.
struct SceneFile {
  std::string_view name;
  std::string_view content;
};

/// The parts of a text, the first named scene.pbrt; at most kMaxSceneFiles, the rest of the text is dropped.
inline constexpr size_t kMaxSceneFiles = 8;
std::vector<SceneFile> split_scene(std::string_view text);

/// A folder of its own, in memory where the system has such folders; removed in the end.
class SceneFilesFolder {
public:
  SceneFilesFolder();

  /// Replaces the folder's files. @return the main file
  std::filesystem::path write(std::string_view text);

private:
  TemporaryFolder folder_;
  std::vector<std::filesystem::path> files_;
};

} // namespace packtrace::fuzz
