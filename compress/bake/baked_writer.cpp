#include "compress/bake/baked_writer.h"

#include <cerrno>
#include <cstdio>
#include <fcntl.h>
#include <string>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>

#include "pbrt_import/scene/error.h"

namespace packtrace {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, int code) {
  throw Error(ErrorKind::kIo, path.string() + ": " + std::generic_category().message(code));
}

/// A new file next to the one it shall replace; removed unless it was put in place.
class TemporaryFile {
public:
  explicit TemporaryFile(const std::filesystem::path& target) : target_(target) {
    for (int attempt = 0; fd_ < 0; ++attempt) {
      name_ = target.string() + ".tmp-" + std::to_string(::getpid()) + "-" + std::to_string(attempt);
      fd_ = ::open(name_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
      if (fd_ < 0 && (errno != EEXIST || attempt == 100)) fail(target, errno);
    }
  }
  ~TemporaryFile() {
    if (fd_ >= 0) ::close(fd_);
    if (!name_.empty()) ::unlink(name_.c_str());
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  void write(std::span<const std::byte> bytes) const {
    while (!bytes.empty()) {
      const ssize_t written = ::write(fd_, bytes.data(), bytes.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) fail(target_, errno);
      bytes = bytes.subspan(static_cast<size_t>(written));
    }
  }

  void put_in_place(bool force) {
    // On disk before it gets its name: after a crash the name stands for the old file or for all of the new one.
    if (::fsync(fd_) != 0) fail(target_, errno);
    const int closed = ::close(fd_);
    fd_ = -1;
    if (closed != 0) fail(target_, errno);
    if (force) {
      if (::rename(name_.c_str(), target_.c_str()) != 0) fail(target_, errno);
      name_.clear();
    } else if (::link(name_.c_str(), target_.c_str()) != 0) { // unlike rename, refuses a file that appeared meanwhile
      const int code = errno;
      if (code == EEXIST) fail(target_, code);
      if (::access(target_.c_str(), F_OK) == 0) fail(target_, EEXIST);
      if (::rename(name_.c_str(), target_.c_str()) != 0) fail(target_, errno); // file systems without hard links
      name_.clear();
    }
  }

private:
  const std::filesystem::path& target_;
  std::string name_;
  int fd_ = -1;
};

} // namespace

void check_output(const std::filesystem::path& path, bool force) {
  struct stat status {};
  if (::stat(path.c_str(), &status) == 0) {
    if (S_ISDIR(status.st_mode)) fail(path, EISDIR);
    if (!force) throw Error(ErrorKind::kIo, path.string() + ": exists already; use --force to replace it");
  } else if (errno != ENOENT) {
    fail(path, errno);
  }
  const std::filesystem::path parent = path.has_parent_path() ? path.parent_path() : ".";
  if (::stat(parent.c_str(), &status) != 0) fail(parent, errno);
  if (!S_ISDIR(status.st_mode)) fail(parent, ENOTDIR);
  if (::access(parent.c_str(), W_OK | X_OK) != 0) fail(parent, errno);
}

void write_file_atomically(const std::filesystem::path& path, std::span<const std::byte> bytes, bool force) {
  check_output(path, force);
  TemporaryFile file(path);
  file.write(bytes);
  file.put_in_place(force);
}

} // namespace packtrace
