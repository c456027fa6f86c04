#pragma once

#include <cstddef>
#include <vector>

#include "compress/format/file/baked_file.h"
#include "compress/format/pages/page_codec.h"

namespace packtrace {

/// The disk form of a file, however that was opened. Each page is decoded again and compared; one that would not come
/// back bit for bit is stored instead. The bytes do not depend on the thread count.
/// @param codec kFast or kSmall
std::vector<std::byte> encode_paged_file(const BakedFile& file, PageCodec codec);

} // namespace packtrace
