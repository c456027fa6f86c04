#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include <gtest/gtest.h>
#include <zlib.h>

namespace packtrace {

/// Compresses text with zlib; window_bits selects the format: 15 zlib, 31 gzip.
inline std::string deflated(std::string_view text, int window_bits) {
  z_stream z{};
  EXPECT_EQ(deflateInit2(&z, 9, Z_DEFLATED, window_bits, 8, Z_DEFAULT_STRATEGY), Z_OK);
  std::string packed(deflateBound(&z, static_cast<uLong>(text.size())) + 64, '\0');
  z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
  z.avail_in = static_cast<uInt>(text.size());
  z.next_out = reinterpret_cast<Bytef*>(packed.data());
  z.avail_out = static_cast<uInt>(packed.size());
  EXPECT_EQ(deflate(&z, Z_FINISH), Z_STREAM_END);
  packed.resize(z.total_out);
  deflateEnd(&z);
  return packed;
}
inline std::string gzip(std::string_view text) { return deflated(text, 15 + 16); }

inline std::string without_end(std::string text, size_t bytes) {
  text.resize(text.size() - bytes);
  return text;
}

inline std::string flipped(std::string text, size_t at) {
  text[at] = static_cast<char>(~text[at]);
  return text;
}

inline std::string big_endian(uint32_t value) {
  return {static_cast<char>(value >> 24), static_cast<char>(value >> 16), static_cast<char>(value >> 8),
          static_cast<char>(value)};
}

inline std::string png_chunk(const std::string& type_and_data) {
  const auto* const bytes = reinterpret_cast<const Bytef*>(type_and_data.data());
  const auto checksum = static_cast<uint32_t>(crc32(0, bytes, static_cast<uInt>(type_and_data.size())));
  return big_endian(static_cast<uint32_t>(type_and_data.size() - 4)) + type_and_data + big_endian(checksum);
}

inline constexpr char kGrey = 0, kRgb = 2;

/// A PNG file that claims a size and contains the given rows, which need not match it.
inline std::string png(uint32_t width, uint32_t height, int bits, const std::string& rows, char colour = kRgb) {
  const std::string format{static_cast<char>(bits), colour, 0, 0, 0};
  return "\x89PNG\r\n\x1a\n" + png_chunk("IHDR" + big_endian(width) + big_endian(height) + format) +
         png_chunk("IDAT" + deflated(rows, 15)) + png_chunk("IEND");
}
inline std::string good_png() { return png(2, 1, 8, std::string("\0\x80\x80\x80\x40\x40\x40", 7)); }

} // namespace packtrace
