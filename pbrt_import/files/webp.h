#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace packtrace {

/// Reads a WebP file, lossy or lossless; rejects animations.
class WebpReader {
public:
  /// Reads the header. Throws Error(kInput), with a message without file name, if it is damaged or of an animation.
  /// @param bytes the whole file; must outlive this object
  explicit WebpReader(std::span<const std::byte> bytes);

  static bool is_webp(std::span<const std::byte> bytes);

  uint32_t width() const { return width_; }   ///< pixels
  uint32_t height() const { return height_; } ///< pixels
  /// Bytes that decode() needs, its result included.
  uint64_t working_bytes() const;
  /// All pixels, rows from the top: red, green, blue, alpha. Throws Error(kInput).
  std::vector<uint8_t> decode() const;

private:
  std::span<const std::byte> bytes_;
  uint32_t width_ = 0, height_ = 0;
};

} // namespace packtrace
