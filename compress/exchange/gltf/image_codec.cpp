#include "compress/exchange/gltf/image_codec.h"

#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>

#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_WRITE_IMPLEMENTATION
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#include <stb/stb_image_write.h>
#pragma GCC diagnostic pop
#include <webp/decode.h>
#include <webp/encode.h>

#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

constexpr uint32_t kChannels = 4;

/// Encodes with one setting; RAII over libwebp's picture and writer.
class WebpEncoder {
public:
  explicit WebpEncoder(const RgbaImage& image) : image_(image) {}

  /// @param quality 0..100; below 0: lossless
  std::vector<std::byte> encode(int quality) const {
    WebPConfig config;
    WebPPicture picture;
    WebPMemoryWriter writer;
    if (!WebPConfigInit(&config) || !WebPPictureInit(&picture)) throw std::runtime_error("libwebp does not start");
    config.method = 6; // slowest, smallest
    config.lossless = quality < 0 ? 1 : 0;
    config.quality = quality < 0 ? 100.0f : static_cast<float>(quality);
    config.use_sharp_yuv = 1;
    config.exact = 1; // filters mix the colours of transparent pixels into their neighbours
    picture.use_argb = 1;
    picture.width = static_cast<int>(image_.width);
    picture.height = static_cast<int>(image_.height);
    WebPMemoryWriterInit(&writer);
    picture.writer = WebPMemoryWrite;
    picture.custom_ptr = &writer;
    const bool done = WebPPictureImportRGBA(&picture, image_.pixels.data(), picture.width * 4) != 0 &&
                      WebPEncode(&config, &picture) != 0;
    std::vector<std::byte> bytes(done ? writer.size : 0);
    if (done) std::memcpy(bytes.data(), writer.mem, writer.size);
    WebPMemoryWriterClear(&writer);
    WebPPictureFree(&picture);
    if (!done) throw std::runtime_error("an image could not be written as WebP");
    return bytes;
  }

  /// PSNR of the decoded colours of pixels that are not transparent.
  double psnr(const std::vector<std::byte>& bytes) const {
    std::vector<uint8_t> decoded(image_.pixels.size());
    if (WebPDecodeRGBAInto(reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size(), decoded.data(), decoded.size(),
                           static_cast<int>(image_.width * kChannels)) == nullptr)
      throw std::runtime_error("an image could not be read back from WebP");
    double sum = 0.0, count = 0.0;
    for (size_t i = 0; i < decoded.size(); i += kChannels) {
      if (image_.pixels[i + 3] == 0) continue;
      for (size_t c = 0; c < 3; ++c) sum += std::pow(double(image_.pixels[i + c]) - double(decoded[i + c]), 2.0);
      count += 3.0;
    }
    constexpr double kPeak = 255.0;
    return sum > 0.0 ? 10.0 * std::log10(kPeak * kPeak * count / sum) : std::numeric_limits<double>::infinity();
  }

private:
  const RgbaImage& image_;
};

} // namespace

std::vector<std::byte> encode_png(const RgbaImage& image) {
  if (image.pixels.size() > std::numeric_limits<int>::max())
    throw Error(ErrorKind::kLimitExceeded, "a texture of more than 2^29 texels cannot be written as PNG");
  std::vector<std::byte> png;
  const auto append = [](void* to, void* data, int size) {
    const auto* const begin = static_cast<const std::byte*>(data);
    static_cast<std::vector<std::byte>*>(to)->insert(static_cast<std::vector<std::byte>*>(to)->end(), begin,
                                                     begin + size);
  };
  if (!stbi_write_png_to_func(append, &png, static_cast<int>(image.width), static_cast<int>(image.height), kChannels,
                              image.pixels.data(), static_cast<int>(image.width * kChannels)))
    throw std::runtime_error("an image could not be written as PNG");
  return png;
}

WebpImage encode_webp(const RgbaImage& image, double min_psnr) {
  if (image.width > WEBP_MAX_DIMENSION || image.height > WEBP_MAX_DIMENSION)
    throw Error(ErrorKind::kLimitExceeded, "a texture of more than 16,383 texels a side cannot be written as WebP");
  const WebpEncoder encoder(image);
  WebpImage best{encoder.encode(-1), std::numeric_limits<double>::infinity()};
  int low = 0, high = 100; // the lowest quality that suffices is in (low, high]
  while (high - low > 4) {
    const int quality = (low + high) / 2;
    std::vector<std::byte> bytes = encoder.encode(quality);
    const double psnr = encoder.psnr(bytes);
    if (psnr < min_psnr) {
      low = quality;
      continue;
    }
    high = quality;
    if (bytes.size() < best.bytes.size()) best = {std::move(bytes), psnr};
  }
  return best;
}

} // namespace packtrace
