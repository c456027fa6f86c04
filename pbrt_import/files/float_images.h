#pragma once

#include <cstddef>
#include <span>

#include "pbrt_import/files/image_file.h"

namespace packtrace {

/// Reads an OpenEXR image. Parameters and errors are those of read_image().
ImageSummary read_exr_image(std::span<const std::byte> bytes, ImageWants wants, MemoryReservation& memory);

/// Reads a portable float map: "PF" (RGB) or "Pf" (grey), width, height, scale (negative: little-endian), then rows
/// from the bottom.
/// @param bytes begin with "PF" or "Pf"; other parameters and errors are those of read_image()
ImageSummary read_pfm_image(std::span<const std::byte> bytes, ImageWants wants, MemoryReservation& memory);

} // namespace packtrace
