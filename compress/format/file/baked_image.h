#pragma once

#include <cstddef>
#include <vector>

#include "compress/format/file/baked_file.h"

namespace packtrace {

/// Assembles a file image from its sections: header, hashes, alignment. Inverse of validate_baked_file(), which accepts
/// the result if the records are valid. sections.payload must end in kReadSlackBytes zero bytes.
std::vector<std::byte> assemble_baked_file(const BakedSections& sections);

} // namespace packtrace
