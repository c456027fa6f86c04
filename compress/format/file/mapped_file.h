#pragma once

#include <cstddef>
#include <filesystem>
#include <span>

namespace packtrace {

/// A file's bytes, mapped read-only. The file must not be truncated while mapped.
class MappedFile {
public:
  /// Throws Error(kInput) if the file does not exist or is not a regular file, Error(kIo) if it cannot be mapped.
  explicit MappedFile(const std::filesystem::path& path);
  ~MappedFile();
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;

  std::span<const std::byte> bytes() const { return bytes_; }

private:
  std::span<const std::byte> bytes_;
};

} // namespace packtrace
