#pragma once

#include <cstddef>
#include <vector>

#include "compress/format/file/baked_file.h"

namespace packtrace {

/// Lays sections out as a file: header, hashes, alignment. The inverse of validate_baked_file(), which accepts the
/// result if the records are right. sections.payload must end in kReadSlackBytes zero bytes.
std::vector<std::byte> assemble_baked_file(const BakedSections& sections);

} // namespace packtrace
