#include "pbrt_import/base/output_file.h"

#include <array>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <mutex>
#include <optional>
#include <set>
#include <string_view>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/sendfile.h>
#include <sys/stat.h>
#include <unistd.h>

#include "pbrt_import/base/file_error.h"

namespace packtrace {

namespace fs = std::filesystem;

namespace {

/// Paths of temporary files for a signal handler, which must neither lock nor allocate. If the slots run out, further
/// files are only removed by their destructors.
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

/// Targets of all uncommitted OutputFiles, used to reject duplicates.
class Claims {
public:
  /// @return false if another file has claimed the target
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

  /// @return true for the first file in a folder
  bool add_folder(const fs::path& folder) {
    const std::scoped_lock lock(mutex_);
    return folders_.insert(folder).second;
  }

private:
  mutable std::mutex mutex_;
  std::set<fs::path> targets_, folders_;
};
Claims claims;

/// Canonical path of a target.
fs::path claim_of(const fs::path& target) {
  std::error_code error;
  const fs::path canonical = fs::weakly_canonical(fs::absolute(target, error), error);
  return error ? target : canonical;
}

/// Path under /proc by which an open file can be opened again and linked.
std::string name_of(const Descriptor& file) { return "/proc/self/fd/" + std::to_string(file.get()); }

[[noreturn]] void fail(const fs::path& path, const std::string& what) { throw FileError(ErrorKind::kIo, path, what); }

void check_target(const fs::path& target, bool force) {
  std::error_code error;
  const fs::file_status status = fs::symlink_status(target, error);
  if (!fs::exists(status)) return;
  if (fs::is_directory(status)) fail(target, "is a folder");
  if (!fs::is_regular_file(status)) fail(target, "exists and is not a regular file");
  if (!force) fail(target, "exists already; --force replaces it");
}

/// Follows symbolic links, so that renaming replaces the linked file and not the link.
fs::path resolve(const fs::path& target) {
  std::error_code error;
  if (!fs::is_symlink(fs::symlink_status(target, error))) return target;
  fs::path resolved = fs::weakly_canonical(target, error);
  if (error) fail(target, "cannot follow the link: " + error.message());
  return resolved;
}

constexpr std::string_view kPrefix = ".packtrace-", kSuffix = ".tmp";

fs::path folder_of(const fs::path& target) { return target.has_parent_path() ? target.parent_path() : fs::path("."); }

/// Process id of the owner of a temporary file; nullopt if the name is not that of a temporary file.
std::optional<pid_t> owner_of(std::string_view name) {
  if (!name.starts_with(kPrefix) || !name.ends_with(kSuffix)) return std::nullopt;
  name.remove_prefix(kPrefix.size());
  pid_t owner = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), owner);
  if (error != std::errc() || owner <= 0 || *end != '-') return std::nullopt;
  return owner;
}

constexpr int kMaxNameAttempts = 1000;

/// Creates a file without a name. Returns an invalid descriptor if the file system does not support it, or if /proc,
/// which is needed to name the file later, is not available.
Descriptor create_nameless(const fs::path& folder) {
  Descriptor file(open(folder.c_str(), O_RDWR | O_TMPFILE | O_CLOEXEC, 0666));
  if (file.valid() && access(name_of(file).c_str(), W_OK) != 0) return Descriptor();
  return file;
}

