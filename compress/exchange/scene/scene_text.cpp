#include "compress/exchange/scene/scene_text.h"

#include <array>
#include <charconv>
#include <cstring>

#include "compress/exchange/gltf/baked_images.h"
#include "pbrt_import/base/printable.h"

namespace packtrace {
namespace {

template <class T>
void append_shortest(std::string& text, T value) {
  std::array<char, 32> digits;
  const std::to_chars_result end = std::to_chars(digits.data(), digits.data() + digits.size(), value);
  text.append(digits.data(), end.ptr);
}

} // namespace

void append_number(std::string& text, float value) { append_shortest(text, value); }
void append_number(std::string& text, double value) { append_shortest(text, value); }
void append_number(std::string& text, int64_t value) { append_shortest(text, value); }

std::string plain_name(std::string_view name, uint32_t number, bool allow_spaces) {
  std::string plain = to_utf8(name);
  for (char& c : plain)
    if (static_cast<unsigned char>(c) < 32 || c == 127 || c == '"' || c == '\\' || (c == ' ' && !allow_spaces)) c = '_';
  return plain + "#" + std::to_string(number);
}

std::vector<std::byte> bytes_of_text(std::string_view text) {
  std::vector<std::byte> bytes(text.size());
  if (!text.empty()) std::memcpy(bytes.data(), text.data(), text.size());
  return bytes;
}

std::string texture_file(const std::string& folder, uint32_t texture) {
  return folder + "/texture_" + std::to_string(texture) + ".png";
}

std::string mask_file(const std::string& folder, uint32_t mask) {
  return folder + "/mask_" + std::to_string(mask) + ".png";
}

std::vector<std::string> image_files(const BakedFile& file, const std::string& folder) {
  std::vector<std::string> names;
  for (uint32_t i = 0; i < file.sections().textures.size(); ++i) names.push_back(texture_file(folder, i));
  for (uint32_t i = 0; i < file.sections().masks.size(); ++i) names.push_back(mask_file(folder, i));
  return names;
}

void add_images(const BakedFile& file, const std::string& folder, SceneExport& result) {
  for (uint32_t i = 0; i < file.sections().textures.size(); ++i)
    result.files.push_back({texture_file(folder, i), encode_png(image_of({}, file.texture(i)))});
  for (uint32_t i = 0; i < file.sections().masks.size(); ++i) {
    RgbaImage image = image_of(file.mask(i), {});
    for (size_t p = 0; p < image.pixels.size(); p += 4) { // readers take the colours, not alpha
      const uint8_t value = image.pixels[p + 3];
      image.pixels[p] = image.pixels[p + 1] = image.pixels[p + 2] = value;
      image.pixels[p + 3] = 255;
    }
    result.files.push_back({mask_file(folder, i), encode_png(image)});
  }
  result.report.images = file.sections().textures.size() + file.sections().masks.size();
}

} // namespace packtrace
