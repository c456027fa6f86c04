#include "runtime/image/read_image.h"

#include <algorithm>
#include <cstddef>
#include <initializer_list>
#include <vector>

#include "pbrt_import/scene/file_bytes.h"
#include "pbrt_import/scene/file_error.h"
#include "runtime/image/exr.h"
#include "runtime/image/png.h"

namespace packtrace {

LoadedImage read_image(const std::filesystem::path& path, std::string_view layer) {
  const std::vector<std::byte> bytes = read_file_bytes(path);
  const std::string name = path.string();
  const auto starts_with = [&](std::initializer_list<uint8_t> magic) {
    return bytes.size() >= magic.size() && std::equal(magic.begin(), magic.end(), bytes.begin(),
                                                      [](uint8_t m, std::byte b) { return std::byte{m} == b; });
  };
  if (starts_with({0x89, 'P', 'N', 'G'})) {
    if (!layer.empty() && layer != "ao")
      throw FileError(ErrorKind::kInput, name, "a PNG file has no layer \"" + std::string(layer) + "\"");
    LoadedImage loaded{decode_png(bytes, name), {}};
    loaded.alpha = loaded.image.channels % 2 == 0;
    return loaded;
  }
  if (starts_with({0x76, 0x2f, 0x31, 0x01})) {
    const ExrLayer chosen = choose_layer(exr_info(bytes, name), layer, name);
    const std::string& last = chosen.channels.back().name;
    const bool alpha = chosen.channels.size() > 1 && last.substr(last.rfind('.') + 1) == "A";
    return {decode_exr(bytes, name, chosen.name), chosen.name, alpha};
  }
  throw FileError(ErrorKind::kInput, name, "neither a PNG nor an EXR file");
}

} // namespace packtrace
