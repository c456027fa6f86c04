#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "compress/exchange/gltf/gltf_export.h"
#include "compress/exchange/scene/exported_file.h"
#include "compress/exchange/vertex16/vertex16_export.h"

namespace packtrace {

/// Files and settings in the reports of an export.
struct ExportNames {
  std::string input, output;
  std::string profile, codec; ///< of glTF
  std::string layout;         ///< of scenes and arrays
};

nlohmann::json to_json(const ExportNames& names, const Vertex16Report& report);
std::string to_text(const ExportNames& names, const Vertex16Report& report);
nlohmann::json to_json(const ExportNames& names, const GltfReport& report);
std::string to_text(const ExportNames& names, const GltfReport& report);
nlohmann::json to_json(const ExportNames& names, const SceneReport& report);
std::string to_text(const ExportNames& names, const SceneReport& report);

} // namespace packtrace
