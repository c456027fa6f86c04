// Fuzzes the importer's image reader and, for the formats that they support, the readers of runtime/image. The latter
// verify PNG checksums, which changes would invalidate, so PNG inputs are also tried with correct checksums.

#include <algorithm>
#include <cmath>
#include <span>
#include <string_view>
#include <vector>

#include <zlib.h>

#include "pbrt_import/base/error.h"
#include "pbrt_import/files/image_file.h"
#include "pbrt_import/scene/alpha_mask.h"
#include "runtime/image/exr.h"
#include "runtime/image/png.h"
#include "tests/fuzz/fuzz_target.h"

namespace packtrace::fuzz {
namespace {

constexpr uint64_t kMaxPixelBytes = 16u << 20;

void read_for_import(std::span<const std::byte> bytes, bool decode_srgb, bool want_mask) {
  try {
    const ImageSummary image = read_image(bytes, decode_srgb, want_mask, kMaxPixelBytes);
    require(image.width > 0 && image.height > 0, "image without pixels");
    const size_t words = size_t{AlphaMask::row_words(image.width)} * image.height;
    require(image.nonzero.size() == (want_mask ? words : 0), "size of the mask");
    require(is_finite(image.average), "average not finite");
    for (size_t i = 0; image.width % 32 != 0 && i < image.nonzero.size(); ++i)
      if (i % AlphaMask::row_words(image.width) == image.width / 32)
        require(image.nonzero[i] >> (image.width % 32) == 0, "bits beyond a row");
  } catch (const Error& error) {
    require(error.kind() == ErrorKind::kInput || error.kind() == ErrorKind::kLimitExceeded, "kind of error");
  }
}

void require_image(const Image& image) {
  require(image.channels > 0 && image.data.size() == image.size.pixels() * image.channels, "number of samples");
}

/// Returns a PNG file with correct checksums of all chunks that can be reached by their lengths.
std::vector<std::byte> with_right_checksums(std::span<const std::byte> bytes) {
  std::vector<std::byte> file(bytes.begin(), bytes.end());
  const auto big_endian = [&](size_t at) {
    uint32_t value = 0;
    for (size_t i = 0; i < 4; ++i) value = value << 8 | std::to_integer<uint32_t>(file[at + i]);
    return value;
  };
  constexpr size_t kSignatureBytes = 8, kChunkBytes = 12;
  for (size_t at = kSignatureBytes; at + kChunkBytes <= file.size();) {
    const size_t length = big_endian(at);
    if (length > file.size() - at - kChunkBytes) break;
    const auto* const content = reinterpret_cast<const Bytef*>(file.data() + at + 4);
    const auto checksum = static_cast<uint32_t>(crc32(0, content, static_cast<uInt>(length + 4)));
    for (size_t i = 0; i < 4; ++i) file[at + 8 + length + i] = static_cast<std::byte>(checksum >> (24 - 8 * i) & 0xff);
    at += kChunkBytes + length;
  }
  return file;
}

void read_png_for_comparing(std::span<const std::byte> bytes) {
  try {
    const Image image = decode_png(bytes, "input");
    require_image(image);
    for (const float v : image.data) require(v >= 0.0f && v <= 1.0f, "PNG sample outside [0,1]");
  } catch (const Error& error) {
    require(error.kind() == ErrorKind::kInput, "kind of error");
  }
}

void read_exr_for_comparing(std::span<const std::byte> bytes) {
  try {
    const ExrInfo info = exr_info(bytes, "input");
    for (const ExrLayer& layer : info.layers) {
      const Image image = decode_exr(bytes, "input", layer.name);
      require_image(image);
      require(image.channels == layer.channels.size(), "channels of a layer");
    }
  } catch (const Error& error) {
    require(error.kind() == ErrorKind::kInput || error.kind() == ErrorKind::kUnsupported, "kind of error");
  }
}

} // namespace
} // namespace packtrace::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace packtrace::fuzz;
  const std::span bytes = std::as_bytes(std::span(data, size));
  read_for_import(bytes, true, true);
  read_for_import(bytes, false, false);
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  if (text.starts_with("\x89PNG")) {
    read_png_for_comparing(bytes);
    read_png_for_comparing(with_right_checksums(bytes));
  }
  if (text.starts_with("\x76\x2f\x31\x01")) read_exr_for_comparing(bytes);
  return 0;
}
