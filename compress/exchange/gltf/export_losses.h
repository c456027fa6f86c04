#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "compress/format/file/baked_file.h"

namespace packtrace {

/// Export formats that cannot hold all data of a baked file.
enum class ExportFormat { kGltf, kPbrt, kObj, kStreams };

/// glTF export settings that decide which data is kept.
struct GltfKeeps {
  bool levels = false;       ///< levels of detail
  bool transmission = false; ///< KHR_materials_transmission
};

/// A kind of data that an export drops or changes, and how often. GltfReport and SceneReport hold codec errors, motion
/// and losses that depend on the exporter's choices.
struct ExportLoss {
  std::string_view key;  ///< in JSON: docs/json_output.md
  std::string_view what; ///< completes "12 ...", with a plural noun
  uint64_t count = 0;    ///< at least 1
};

/// Counts what an export leaves out, in a fixed order.
/// @param gltf for ExportFormat::kGltf
std::vector<ExportLoss> find_losses(const BakedFile& file, ExportFormat format, const GltfKeeps& gltf = {});

} // namespace packtrace
