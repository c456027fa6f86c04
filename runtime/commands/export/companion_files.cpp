#include "runtime/commands/export/companion_files.h"

#include <ranges>
#include <system_error>

#include "pbrt_import/base/output_file.h"

namespace packtrace {

namespace fs = std::filesystem;

CompanionFiles::CompanionFiles(const fs::path& main, fs::path input, bool force)
    : folder_(main.parent_path()), input_(std::move(input)), force_(force) {}

CompanionFiles::~CompanionFiles() {
  std::error_code ignored; // a folder that others have filled meanwhile stays
  for (const std::unique_ptr<ReplacedFile>& file : replaced_) file->restore();
  for (const fs::path& path : created_ | std::views::reverse) fs::remove(path, ignored);
}

void CompanionFiles::check(const std::string& name) const {
  const fs::path path = folder_ / name;
  std::error_code error;
  if (path.parent_path() != folder_ && !fs::exists(fs::symlink_status(path.parent_path(), error))) return; // it is made
  const OutputFile probe(path, force_);
  refuse_to_replace({input_}, path);
}

void CompanionFiles::write(std::span<const ExportedFile> files, Progress& progress) {
  for (const ExportedFile& file : files) check(file.name);
  for (const ExportedFile& file : files) {
    progress.check_cancelled();
    const fs::path path = folder_ / file.name;
    std::error_code error; // OutputFile reports a folder that cannot be made
    if (path.parent_path() != folder_ && fs::create_directory(path.parent_path(), error))
      created_.push_back(path.parent_path());
    OutputFile output(path, force_);
    const bool existed = fs::exists(fs::symlink_status(output.target(), error));
    output.write(file.bytes);
    if (existed) replaced_.push_back(std::make_unique<ReplacedFile>(output.target()));
    output.commit();
    if (!existed) created_.push_back(output.target());
  }
}

void CompanionFiles::keep() {
  created_.clear();
  replaced_.clear();
}

} // namespace packtrace
