#include "pbrt_import/files/tga.h"

#include <algorithm>
#include <array>

#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

constexpr size_t kHeaderBytes = 18;

using Rgba = std::array<uint8_t, 4>;

[[noreturn]] void truncated() { throw Error(ErrorKind::kInput, "damaged image: the file is truncated"); }

/// Little-endian integer of up to four bytes.
uint32_t load(std::span<const std::byte> bytes) {
  uint32_t value = 0;
  for (size_t i = bytes.size(); i-- > 0;) value = value << 8 | std::to_integer<uint32_t>(bytes[i]);
  return value;
}

bool is_colour_size(uint32_t bits) { return bits == 8 || bits == 15 || bits == 16 || bits == 24 || bits == 32; }
size_t bytes_of_bits(uint32_t bits) { return (bits + 7) / 8; }

/// Converts a stored colour: 8 bits are grey; 15 and 16 bits are five bits per channel and one of alpha, or grey and
/// alpha.
Rgba colour_of(uint32_t word, uint32_t bits, bool grey, bool has_alpha) {
  const auto byte = [&](uint32_t shift) { return static_cast<uint8_t>(word >> shift); };
  const uint8_t alpha = !has_alpha || bits == 8 ? uint8_t{255}
                        : bits == 32            ? byte(24)
                        : grey                  ? byte(8)
                                                : static_cast<uint8_t>((word >> 15 & 1) * 255);
  if (bits == 8 || grey) return {byte(0), byte(0), byte(0), alpha};
  const auto five_bits = [&](uint32_t shift) { return static_cast<uint8_t>((word >> shift & 31) * 255 / 31); };
  if (bits <= 16) return {five_bits(10), five_bits(5), five_bits(0), alpha};
  return {byte(16), byte(8), byte(0), alpha};
}

/// Reads pixels in file order.
class PixelReader {
public:
  PixelReader(std::span<const std::byte> bytes, const TgaHeader& header) : header_(header) {
    const size_t entry_bytes = bytes_of_bits(header.palette_bits);
    left_ = bytes.subspan(std::min(header.palette_offset, bytes.size()));
    for (uint32_t i = 0; i < header.palette_entries; ++i) {
      const uint32_t word = load(take(entry_bytes));
      if (header.palette) palette_.push_back(colour_of(word, header.palette_bits, false, header.alpha));
    }
  }

  Rgba next() {
    if (!header_.run_lengths) return read();
    if (packet_left_ == 0) start_packet();
    --packet_left_;
    if (!repeats_) return read();
    return run_;
  }

  uint64_t pixels_left_over() const { return packet_left_; }
  uint64_t pixels_out_of_range() const { return out_of_range_; }

private:
  std::span<const std::byte> take(size_t count) {
    if (count > left_.size()) truncated();
    const std::span<const std::byte> taken = left_.first(count);
    left_ = left_.subspan(count);
    return taken;
  }

  void start_packet() {
    const uint32_t code = load(take(1));
    packet_left_ = 1 + (code & 0x7f);
    repeats_ = (code & 0x80) != 0;
    if (!repeats_) return;
    const uint64_t before = out_of_range_;
    run_ = read();
    if (out_of_range_ != before) out_of_range_ += packet_left_ - 1;
  }

  Rgba read() {
    const uint32_t word = load(take(bytes_of_bits(header_.pixel_bits)));
    if (!header_.palette) return colour_of(word, header_.pixel_bits, header_.grey, header_.alpha);
    const uint64_t index = uint64_t{word} - header_.palette_first;
    if (index < palette_.size()) return palette_[static_cast<size_t>(index)];
    ++out_of_range_;
    return {0, 0, 0, 255};
  }

  const TgaHeader& header_;
  std::span<const std::byte> left_;
  std::vector<Rgba> palette_;
  uint32_t packet_left_ = 0; ///< pixels left in the current run
  bool repeats_ = false;
  Rgba run_{};
  uint64_t out_of_range_ = 0;
};

} // namespace

std::optional<TgaHeader> parse_tga_header(std::span<const std::byte> bytes) {
  if (bytes.size() < kHeaderBytes) return std::nullopt;
  const auto byte = [&](size_t at) { return std::to_integer<uint32_t>(bytes[at]); };
  const auto word = [&](size_t at) { return load(bytes.subspan(at, 2)); };
  TgaHeader header;
  const uint32_t palettes = byte(1), kind = byte(2) & ~8u, descriptor = byte(17);
  header.run_lengths = (byte(2) & 8u) != 0;
  header.palette = kind == 1;
  header.grey = kind == 3;
  header.palette_offset = kHeaderBytes + byte(0);
  if (palettes == 1) header.palette_first = word(3), header.palette_entries = word(5), header.palette_bits = byte(7);
  header.width = word(12), header.height = word(14);
  header.pixel_bits = byte(16);
  const uint32_t colour_bits = header.palette ? header.palette_bits : header.pixel_bits;
  header.alpha = (descriptor & 0x0f) > 0 && (colour_bits == 32 || colour_bits == 16);
  header.from_the_right = (descriptor & 0x10) != 0;
  header.from_the_top = (descriptor & 0x20) != 0;
  const bool known = palettes <= 1 && kind >= 1 && kind <= 3 && header.width > 0 && header.height > 0;
  const bool sizes = header.palette ? header.pixel_bits == 8 || header.pixel_bits == 16
                     : header.grey  ? header.pixel_bits == 8 || header.pixel_bits == 16
                                    : is_colour_size(header.pixel_bits);
  const bool palette_fits = palettes == 1 ? is_colour_size(header.palette_bits) : !header.palette;
  return known && sizes && palette_fits ? std::optional(header) : std::nullopt;
}

TgaPixels decode_tga(std::span<const std::byte> bytes, const TgaHeader& header) {
  constexpr uint64_t kLongestRun = 128;
  const uint64_t pixels_stored = uint64_t{header.width} * header.height / (header.run_lengths ? kLongestRun : 1);
  if (pixels_stored * bytes_of_bits(header.pixel_bits) > bytes.size()) truncated(); // checked before allocating
  PixelReader reader(bytes, header);
  TgaPixels pixels;
  pixels.rgb.resize(size_t{header.width} * header.height * 3);
  for (uint32_t row = 0; row < header.height; ++row) {
    const size_t y = header.from_the_top ? row : header.height - 1 - row;
    for (uint32_t column = 0; column < header.width; ++column) {
      const size_t x = header.from_the_right ? header.width - 1 - column : column;
      const Rgba colour = reader.next();
      pixels.transparent_pixels += colour[3] < 255;
      std::copy(colour.begin(), colour.begin() + 3,
                pixels.rgb.begin() + static_cast<std::ptrdiff_t>((y * header.width + x) * 3));
    }
  }
  pixels.surplus_pixels = reader.pixels_left_over();
  pixels.pixels_out_of_range = reader.pixels_out_of_range();
  return pixels;
}

} // namespace packtrace
