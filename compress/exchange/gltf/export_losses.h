#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "compress/format/file/baked_file.h"

namespace packtrace {

/// Formats whose exports leave things out.
enum class ExportFormat { kGltf, kPbrt, kObj, kStreams };

/// Settings of a glTF file that decide what it keeps.
struct GltfKeeps {
  bool levels = false;       ///< levels of detail
  bool transmission = false; ///< KHR_materials_transmission
};

/// Something of a baked file that an export leaves out or changes. Errors of codecs, motion and what depends on the
/// exporter's choices (GltfReport, SceneReport) are reported apart.
struct ExportLoss {
  std::string_view key;  ///< in JSON: docs/json_output.md
  std::string_view what; ///< completes "12 ...", with a plural noun
  uint64_t count = 0;    ///< at least 1
};

/// Counts what an export leaves out, in a fixed order.
/// @param gltf for ExportFormat::kGltf
std::vector<ExportLoss> find_losses(const BakedFile& file, ExportFormat format, const GltfKeeps& gltf = {});

} // namespace packtrace
