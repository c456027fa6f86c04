#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "pbrt_import/language/parameters.h"

namespace packtrace {

class Reporter;

/// Resolves file names of a scene to paths, relative to the main file's folder. It also keeps track of all files that
/// the scene names.
class FileNames {
public:
  /// @param allow_outside whether names may refer to files outside the folder
  FileNames(std::filesystem::path folder, bool allow_outside);

  /// Path of a file name in the scene. Backslashes of Windows exporters are read as slashes, with a warning, if no file
  /// has the name as written, and either a file has the name with slashes or the name contains an unknown escape. The
  /// file need not exist.
  /// @param raw string of the scene, escapes not yet replaced
  /// @return an empty path, with an error reported, if the name is empty or refers to a file outside the folder
  ///   although that is not allowed
  std::filesystem::path resolve(std::string_view raw, const Place& place, Reporter& reporter);

  /// Records a file that the scene names but the import does not read.
  void mention(std::string_view raw);

  /// Makes resolve() return a path as it is, back-slashes included, for files that were checked before.
  void accept(const std::filesystem::path& path) { accepted_.insert(path.string()); }

  /// Makes bytes known as a file of this name, for images within glTF files. A name that is in use is replaced.
  /// @param bytes must live as long as this object
  void embed(const std::string& name, std::span<const std::byte> bytes) { embedded_[name] = bytes; }
  /// Content of an embedded file by the path that resolve() returns for its name; empty if there is none.
  std::span<const std::byte> embedded(const std::filesystem::path& path) const {
    const auto found = embedded_.find(path.string());
    return found == embedded_.end() ? std::span<const std::byte>() : found->second;
  }

  /// Takes the paths of all names passed to resolve() and mention(), without duplicates, in no particular order. Call
  /// once.
  std::vector<std::filesystem::path> take_named();

private:
  std::filesystem::path folder_;
  bool allow_outside_;
  std::unordered_set<std::string> named_, accepted_;
  std::unordered_map<std::string, std::span<const std::byte>> embedded_;
};

} // namespace packtrace
