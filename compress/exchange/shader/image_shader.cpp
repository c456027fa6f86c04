#include "compress/exchange/shader/image_shader.h"

#include "pbrt_import/base/error.h"

namespace packtrace {
namespace {

/// Decoders of one texel, sRGB-encoded, as integers: ShaderImage::texel() in GLSL.
constexpr const char* kBetween = R"(
ivec3 between(ivec3 a, ivec3 b, ivec3 part, ivec3 whole) { return (a * (whole - part) + b * part + whole / 2) / whole; }
)";

constexpr const char* kBitTexel = R"(
int bit_at(ivec2 p) {
  p = clamp(p, ivec2(0), SIZE - 1);
  int number = p.y * SIZE.x + p.x;
  return int(WORDS[number >> 5] >> (number & 31) & 1u);
}

ivec3 texel(ivec2 p) {
  int level = 0;
  for (int j = -1; j <= 1; ++j)
    for (int i = -1; i <= 1; ++i) level += (2 - abs(i)) * (2 - abs(j)) * bit_at(p + ivec2(i, j));
  return between(LOW, HIGH, ivec3(level), ivec3(16));
}
)";

constexpr const char* kByte = R"(
int byte_at(ivec2 p) {
  int number = p.y * SIZE.x + p.x;
  return int(WORDS[number >> 2] >> 8 * (number & 3) & 0xffu);
}
)";

constexpr const char* kGreyTexel = R"(
ivec3 knot(int i) { return ivec3(uvec3(RAMP[i]) >> uvec3(0, 8, 16) & 0xffu); }

ivec3 texel(ivec2 p) {
  int place = byte_at(p) * 16, i = min(place / 255, 15);
  return between(knot(i), knot(i + 1), ivec3(place - i * 255), ivec3(255));
}
)";

constexpr const char* kR2G4B2Texel = R"(
ivec3 texel(ivec2 p) {
  int value = byte_at(p);
  return between(LOW, HIGH, ivec3(value >> 6, value >> 2 & 15, value & 3), ivec3(3, 15, 3));
}
)";

constexpr const char* kImagePicture = R"(
vec3 color_at(ivec2 p) { return vec3(texel(clamp(p, ivec2(0), SIZE - 1))) / 255.0; }

vec3 picture(vec2 pixel, vec2 resolution) {
  EXACT vec2 scales = resolution / vec2(SIZE);
  EXACT vec2 from_middle = (pixel - 0.5 * resolution) / min(scales.x, scales.y);
  EXACT vec2 place = 0.5 * vec2(SIZE) + vec2(from_middle.x, -from_middle.y); // rows run down
  if (any(lessThan(place, vec2(0.0))) || any(greaterThanEqual(place, vec2(SIZE)))) return vec3(0.0);
  vec2 low = floor(place - 0.5), part = place - 0.5 - low;
  ivec2 p = ivec2(low);
  return mix(mix(color_at(p), color_at(p + ivec2(1, 0)), part.x),
             mix(color_at(p + ivec2(0, 1)), color_at(p + ivec2(1, 1)), part.x), part.y);
}
)";

std::string key_text(const Rgb8& key) {
  return "ivec3(" + std::to_string(key[0]) + ", " + std::to_string(key[1]) + ", " + std::to_string(key[2]) + ")";
}

} // namespace

std::string image_shader(const ShaderImage& image, const ShaderConfig& config) {
  const uint64_t elements = shader_image_elements(image.format, image.width, image.height);
  if (elements > config.max_elements)
    throw Error(ErrorKind::kLimitExceeded, "the image takes " + std::to_string(elements) +
                                               " array elements, more than the limit of " +
                                               std::to_string(config.max_elements));
  const std::string size = std::to_string(image.width) + ", " + std::to_string(image.height);
  std::string text = glsl_begin(config.form) + "// " + std::to_string(image.width) + " x " +
                     std::to_string(image.height) + " texels in " + std::to_string(elements) +
                     " words. Made by packtrace export.\n" + glsl_words("WORDS", image.words) +
                     "const ivec2 SIZE = ivec2(" + size + ");\n";
  if (image.format == TexelFormat::kGrey)
    text += glsl_words("RAMP", image.ramp);
  else
    text += "const ivec3 LOW = " + key_text(image.keys[0]) + ", HIGH = " + key_text(image.keys[1]) + ";\n";
  text += kBetween;
  if (image.format == TexelFormat::kBit)
    text += kBitTexel;
  else
    text.append(kByte).append(image.format == TexelFormat::kGrey ? kGreyTexel : kR2G4B2Texel);
  return text + kImagePicture + glsl_end(config.form);
}

} // namespace packtrace
