#include "compress/format/mapped_file.h"

#include <cerrno>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>

#include "pbrt_import/scene/file_error.h"

namespace packtrace {
namespace {

struct Descriptor {
  int fd = -1;
  explicit Descriptor(int descriptor) : fd(descriptor) {}
  ~Descriptor() {
    if (fd >= 0) ::close(fd);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
};

[[noreturn]] void fail(ErrorKind kind, const std::filesystem::path& path, int code) {
  throw FileError(kind, path, std::generic_category().message(code));
}

} // namespace

MappedFile::MappedFile(const std::filesystem::path& path) {
  // Not blocking: opening a pipe for reading would otherwise wait for a writer before it can be refused.
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.fd < 0) fail(errno == ENOENT || errno == ENOTDIR ? ErrorKind::kInput : ErrorKind::kIo, path, errno);
  struct stat status {};
  if (::fstat(file.fd, &status) != 0) fail(ErrorKind::kIo, path, errno);
  if (!S_ISREG(status.st_mode)) throw FileError(ErrorKind::kInput, path, "not a regular file");
  const auto size = static_cast<size_t>(status.st_size);
  if (size == 0) return; // mmap refuses it; the reader reports it as truncated
  void* address = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file.fd, 0);
  if (address == MAP_FAILED) fail(ErrorKind::kIo, path, errno);
  bytes_ = {static_cast<const std::byte*>(address), size};
}

MappedFile::~MappedFile() {
  if (!bytes_.empty()) ::munmap(const_cast<std::byte*>(bytes_.data()), bytes_.size());
}

} // namespace packtrace
