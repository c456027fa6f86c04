#include "runtime/image/png.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <memory>
#include <new>
#include <string>
#include <type_traits>

#include <stb/stb_image.h>
#define STBI_WRITE_NO_STDIO
#include <stb/stb_image_write.h>

#include "pbrt_import/base/file_bytes.h"
#include "pbrt_import/base/file_error.h"
#include "pbrt_import/base/png_chunks.h"

namespace packtrace {

namespace {

struct FreeMemory {
  void operator()(void* memory) const { std::free(memory); }
};
template <class T>
using Malloced = std::unique_ptr<T, FreeMemory>;

std::string damaged_png_prefix(std::string_view name) { return std::string(name) + ": damaged PNG file: "; }

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
  if (!(value > 0.0f)) return 0; // also for NaN
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
    // Clamp first, because the sRGB transfer is defined on [0,1].
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
    throw std::bad_alloc(); // stb_image_write fails for lack of memory only
  return file;
}

void write_png(const std::filesystem::path& path, const Image& image, PngTransfer transfer) {
  write_file_bytes(path, encode_png(image, transfer));
}

/// Throws Error(kInput) if a pixel's index exceeds the palette. stb_image would read uninitialised memory there.
void check_palette(std::span<const std::byte> bytes, std::string_view name) {
  const PngPalette palette = png_palette(bytes, damaged_png_prefix(name));
  int width = 0, height = 0, channels = 0;
  const Malloced<stbi_uc> grey(stbi_load_from_memory(reinterpret_cast<const stbi_uc*>(palette.indices_as_grey.data()),
                                                     static_cast<int>(bytes.size()), &width, &height, &channels, 1));
  if (!grey) return; // decoding the file itself will fail as well
  const std::span<const stbi_uc> indices(grey.get(), static_cast<size_t>(width) * static_cast<size_t>(height));
  if (std::ranges::any_of(indices, [&](stbi_uc v) { return v / palette.grey_step >= palette.colours.size(); }))
    throw Error(ErrorKind::kInput, damaged_png_prefix(name) + "pixels have colours that the palette lacks");
}

Image decode_png(std::span<const std::byte> bytes, std::string_view name, PngTransfer transfer) {
  if (bytes.size() > kMaxImageSamples) throw FileError(ErrorKind::kInput, std::string(name), "file is too large");
  const PngHeader header = check_png_chunks(bytes, PngChecksums::kVerify, damaged_png_prefix(name));
  const ImageSize size{header.width, header.height};
  if (size.width > kMaxImageSide || size.height > kMaxImageSide || size.pixels() > kMaxImageSamples / 4)
    throw FileError(ErrorKind::kInput, std::string(name),
                    "image of " + std::to_string(size.width) + " x " + std::to_string(size.height) +
                        " pixels is too large");
  if (header.palette) check_palette(bytes, name);
  const auto* memory = reinterpret_cast<const stbi_uc*>(bytes.data());
  const int memory_bytes = static_cast<int>(bytes.size());
  int width = 0, height = 0, channels = 0;
  Image image;
  const auto load = [&](auto* samples) {
    using Sample = std::remove_pointer_t<decltype(samples)>;
    const Malloced<Sample> owner(samples);
    if (!samples) throw Error(ErrorKind::kInput, damaged_png_prefix(name) + "its pixels cannot be decoded");
    image = to_floats(samples, size, static_cast<uint32_t>(channels), transfer);
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
