#include "pbrt_import/scene/file_bytes.h"

#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>

#include "pbrt_import/scene/file_error.h"

namespace packtrace {

namespace {

constexpr uint64_t kMaxFileBytes = uint64_t{1} << 32;

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

std::string reason(const std::filesystem::path& path, const char* what, int error) {
  return path.string() + ": " + what + ": " + std::strerror(error);
}

} // namespace

std::vector<std::byte> read_file_bytes(const std::filesystem::path& path) {
  // Size first: opening a pipe or a device could block for ever.
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) throw FileError(ErrorKind::kInput, path, "no such file");
  if (!std::filesystem::is_regular_file(status)) throw FileError(ErrorKind::kInput, path, "not a regular file");
  const uint64_t size = std::filesystem::file_size(path, error);
  if (error) throw Error(ErrorKind::kInput, path.string() + ": cannot read: " + error.message());
  if (size > kMaxFileBytes) throw Error(ErrorKind::kInput, path.string() + ": larger than 4 GiB");

  const File file(std::fopen(path.c_str(), "rb"));
  if (!file) throw Error(ErrorKind::kInput, reason(path, "cannot open", errno));
  std::vector<std::byte> bytes(size);
  if (std::fread(bytes.data(), 1, bytes.size(), file.get()) != bytes.size())
    throw Error(ErrorKind::kInput, path.string() + ": cannot read all of it");
  return bytes;
}

void write_file_bytes(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  File file(std::fopen(path.c_str(), "wb"));
  if (!file) throw Error(ErrorKind::kIo, reason(path, "cannot open for writing", errno));
  const bool written = bytes.empty() || std::fwrite(bytes.data(), 1, bytes.size(), file.get()) == bytes.size();
  const int write_error = errno;
  // Buffered bytes meet a full disk only here.
  const bool closed = std::fclose(file.release()) == 0;
  if (!written || !closed) throw Error(ErrorKind::kIo, reason(path, "cannot write", written ? errno : write_error));
}

} // namespace packtrace
