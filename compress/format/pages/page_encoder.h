#pragma once

#include <cstddef>
#include <vector>

#include "compress/format/file/baked_file.h"
#include "compress/format/pages/page_codec.h"

namespace packtrace {

/// Returns the paged form of a file for disk; the file may have been opened in any form. Each page is decoded again and
/// compared. A page that would not decode bit for bit is stored as its resident bytes, compressed with zstd. The bytes
/// do not depend on the thread count.
/// @param codec kFast or kSmall
std::vector<std::byte> encode_paged_file(const BakedFile& file, PageCodec codec);

} // namespace packtrace
