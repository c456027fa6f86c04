#include "pbrt_import/base/file_bytes.h"

#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>

#include <unistd.h>

#include "pbrt_import/base/file_error.h"
#include "pbrt_import/base/memory_budget.h"
#include "pbrt_import/base/regular_file.h"

namespace packtrace {

namespace {

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

std::string reason(const std::filesystem::path& path, const char* what, int error) {
  return path.string() + ": " + what + ": " + std::strerror(error);
}

} // namespace

std::vector<std::byte> read_file_bytes(const std::filesystem::path& path, uint64_t max_bytes) {
  RegularFile file;
  try {
    file = open_regular_file(path);
  } catch (const Error& error) {
    throw FileError(error.kind(), path, error.what());
  }
  if (file.bytes > max_bytes) throw FileError(ErrorKind::kInput, path, "larger than " + memory_text(max_bytes));
  std::vector<std::byte> bytes(static_cast<size_t>(file.bytes));
  for (size_t done = 0; done < bytes.size();) {
    const ssize_t n = ::read(file.descriptor.get(), bytes.data() + done, bytes.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) throw Error(ErrorKind::kInput, reason(path, "cannot read", errno));
    if (n == 0) throw Error(ErrorKind::kInput, path.string() + ": cannot read all of it");
    done += static_cast<size_t>(n);
  }
  return bytes;
}

void write_file_bytes(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  File file(std::fopen(path.c_str(), "wb"));
  if (!file) throw Error(ErrorKind::kIo, reason(path, "cannot open for writing", errno));
  const bool written = bytes.empty() || std::fwrite(bytes.data(), 1, bytes.size(), file.get()) == bytes.size();
  const int write_error = errno;
  // A full disk may show only when buffered bytes are flushed on closing.
  const bool closed = std::fclose(file.release()) == 0;
  if (!written || !closed) throw Error(ErrorKind::kIo, reason(path, "cannot write", written ? errno : write_error));
}

} // namespace packtrace
