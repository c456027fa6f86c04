#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "compress/exchange/gltf/export_losses.h"

namespace packtrace {

/// A file of an export.
struct ExportedFile {
  std::string name; ///< relative to the folder of the main file; ASCII, with "/" between folder and file
  std::vector<std::byte> bytes;
};

/// Receives the bytes of a file in order, as they are generated.
using ByteSink = std::function<void(std::span<const std::byte>)>;

/// Statistics of an export to a scene.
struct SceneReport {
  uint64_t shapes = 0, objects = 0, instances = 0, materials = 0, images = 0, cameras = 0;
  uint64_t vertices = 0, triangles = 0; ///< as stored in the files
  uint64_t file_bytes = 0;              ///< of all files
  uint64_t moving = 0;                  ///< 1 if motion is left out: everything is at the time that was baked
  std::vector<ExportLoss> losses;
};

/// An export that consists of several files.
struct SceneExport {
  std::vector<ExportedFile> files; ///< the main file last, unless a sink took it
  SceneReport report;
};

} // namespace packtrace
