#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

namespace packtrace {

/// Formats of scene files.
enum class SceneFormat : uint8_t { kPbrt, kPly, kObj, kStl, kGltf };

/// Name of the format for messages: "pbrt", "PLY", "OBJ", "STL", "glTF".
std::string_view to_string(SceneFormat format);

/// The format of a file: by its name's ending (.pbrt, .ply, .obj, .stl, .gltf, .glb, also in upper case and followed by
/// .gz), otherwise by its first bytes. Files that match none are taken for pbrt scenes.
SceneFormat scene_format(const std::filesystem::path& file);

} // namespace packtrace
