#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace packtrace {

/// Reads a JPEG file row by row.
class JpegReader {
public:
  /// Reads the header. Throws Error(kInput), with a message without file name, if it is damaged.
  /// @param bytes the whole file; must outlive this object
  explicit JpegReader(std::span<const std::byte> bytes);
  ~JpegReader();
  JpegReader(const JpegReader&) = delete;
  JpegReader& operator=(const JpegReader&) = delete;

  uint32_t width() const;  ///< pixels
  uint32_t height() const; ///< pixels
  /// Bytes that the decoder needs for the image, besides a few rows: progressive files are held whole.
  uint64_t working_bytes() const;
  /// Next row from the top: RGB, 3 bytes per pixel; valid until the next call. Throws Error(kInput).
  std::span<const uint8_t> read_row();
  /// Damage that the decoder has tolerated so far, such as missing data at the end of the file; empty if none.
  std::string problem() const;

private:
  struct State;
  std::unique_ptr<State> state_;
};

} // namespace packtrace
