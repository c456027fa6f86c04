#include "pbrt_import/base/replaced_file.h"

#include <system_error>
#include <utility>

#include "pbrt_import/base/output_file.h"

namespace packtrace {

namespace fs = std::filesystem;

ReplacedFile::ReplacedFile(fs::path file) : file_(std::move(file)) {
  const fs::path name = new_temporary_name(file_.has_parent_path() ? file_.parent_path() : fs::path("."));
  std::error_code error;
  fs::create_hard_link(file_, name, error);
  if (!error) kept_ = name;
}

ReplacedFile::~ReplacedFile() {
  std::error_code ignored;
  if (!kept_.empty()) fs::remove(kept_, ignored);
}

void ReplacedFile::restore() noexcept {
  std::error_code error; // if both are one file still, both names stay
  if (kept_.empty()) return;
  fs::rename(kept_, file_, error);
  if (error) kept_.clear(); // the content stays under its temporary name
}

} // namespace packtrace
