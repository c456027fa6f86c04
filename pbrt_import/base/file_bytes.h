#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace packtrace {

/// Reads all bytes of a regular file. Throws Error(kInput) if it is missing, larger than max_bytes, not a regular file
/// or unreadable.
std::vector<std::byte> read_file_bytes(const std::filesystem::path& path, uint64_t max_bytes = uint64_t{1} << 32);

/// Replaces the content of a file. Throws Error(kIo) on failure, including a full disk.
void write_file_bytes(const std::filesystem::path& path, std::span<const std::byte> bytes);

} // namespace packtrace
