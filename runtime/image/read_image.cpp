#include "runtime/image/read_image.h"

#include <algorithm>
#include <cstddef>
#include <initializer_list>
#include <utility>
#include <vector>

#include "pbrt_import/base/file_bytes.h"
#include "pbrt_import/base/file_error.h"
#include "pbrt_import/base/with_file.h"
#include "runtime/image/exr.h"
#include "runtime/image/png.h"

namespace packtrace {

namespace {

/// Grows memory by what an image of a file takes, and names the file where that is too much.
void reserve_more(MemoryReservation& memory, uint64_t bytes, const std::filesystem::path& path, std::string_view what) {
  with_file(path, [&] { memory.resize(memory.bytes() + bytes, what); });
}

/// The header of a PNG file; nullopt where decode_png() rejects the file for its size.
ImageSize png_size(std::span<const std::byte> bytes) {
  constexpr size_t kWidthAt = 16, kHeightAt = 20;
  if (bytes.size() < kHeightAt + 4) return {};
  const auto big_endian = [&](size_t at) {
    uint32_t value = 0;
    for (size_t i = 0; i < 4; ++i) value = value << 8 | std::to_integer<uint32_t>(bytes[at + i]);
    return value;
  };
  const ImageSize size{big_endian(kWidthAt), big_endian(kHeightAt)};
  return std::max(size.width, size.height) <= kMaxImageSide ? size : ImageSize{};
}

} // namespace

LoadedImage read_image(const std::filesystem::path& path, std::string_view layer, const MemoryBudget& budget) {
  constexpr uint64_t kPngBytesPerPixel = 4 * (sizeof(float) + 2), kExrBytesPerSample = 2 * sizeof(float);
  MemoryReservation memory(budget);
  std::error_code unknown; // read_file_bytes() reports the problem
  if (const uint64_t size = std::filesystem::file_size(path, unknown); !unknown)
    reserve_more(memory, size, path, "the file");
  const std::vector<std::byte> bytes = read_file_bytes(path);
  const std::string name = path.string();
  const auto starts_with = [&](std::initializer_list<uint8_t> magic) {
    return bytes.size() >= magic.size() && std::equal(magic.begin(), magic.end(), bytes.begin(),
                                                      [](uint8_t m, std::byte b) { return std::byte{m} == b; });
  };
  if (starts_with({0x89, 'P', 'N', 'G'})) {
    if (!layer.empty() && layer != "ao")
      throw FileError(ErrorKind::kInput, name, "a PNG file has no layer \"" + std::string(layer) + "\"");
    const ImageSize size = png_size(bytes);
    reserve_more(memory, size.pixels() * kPngBytesPerPixel, path, "the image");
    LoadedImage loaded{decode_png(bytes, name), {}, false, std::move(memory)};
    loaded.alpha = loaded.image.channels % 2 == 0;
    return loaded;
  }
  if (starts_with({0x76, 0x2f, 0x31, 0x01})) {
    const ExrInfo info = exr_info(bytes, name);
    const ExrLayer chosen = choose_layer(info, layer, name);
    reserve_more(memory, info.size.pixels() * chosen.channels.size() * kExrBytesPerSample, path, "the image");
    const std::string& last = chosen.channels.back().name;
    const bool alpha = chosen.channels.size() > 1 && last.substr(last.rfind('.') + 1) == "A";
    return {decode_exr(bytes, name, chosen.name), chosen.name, alpha, std::move(memory)};
  }
  throw FileError(ErrorKind::kInput, name, "neither a PNG nor an EXR file");
}

} // namespace packtrace
