#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <unordered_set>
#include <vector>

#include "pbrt_import/language/parameters.h"

namespace packtrace {

class Reporter;

/// Turns file names of scene files into paths, all relative to the main file's folder.
class FileNames {
public:
  /// @param allow_outside whether names may lead out of folder
  FileNames(std::filesystem::path folder, bool allow_outside);

  /// The path that raw, a string of the scene with its escapes in place, names. Back-slashes of Windows exporters are
  /// read as slashes if only that finds a file (reported once). The file need not exist.
  /// @return empty, and an error is reported, if the name is empty or leads out of the folder against the rules
  std::filesystem::path resolve(std::string_view raw, const Place& place, Reporter& reporter);

  /// Takes note of a name that is of no use to the import, but is a file of the scene all the same.
  void mention(std::string_view raw);

  /// What the names given to both stand for, each path once, in no order. Call once.
  std::vector<std::filesystem::path> take_named();

private:
  std::filesystem::path folder_;
  bool allow_outside_;
  std::unordered_set<std::string> named_;
};

} // namespace packtrace
