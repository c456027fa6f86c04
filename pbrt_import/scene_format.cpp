#include "pbrt_import/scene_format.h"

#include <algorithm>
#include <array>
#include <string>

#include "pbrt_import/base/error.h"
#include "pbrt_import/text/input_file.h"

namespace packtrace {
namespace {

std::string lower_case(std::string text) {
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c + 32);
  return text;
}

} // namespace

std::string_view to_string(SceneFormat format) {
  switch (format) {
  case SceneFormat::kPbrt:
    return "pbrt";
  case SceneFormat::kPly:
    return "PLY";
  case SceneFormat::kObj:
    return "OBJ";
  case SceneFormat::kStl:
    return "STL";
  case SceneFormat::kGltf:
    return "glTF";
  }
  return "";
}

SceneFormat scene_format(const std::filesystem::path& file) {
  std::filesystem::path name = file.filename();
  if (lower_case(name.extension().string()) == ".gz") name = name.stem();
  const std::string ending = lower_case(name.extension().string());
  if (ending == ".pbrt") return SceneFormat::kPbrt;
  if (ending == ".ply") return SceneFormat::kPly;
  if (ending == ".obj") return SceneFormat::kObj;
  if (ending == ".stl") return SceneFormat::kStl;
  if (ending == ".gltf" || ending == ".glb") return SceneFormat::kGltf;
  try {
    std::array<char, 4> start{};
    const size_t size = InputFile(file, start.size()).read(start);
    const std::string_view text(start.data(), size);
    if (text == "glTF") return SceneFormat::kGltf;
    if (text == "ply\n" || text == "ply\r") return SceneFormat::kPly;
  } catch (const Error&) { // the reader of the file reports the error
  }
  return SceneFormat::kPbrt;
}

} // namespace packtrace
