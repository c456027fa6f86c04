#include "compress/format/normal_codec.h"

#include <algorithm>
#include <cmath>

namespace packtrace {
namespace {

constexpr int32_t kXCodes = 32766, kYCodes = 65534; // the codes of +1; larger ones are never written

} // namespace

Vec3 decode_zsign32(uint32_t code) {
  const float x = static_cast<float>((code >> 16) & 0x7fffu) * (2.0f / static_cast<float>(kXCodes)) - 1.0f;
  const float y = static_cast<float>(code & 0xffffu) * (2.0f / static_cast<float>(kYCodes)) - 1.0f;
  const float planar = x * x + y * y;
  if (planar >= 1.0f) {
    const float scale = 1.0f / std::sqrt(planar);
    return {x * scale, y * scale, 0.0f};
  }
  const float z = std::sqrt(1.0f - planar);
  return {x, y, (code >> 31) != 0 ? -z : z};
}

uint32_t encode_zsign32(DVec3 n) {
  // Scaling by the largest component first keeps the squares away from overflow and from zero.
  n /= std::max({std::abs(n.x), std::abs(n.y), std::abs(n.z)});
  n /= glm::length(n);
  const uint32_t sign = std::signbit(n.z) ? 0x80000000u : 0u;
  const auto x0 = static_cast<int32_t>(std::lrint((n.x + 1.0) * 0.5 * kXCodes));
  const auto y0 = static_cast<int32_t>(std::lrint((n.y + 1.0) * 0.5 * kYCodes));
  uint32_t best = 0;
  double best_distance = 5.0; // squared chords of the unit sphere are at most 4
  for (int32_t x = std::max(x0 - 1, 0); x <= std::min(x0 + 1, kXCodes); ++x)
    for (int32_t y = std::max(y0 - 1, 0); y <= std::min(y0 + 1, kYCodes); ++y) {
      const uint32_t code = sign | (static_cast<uint32_t>(x) << 16) | static_cast<uint32_t>(y);
      // The chord, not the dot product: cosines this close to 1 all look alike.
      const DVec3 d = DVec3(decode_zsign32(code)) - n;
      const double distance = glm::dot(d, d);
      if (distance < best_distance) best_distance = distance, best = code;
    }
  return best;
}

} // namespace packtrace
