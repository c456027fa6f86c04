#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <vector>

namespace packtrace {

/// All bytes of a regular file of at most 4 GiB. Throws Error(kInput) where it is missing, larger or of another kind,
/// or cannot be read.
std::vector<std::byte> read_file_bytes(const std::filesystem::path& path);

/// Replaces the file's content. Throws Error(kIo) where that fails, a full disk included.
void write_file_bytes(const std::filesystem::path& path, std::span<const std::byte> bytes);

} // namespace packtrace