/// Creates an empty file with a unique name, locked so that remove_stale_output() detects that it is in use.
Descriptor create_named(const fs::path& folder, const fs::path& target, fs::path& name) {
  for (int attempt = 0; attempt < kMaxNameAttempts; ++attempt) {
    name = new_temporary_name(folder);
    Descriptor file(open(name.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
    if (!file.valid()) {
      if (errno != EEXIST) fail(target, std::string("cannot write there: ") + std::strerror(errno));
      continue;
    }
    flock(file.get(), LOCK_EX); // without file locks, the process id in the name protects it
    struct stat info{};
    if (fstat(file.get(), &info) == 0 && info.st_nlink > 0) return file; // otherwise it was removed as a stale file
  }
  fail(target, "cannot find a free temporary name");
}

/// Flushes the file before it gets its name, so that after a crash the name refers to either the old file or the
/// complete new one.
void flush_to_disk(const Descriptor& file, const fs::path& target) {
  if (fsync(file.get()) == 0 || errno == EINVAL) return; // EINVAL: not supported by this file system
  fail(target, std::string("cannot be written to disk: ") + std::strerror(errno));
}

/// Renames without replacing an existing file, atomically if the file system supports it. Returns 0 or errno.
int rename_if_free(const fs::path& from, const fs::path& to) {
  if (renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return 0;
  if (errno != EINVAL && errno != ENOSYS) return errno;
  std::error_code error;
  if (fs::exists(fs::symlink_status(to, error))) return EEXIST;
  return std::rename(from.c_str(), to.c_str()) == 0 ? 0 : errno;
}

} // namespace

fs::path new_temporary_name(const fs::path& folder) {
  static std::atomic<uint64_t> number{0};
  std::string name(kPrefix);
  name.append(std::to_string(getpid())).append("-").append(std::to_string(++number)).append(kSuffix);
  return folder / name;
}

OutputFile::OutputFile(fs::path target, bool force) : target_(std::move(target)), force_(force) {
  if (target_.empty()) throw Error(ErrorKind::kUsage, "the output file has an empty name");
  if (!target_.has_filename()) fail(target_, "is a folder");
  target_ = resolve(target_);
  check_target(target_, force_);
  const fs::path folder = folder_of(target_);
  if (claims.add_folder(folder)) remove_stale_output(folder);
  descriptor_ = create_nameless(folder);
  if (!descriptor_.valid()) descriptor_ = create_named(folder, target_, temporary_);
  path_ = temporary_.empty() ? fs::path(name_of(descriptor_)) : temporary_;
  if (!claims.add(claim_of(target_))) {
    std::error_code ignored;
    if (!temporary_.empty()) fs::remove(temporary_, ignored);
    throw Error(ErrorKind::kUsage, target_.string() + ": two outputs would go to this file");
  }
  if (!temporary_.empty()) remember(temporary_.c_str());
}

OutputFile::~OutputFile() {
  if (committed_) return;
  claims.remove(claim_of(target_));
  if (temporary_.empty()) return;
  forget(temporary_.c_str());
  std::error_code ignored;
  fs::remove(temporary_, ignored);
}

void OutputFile::write(std::span<const std::byte> bytes) {
  if (ftruncate(descriptor_.get(), 0) != 0) fail(target_, std::string("cannot write: ") + std::strerror(errno));
  written_ = 0;
  append(bytes);
}

void OutputFile::append(std::span<const std::byte> bytes) {
  int error = 0;
  while (!bytes.empty() && error == 0) {
    const ssize_t n = pwrite(descriptor_.get(), bytes.data(), bytes.size(), static_cast<off_t>(written_));
    if (n < 0 && errno != EINTR) error = errno;
    if (n <= 0) continue;
    written_ += static_cast<uint64_t>(n);
    bytes = bytes.subspan(static_cast<size_t>(n));
  }
  if (error == EFBIG) fail(target_, "cannot write: larger than files may be here (see ulimit -f)");
  if (error != 0) fail(target_, std::string("cannot write: ") + std::strerror(error));
}

/// Gives a nameless file a temporary name, from which it can be renamed over an existing file.
void OutputFile::give_name() {
  const fs::path folder = folder_of(target_);
  for (int attempt = 0; attempt < kMaxNameAttempts; ++attempt) {
    temporary_ = new_temporary_name(folder);
    remember(temporary_.c_str());
    flock(descriptor_.get(), LOCK_EX);
    if (linkat(AT_FDCWD, path_.c_str(), AT_FDCWD, temporary_.c_str(), AT_SYMLINK_FOLLOW) == 0) return;
    const int error = errno;
    forget(temporary_.c_str());
    temporary_.clear();
    if (error != EEXIST) return copy_to_named();
  }
  fail(target_, "cannot find a free temporary name");
}

/// Copies the content to a named file, for file systems that create nameless files but cannot link them.
void OutputFile::copy_to_named() {
  fs::path name;
  Descriptor copy = create_named(folder_of(target_), target_, name);
  temporary_ = std::move(name);
  remember(temporary_.c_str());
  off_t offset = 0;
  ssize_t n = 0;
  do n = sendfile(copy.get(), descriptor_.get(), &offset, size_t{1} << 30);
  while (n > 0 || (n < 0 && errno == EINTR));
  if (n < 0) fail(target_, std::string("cannot be put in place: ") + std::strerror(errno));
  descriptor_ = std::move(copy);
  flush_to_disk(descriptor_, target_);
}

/// Links or renames the file to the target.
/// @return 0 or the value of errno
int OutputFile::put_in_place() {
  if (temporary_.empty() && !force_) {
    if (linkat(AT_FDCWD, path_.c_str(), AT_FDCWD, target_.c_str(), AT_SYMLINK_FOLLOW) == 0) return 0;
    if (errno == EEXIST) return EEXIST;
  }
  if (temporary_.empty()) give_name();
  if (!force_) return rename_if_free(temporary_, target_);
  return std::rename(temporary_.c_str(), target_.c_str()) == 0 ? 0 : errno;
}

void OutputFile::commit() {
  flush_to_disk(descriptor_, target_);
  const int error = put_in_place();
  if (error == EEXIST) fail(target_, "appeared while it was being made; --force replaces it");
  if (error != 0) fail(target_, std::string("cannot be put in place: ") + std::strerror(error));
  if (!temporary_.empty()) forget(temporary_.c_str());
  claims.remove(claim_of(target_));
  committed_ = true;
  descriptor_ = Descriptor(); // also releases the lock
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

void remove_stale_output(const fs::path& folder) noexcept {
  try {
    std::error_code error;
    for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
      const std::optional<pid_t> owner = owner_of(entry->path().filename().native());
      if (!owner || kill(*owner, 0) == 0 || errno != ESRCH) continue;
      // A process on another machine or in another process namespace still holds the lock of its file.
      const Descriptor file(open(entry->path().c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
      if (file.valid() && flock(file.get(), LOCK_EX | LOCK_NB) == 0) unlink(entry->path().c_str());
    }
  } catch (const std::exception&) {
    // Stale files that remain are harmless.
  }
}

} // namespace packtrace
