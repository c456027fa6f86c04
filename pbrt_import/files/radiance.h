#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "pbrt_import/scene/math.h"

namespace packtrace {

/// Reads a Radiance picture (.hdr) row by row: shared-exponent colours, uncompressed or in either of the format's two
/// run-length encodings, rows from the top, columns from the left. The EXPOSURE of the header is not applied.
/// Source: Greg Ward, Real Pixels, Graphics Gems II, 1991; Radiance's src/common/color.c.
class RadianceReader {
public:
  /// Parses the header.
  /// @param bytes the whole file, which must outlive the reader
  /// Throws Error(kInput), with a message without file name, if it is damaged or has another orientation or colour
  /// space.
  explicit RadianceReader(std::span<const std::byte> bytes);

  uint32_t width() const { return width_; }   ///< pixels, 1 to 2^24
  uint32_t height() const { return height_; } ///< pixels, 1 to 2^24

  /// Decodes the next row and returns its width() linear RGB values, valid until the next call. Call at most height()
  /// times. Throws Error(kInput) if the file ends early or a run exceeds the row.
  std::span<const Vec3> read_row();

private:
  std::span<const std::byte> take(size_t count);
  void read_planes();
  void read_pixels();

  std::span<const std::byte> left_;
  uint32_t width_ = 0, height_ = 0;
  std::vector<uint8_t> rgbe_; ///< one row, four bytes per pixel
  std::vector<Vec3> row_;
};

} // namespace packtrace
