#include "pbrt_import/scene/output_file.h"

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <mutex>
#include <set>

#include <fcntl.h>
#include <unistd.h>

#include "pbrt_import/scene/file_error.h"

namespace packtrace {

namespace fs = std::filesystem;

namespace {

/// Names for a signal handler, which can neither lock nor allocate. More files than slots are possible; those beyond
/// are only removed by their destructors.
std::array<std::atomic<const char*>, 32> unfinished_paths{};
static_assert(std::atomic<const char*>::is_always_lock_free);

void remember(const char* path) {
  for (auto& slot : unfinished_paths) {
    const char* expected = nullptr;
    if (slot.compare_exchange_strong(expected, path)) return;
  }
}

void forget(const char* path) {
  for (auto& slot : unfinished_paths) {
    const char* expected = path;
    if (slot.compare_exchange_strong(expected, nullptr)) return;
  }
}

/// Targets of files that are neither committed nor gone, so that no two of them are the same.
class Claims {
public:
  /// @return false where another file has claimed it
  bool add(const fs::path& target) {
    const std::scoped_lock lock(mutex_);
    return targets_.insert(target).second;
  }
  void remove(const fs::path& target) {
    const std::scoped_lock lock(mutex_);
    targets_.erase(target);
  }
  std::set<fs::path> targets() const {
    const std::scoped_lock lock(mutex_);
    return targets_;
  }

private:
  mutable std::mutex mutex_;
  std::set<fs::path> targets_;
};
Claims claims;

/// One name for all ways to write it.
fs::path claim_of(const fs::path& target) {
  std::error_code error;
  const fs::path canonical = fs::weakly_canonical(fs::absolute(target, error), error);
  return error ? target : canonical;
}

[[noreturn]] void fail(const fs::path& path, const std::string& what) {
  throw FileError(ErrorKind::kIo, path, what);
}

void check_target(const fs::path& target, bool force) {
  std::error_code error;
  const fs::file_status status = fs::symlink_status(target, error);
  if (!fs::exists(status)) return;
  if (fs::is_directory(status)) fail(target, "is a folder");
  if (!fs::is_regular_file(status)) fail(target, "exists and is not a regular file");
  if (!force) fail(target, "exists already; --force replaces it");
}

/// Follows links, so that the rename replaces what a link leads to and not the link.
fs::path resolve(const fs::path& target) {
  std::error_code error;
  if (!fs::is_symlink(fs::symlink_status(target, error))) return target;
  fs::path resolved = fs::weakly_canonical(target, error);
  if (error) fail(target, "cannot follow the link: " + error.message());
  return resolved;
}

/// A new empty file with a name that nobody else has.
fs::path create_temporary(const fs::path& target) {
  static std::atomic<uint64_t> number{0};
  const fs::path folder = target.has_parent_path() ? target.parent_path() : fs::path(".");
  for (int attempt = 0; attempt < 1000; ++attempt) {
    fs::path path = folder / (".packtrace-" + std::to_string(getpid()) + "-" + std::to_string(++number) + ".tmp");
    const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (file >= 0) {
      close(file);
      return path;
    }
    if (errno != EEXIST) fail(target, std::string("cannot write there: ") + std::strerror(errno));
  }
  fail(target, "cannot find a free temporary name");
}

/// On disk before it gets its name: after a crash the name stands for the old file or for all of the new one.
void flush_to_disk(const fs::path& file, const fs::path& target) {
  const int descriptor = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  const bool flushed =
      descriptor >= 0 && (fsync(descriptor) == 0 || errno == EINVAL); // EINVAL: not for this file system
  const int error = errno;
  if (descriptor >= 0) close(descriptor);
  if (!flushed) fail(target, std::string("cannot be written to disk: ") + std::strerror(error));
}

/// Renames without replacing, where the file system can do that in one step.
int rename_if_free(const fs::path& from, const fs::path& to) {
  if (renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return 0;
  if (errno != EINVAL && errno != ENOSYS) return errno;
  std::error_code error;
  if (fs::exists(fs::symlink_status(to, error))) return EEXIST;
  return std::rename(from.c_str(), to.c_str()) == 0 ? 0 : errno;
}

} // namespace

OutputFile::OutputFile(fs::path target, bool force) : target_(std::move(target)), force_(force) {
  if (target_.empty()) throw Error(ErrorKind::kUsage, "the output file has an empty name");
  if (!target_.has_filename()) fail(target_, "is a folder");
  target_ = resolve(target_);
  check_target(target_, force_);
  temporary_ = create_temporary(target_);
  if (!claims.add(claim_of(target_))) {
    std::error_code ignored;
    fs::remove(temporary_, ignored);
    throw Error(ErrorKind::kUsage, target_.string() + ": two outputs would go to this file");
  }
  remember(temporary_.c_str());
}

OutputFile::~OutputFile() {
  if (committed_) return;
  claims.remove(claim_of(target_));
  forget(temporary_.c_str());
  std::error_code ignored;
  fs::remove(temporary_, ignored);
}

void OutputFile::write(const std::function<void(const fs::path&)>& work) const {
  try {
    work(temporary_);
  } catch (const Error& error) {
    const std::string mine = temporary_.string(), shown = target_.string();
    std::string message = error.what();
    const bool about_mine = message.starts_with(mine + ": ");
    if (about_mine) message.erase(0, mine.size() + 2);
    for (size_t at = message.find(mine); at != message.npos; at = message.find(mine, at + shown.size()))
      message.replace(at, mine.size(), shown);
    if (about_mine) throw FileError(error.kind(), target_, message);
    throw Error(error.kind(), message);
  }
}

void OutputFile::commit() {
  flush_to_disk(temporary_, target_);
  const int error = force_ ? (std::rename(temporary_.c_str(), target_.c_str()) == 0 ? 0 : errno)
                           : rename_if_free(temporary_, target_);
  if (error == EEXIST) fail(target_, "appeared while it was being made; --force replaces it");
  if (error != 0) fail(target_, std::string("cannot be put in place: ") + std::strerror(error));
  forget(temporary_.c_str());
  claims.remove(claim_of(target_));
  committed_ = true;
}

void refuse_to_replace(const std::vector<fs::path>& inputs, const fs::path& target) {
  std::error_code not_there;
  if (!fs::exists(target, not_there)) return;
  for (const fs::path& input : inputs)
    if (fs::equivalent(input, target, not_there))
      throw FileError(ErrorKind::kUsage, target, "this file is read, so it cannot be the output");
}

void refuse_to_replace(const std::vector<fs::path>& inputs) {
  for (const fs::path& target : claims.targets()) refuse_to_replace(inputs, target);
}

void remove_unfinished_output() noexcept {
  for (auto& slot : unfinished_paths)
    if (const char* path = slot.load()) unlink(path);
}

} // namespace packtrace
