#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

#include <sys/types.h>

namespace packtrace {

/// Owner of a file descriptor; -1 means none.
class Descriptor {
public:
  explicit Descriptor(int value = -1) : value_(value) {}
  ~Descriptor();
  Descriptor(Descriptor&& other) noexcept : value_(other.release()) {}
  Descriptor& operator=(Descriptor&& other) noexcept;

  int get() const { return value_; }
  bool valid() const { return value_ >= 0; }
  /// Releases ownership and returns the descriptor.
  int release();

private:
  int value_;
};

/// An open regular file with its properties at the time of opening.
struct RegularFile {
  Descriptor descriptor;
  uint64_t bytes = 0;
  dev_t device = 0;
  ino_t inode = 0;
};

/// Opens a regular file for reading. Never blocks: pipes, sockets and devices, which may block forever or never end,
/// are rejected at once. Throws Error(kInput), with a message without the path, if the file is missing, cannot be
/// opened or is not a regular file.
RegularFile open_regular_file(const std::filesystem::path& path);

/// The first bytes of a regular file, fewer if it is shorter; empty if it cannot be read.
std::string read_file_start(const std::filesystem::path& path, size_t max_bytes);

} // namespace packtrace
