#include "pbrt_import/files/webp.h"

#include <string_view>

#include <webp/decode.h>

#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

const uint8_t* data_of(std::span<const std::byte> bytes) { return reinterpret_cast<const uint8_t*>(bytes.data()); }

} // namespace

bool WebpReader::is_webp(std::span<const std::byte> bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return text.starts_with("RIFF") && text.size() >= 12 && text.substr(8, 4) == "WEBP";
}

WebpReader::WebpReader(std::span<const std::byte> bytes) : bytes_(bytes) {
  WebPBitstreamFeatures features;
  if (WebPGetFeatures(data_of(bytes), bytes.size(), &features) != VP8_STATUS_OK)
    throw Error(ErrorKind::kInput, "damaged image: the WebP header is not valid");
  if (features.has_animation != 0) throw Error(ErrorKind::kInput, "animated WebP images are not read");
  width_ = static_cast<uint32_t>(features.width), height_ = static_cast<uint32_t>(features.height);
}

uint64_t WebpReader::working_bytes() const {
  constexpr uint64_t kCopies = 3, kBytesPerPixel = 4; // the result, libwebp's own pixels, and its tables
  return uint64_t{width_} * height_ * kCopies * kBytesPerPixel;
}

std::vector<uint8_t> WebpReader::decode() const {
  std::vector<uint8_t> pixels(size_t{width_} * height_ * 4);
  if (WebPDecodeRGBAInto(data_of(bytes_), bytes_.size(), pixels.data(), pixels.size(), static_cast<int>(width_ * 4)) ==
      nullptr)
    throw Error(ErrorKind::kInput, "damaged image: the WebP data are damaged or truncated");
  return pixels;
}

} // namespace packtrace
