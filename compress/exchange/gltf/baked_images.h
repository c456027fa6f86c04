#pragma once

#include "compress/exchange/gltf/image_codec.h"
#include "compress/format/file/baked_file.h"

namespace packtrace {

/// The pixels of a mask (in alpha), an albedo texture or both; views of width 0 are absent. Their size per axis is that
/// of the larger one.
RgbaImage image_of(const AlphaMaskView& bits, const TextureView& colours);

} // namespace packtrace
