#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace packtrace {

/// All bytes of a regular file. Throws Error(kInput) where it is missing, larger than max_bytes or of another kind, or
/// cannot be read.
std::vector<std::byte> read_file_bytes(const std::filesystem::path& path, uint64_t max_bytes = uint64_t{1} << 32);

/// Replaces the file's content. Throws Error(kIo) where that fails, a full disk included.
void write_file_bytes(const std::filesystem::path& path, std::span<const std::byte> bytes);

} // namespace packtrace
