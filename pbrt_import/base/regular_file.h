#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

#include <sys/types.h>

namespace packtrace {

/// Owns a file descriptor; -1 owns none.
class Descriptor {
public:
  explicit Descriptor(int value = -1) : value_(value) {}
  ~Descriptor();
  Descriptor(Descriptor&& other) noexcept : value_(other.release()) {}
  Descriptor& operator=(Descriptor&& other) noexcept;

  int get() const { return value_; }
  bool valid() const { return value_ >= 0; }
  /// Gives the descriptor away.
  int release();

private:
  int value_;
};

/// An open regular file, and what was known of it when it was opened.
struct RegularFile {
  Descriptor descriptor;
  uint64_t bytes = 0;
  dev_t device = 0;
  ino_t inode = 0;
};

/// Opens a file for reading. Never waits: pipes, sockets and devices, whose reading may block for ever or never end,
/// are refused at once. Throws Error(kInput), message without the path, if the file is missing, cannot be opened or is
/// not a regular file.
RegularFile open_regular_file(const std::filesystem::path& path);

/// The first bytes of a regular file, fewer where it is shorter; empty where it cannot be read.
std::string read_file_start(const std::filesystem::path& path, size_t max_bytes);

} // namespace packtrace
