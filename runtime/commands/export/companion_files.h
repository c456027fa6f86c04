#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "compress/exchange/scene/exported_file.h"
#include "pbrt_import/base/progress.h"
#include "pbrt_import/base/replaced_file.h"

namespace packtrace {

/// The files beside the main file of an export. Unless keep() is called, the destructor removes those that were not
/// there before, and their folder if it was not, and puts back those that were replaced (force). A second Ctrl-C ends
/// the process without the destructor.
class CompanionFiles {
public:
  /// @param main the main file, whose folder the names are relative to
  /// @param input read by the command, so it cannot be replaced
  /// @param force whether existing files may be replaced
  CompanionFiles(const std::filesystem::path& main, std::filesystem::path input, bool force);
  ~CompanionFiles();
  CompanionFiles(const CompanionFiles&) = delete;
  CompanionFiles& operator=(const CompanionFiles&) = delete;

  /// Throws what write() would throw for a file of this name, and writes nothing.
  void check(const std::string& name) const;
  /// Checks all files, then writes them. Throws like OutputFile and refuse_to_replace(); Error(kCancelled).
  void write(std::span<const ExportedFile> files, Progress& progress);
  /// Call it when the main file is in place.
  void keep();

private:
  const std::filesystem::path folder_, input_;
  const bool force_;
  std::vector<std::filesystem::path> created_; ///< in the order in which they were made
  std::vector<std::unique_ptr<ReplacedFile>> replaced_;
};

} // namespace packtrace
