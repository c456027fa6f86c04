#include "pbrt_import/base/replaced_file.h"

#include <utility>

#include <fcntl.h>
#include <sys/file.h>

#include "pbrt_import/base/file_error.h"
#include "pbrt_import/base/output_file.h"

namespace packtrace {

namespace fs = std::filesystem;

ReplacedFile::ReplacedFile(fs::path file, Link& link) : file_(std::move(file)) {
  std::error_code error;
  if (!fs::exists(fs::symlink_status(file_, error))) return;
  const fs::path name = new_temporary_name(file_.has_parent_path() ? file_.parent_path() : fs::path("."));
  link(file_, name, error);
  if (error) fs::copy_file(file_, name, error);
  if (error) {
    std::error_code ignored; // of removing a copy that is not complete
    fs::remove(name, ignored);
    throw FileError(ErrorKind::kIo, file_, "its content cannot be kept while it is replaced: " + error.message());
  }
  kept_ = name;
  lock_ = Descriptor(open(kept_.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  if (lock_.valid()) flock(lock_.get(), LOCK_SH | LOCK_NB);
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
