#include "runtime/image/png.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <memory>
#include <new>
#include <string>
#include <type_traits>

#include <stb/stb_image.h>
#define STBI_WRITE_NO_STDIO
#include <stb/stb_image_write.h>

#include "pbrt_import/scene/error.h"
#include "pbrt_import/scene/file_bytes.h"

namespace packtrace {

namespace {

struct FreeMemory {
  void operator()(void* memory) const { std::free(memory); }
};
template <class T>
using Malloced = std::unique_ptr<T, FreeMemory>;

constexpr std::array<uint8_t, 8> kSignature{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};

[[noreturn]] void damaged(std::string_view name, const std::string& what) {
  throw Error(ErrorKind::kInput, std::string(name) + ": damaged PNG file: " + what);
}

uint32_t read_be32(std::span<const std::byte> bytes, size_t at) {
  uint32_t value = 0;
  for (size_t i = 0; i < 4; ++i) value = value << 8 | std::to_integer<uint32_t>(bytes[at + i]);
  return value;
}

/// Source: ISO/IEC 15948:2003 (PNG), annex D: CRC-32 with the polynomial 0xedb88320, bits reflected.
uint32_t crc32(std::span<const std::byte> bytes) {
  static const std::array<uint32_t, 256> table = [] {
    std::array<uint32_t, 256> entries{};
    for (uint32_t n = 0; n < 256; ++n) {
      uint32_t c = n;
      for (int bit = 0; bit < 8; ++bit) c = (c & 1) != 0 ? 0xedb88320u ^ (c >> 1) : c >> 1;
      entries[n] = c;
    }
    return entries;
  }();
  uint32_t crc = ~0u;
  for (const std::byte byte : bytes) crc = table[(crc ^ std::to_integer<uint32_t>(byte)) & 0xff] ^ (crc >> 8);
  return ~crc;
}

struct PngHeader {
  ImageSize size;
  uint32_t bits_per_sample = 0;
};

/// Walks all chunks: what stb does not look at (checksums, the end chunk) and what must be known before it allocates.
PngHeader check_chunks(std::span<const std::byte> bytes, std::string_view name) {
  if (bytes.size() < kSignature.size() || std::memcmp(bytes.data(), kSignature.data(), kSignature.size()) != 0)
    throw Error(ErrorKind::kInput, std::string(name) + ": not a PNG file");
  PngHeader header;
  uint64_t compressed_bytes = 0;
  for (size_t at = kSignature.size();;) {
    if (bytes.size() - at < 12) damaged(name, "it ends before its end chunk");
    const uint64_t length = read_be32(bytes, at);
    if (length > bytes.size() - at - 12) damaged(name, "a chunk reaches beyond the end of the file");
    const std::span<const std::byte> type_and_data = bytes.subspan(at + 4, 4 + length);
    const std::string_view type(reinterpret_cast<const char*>(type_and_data.data()), 4);
    if (crc32(type_and_data) != read_be32(bytes, at + 8 + length)) damaged(name, "wrong checksum");
    const bool first = at == kSignature.size();
    if (first != (type == "IHDR")) damaged(name, "the header chunk is not where it belongs");
    if (first) {
      if (length != 13) damaged(name, "wrong header size");
      header = {{read_be32(bytes, at + 8), read_be32(bytes, at + 12)}, std::to_integer<uint32_t>(bytes[at + 16])};
    }
    if (type == "IDAT") compressed_bytes += length;
    at += 12 + length;
    if (type == "IEND") break;
  }
  const ImageSize size = header.size;
  if (size.width < 1 || size.height < 1) damaged(name, "it has no pixels");
  if (size.width > kMaxImageSide || size.height > kMaxImageSide || size.pixels() > kMaxImageSamples / 4)
    throw Error(ErrorKind::kInput, std::string(name) + ": image of " + std::to_string(size.width) + " x " +
                                       std::to_string(size.height) + " pixels is too large");
  // Deflate shrinks by 1032 at most, so this few bytes cannot hold that many 1-bit pixels ...
  if (size.pixels() / 8 > 1032 * (compressed_bytes + 1)) damaged(name, "too little data for its size");
  // ... and stored blocks of 8-byte pixels grow by far less than a quarter: more would only unpack to be thrown away.
  if (compressed_bytes > 65536 + 10 * (size.pixels() + size.height)) damaged(name, "too much data for its size");
  return header;
}

template <class Sample>
Image to_floats(const Sample* samples, ImageSize size, uint32_t channels, PngTransfer transfer) {
  constexpr size_t kValues = size_t{std::numeric_limits<Sample>::max()} + 1;
  std::vector<float> raw(kValues), decoded(kValues);
  for (size_t i = 0; i < kValues; ++i) {
    raw[i] = static_cast<float>(i) / static_cast<float>(kValues - 1);
    decoded[i] = transfer == PngTransfer::kSrgb ? linear_from_srgb(raw[i]) : raw[i];
  }
  const uint32_t colours = channels - (channels % 2 == 0); // the last of 2 or 4 channels is alpha
  Image image(size, channels);
  for (size_t i = 0; i < size.pixels(); ++i)
    for (uint32_t c = 0; c < channels; ++c)
      image.data[i * channels + c] = (c < colours ? decoded : raw)[samples[i * channels + c]];
  return image;
}

uint8_t to_byte(float value) {
  if (!(value > 0.0f)) return 0; // NaN too
  return static_cast<uint8_t>(std::min(value, 1.0f) * 255.0f + 0.5f);
}

} // namespace

std::vector<std::byte> encode_png(const Image& image, PngTransfer transfer) {
  const uint64_t bytes = uint64_t{image.size.pixels()} * image.channels;
  if (bytes == 0 || image.channels > 4 || image.size.width > kMaxImageSide || image.size.height > kMaxImageSide ||
      bytes > kMaxImageSamples || image.data.size() != bytes)
    throw Error(ErrorKind::kUsage, "an image of " + std::to_string(image.size.width) + " x " +
                                       std::to_string(image.size.height) + " pixels with " +
                                       std::to_string(image.channels) + " channels cannot be written as PNG");
  const uint32_t colours = image.channels - (image.channels % 2 == 0);
  std::vector<uint8_t> samples(bytes);
  for (size_t i = 0; i < samples.size(); ++i) {
    const bool coded = transfer == PngTransfer::kSrgb && i % image.channels < colours;
    // Clamp first: the transfer's power law is for [0,1].
    const float value = std::clamp(image.data[i], 0.0f, 1.0f);
    samples[i] = to_byte(coded ? srgb_from_linear(value) : value);
  }
  std::vector<std::byte> file;
  const auto append = [](void* target, void* data, int size) {
    const auto* begin = static_cast<const std::byte*>(data);
    auto& target_bytes = *static_cast<std::vector<std::byte>*>(target);
    target_bytes.insert(target_bytes.end(), begin, begin + size);
  };
  const int stride = static_cast<int>(image.size.width * image.channels);
  if (stbi_write_png_to_func(append, &file, static_cast<int>(image.size.width), static_cast<int>(image.size.height),
                             static_cast<int>(image.channels), samples.data(), stride) == 0)
    throw std::bad_alloc(); // the one way in which it fails
  return file;
}

void write_png(const std::filesystem::path& path, const Image& image, PngTransfer transfer) {
  write_file_bytes(path, encode_png(image, transfer));
}

Image decode_png(std::span<const std::byte> bytes, std::string_view name, PngTransfer transfer) {
  if (bytes.size() > kMaxImageSamples) throw Error(ErrorKind::kInput, std::string(name) + ": file is too large");
  const PngHeader header = check_chunks(bytes, name);
  const auto* memory = reinterpret_cast<const stbi_uc*>(bytes.data());
  const int memory_bytes = static_cast<int>(bytes.size());
  int width = 0, height = 0, channels = 0;
  Image image;
  const auto load = [&](auto* samples) {
    using Sample = std::remove_pointer_t<decltype(samples)>;
    const Malloced<Sample> owner(samples);
    if (!samples) damaged(name, "its pixels cannot be decoded");
    image = to_floats(samples, header.size, static_cast<uint32_t>(channels), transfer);
  };
  if (header.bits_per_sample == 16)
    load(stbi_load_16_from_memory(memory, memory_bytes, &width, &height, &channels, 0));
  else
    load(stbi_load_from_memory(memory, memory_bytes, &width, &height, &channels, 0));
  return image;
}

Image read_png(const std::filesystem::path& path, PngTransfer transfer) {
  return decode_png(read_file_bytes(path), path.string(), transfer);
}

} // namespace packtrace
