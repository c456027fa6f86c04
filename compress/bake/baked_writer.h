#pragma once

#include <cstddef>
#include <filesystem>
#include <span>

namespace packtrace {

/// Writes a file that appears under its name complete or not at all: bytes go to a temporary name in the same
/// directory, which is renamed at the end and removed if anything fails.
/// @param force replace an existing file; without it an existing one is refused
/// Throws Error(kIo) if the file exists and force is not set, or anything cannot be written.
void write_file_atomically(const std::filesystem::path& path, std::span<const std::byte> bytes, bool force);

/// The refusals of write_file_atomically() that are known before there are bytes: for asking before a long bake.
void check_output(const std::filesystem::path& path, bool force);

} // namespace packtrace
