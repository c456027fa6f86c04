#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "compress/format/file/baked_file.h"

namespace packtrace {

/// Throws FileError(kInput) that says that the file is damaged.
/// @param name file name for the message
[[noreturn]] void fail_damaged(const std::string& name, const std::string& what);

/// Checks the header, both hashes and the section table, and returns the sections as arrays of records. The records are
/// not checked. The shading section is empty, as it is a part of the texture bytes.
/// @param bytes file image; the returned spans point into it
/// @param name file name for messages
/// Throws FileError(kInput) if the file is no baked file or damaged, and FileError(kUnsupported) for other versions.
BakedSections read_section_table(std::span<const std::byte> bytes, const std::string& name);

} // namespace packtrace
