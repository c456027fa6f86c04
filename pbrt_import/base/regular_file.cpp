#include "pbrt_import/base/regular_file.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

[[noreturn]] void fail(const std::string& what) { throw Error(ErrorKind::kInput, what); }

void require_regular(mode_t mode) {
  if (S_ISREG(mode)) return;
  if (S_ISDIR(mode)) fail("is a directory, not a file");
  if (S_ISFIFO(mode)) fail("is a pipe, not a file; save what it delivers in a file first");
  if (S_ISSOCK(mode)) fail("is a socket, not a file");
  fail("is a device, not a file");
}

} // namespace

Descriptor::~Descriptor() {
  if (value_ >= 0) ::close(value_);
}

Descriptor& Descriptor::operator=(Descriptor&& other) noexcept {
  std::swap(value_, other.value_);
  return *this;
}

int Descriptor::release() { return std::exchange(value_, -1); }

RegularFile open_regular_file(const std::filesystem::path& path) {
  struct stat info{};
  // Checks the type before opening, because opening a device can have side effects.
  if (::stat(path.c_str(), &info) == 0) require_regular(info.st_mode);
  // Non-blocking, because the path may have become a pipe without a writer since the check.
  RegularFile file{Descriptor(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK))};
  if (!file.descriptor.valid())
    fail(errno == ENOENT ? "no such file" : std::string("cannot open: ") + std::strerror(errno));
  if (::fstat(file.descriptor.get(), &info) != 0) fail(std::string("cannot examine: ") + std::strerror(errno));
  require_regular(info.st_mode);
  file.bytes = static_cast<uint64_t>(info.st_size);
  file.device = info.st_dev;
  file.inode = info.st_ino;
  return file;
}

std::string read_file_start(const std::filesystem::path& path, size_t max_bytes) {
  try {
    const RegularFile file = open_regular_file(path);
    std::string start(max_bytes, '\0');
    const ssize_t got = ::pread(file.descriptor.get(), start.data(), start.size(), 0);
    start.resize(static_cast<size_t>(std::max<ssize_t>(got, 0)));
    return start;
  } catch (const Error&) {
    return {};
  }
}

} // namespace packtrace
