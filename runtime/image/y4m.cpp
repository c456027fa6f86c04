#include "runtime/image/y4m.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace packtrace {
namespace {

std::vector<std::byte> bytes_of_text(const std::string& text) {
  std::vector<std::byte> bytes(text.size());
  std::memcpy(bytes.data(), text.data(), text.size());
  return bytes;
}

std::byte code_of(float value) { return static_cast<std::byte>(std::lround(std::clamp(value, 0.0f, 255.0f))); }

} // namespace

std::vector<std::byte> y4m_header(ImageSize size, uint32_t fps_numerator, uint32_t fps_denominator) {
  std::string text = "YUV4MPEG2 W";
  text.append(std::to_string(size.width)).append(" H").append(std::to_string(size.height)).append(" F");
  text.append(std::to_string(fps_numerator)).append(":").append(std::to_string(fps_denominator));
  return bytes_of_text(text.append(" Ip A1:1 C444\n"));
}

std::vector<std::byte> y4m_frame(const Image& picture) {
  std::vector<std::byte> bytes = bytes_of_text("FRAME\n");
  const size_t start = bytes.size(), n = picture.size.pixels();
  bytes.resize(start + 3 * n);
  for (size_t i = 0; i < n; ++i) {
    std::array<float, 3> c;
    for (size_t k = 0; k < 3; ++k) c[k] = std::clamp(picture.data[3 * i + k], 0.0f, 1.0f);
    const float luma = 0.299f * c[0] + 0.587f * c[1] + 0.114f * c[2];
    bytes[start + i] = code_of(16.0f + 219.0f * luma);
    bytes[start + n + i] = code_of(128.0f + 224.0f / 1.772f * (c[2] - luma));
    bytes[start + 2 * n + i] = code_of(128.0f + 224.0f / 1.402f * (c[0] - luma));
  }
  return bytes;
}

} // namespace packtrace
