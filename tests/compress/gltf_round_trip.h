#pragma once

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <vector>

#include <gtest/gtest.h>

#include "pbrt_import/base/diagnostics.h"
#include "pbrt_import/import_scene.h"
#include "tests/compress/test_scenes.h"

/// Writes exported glTF files and bakes them again.
namespace packtrace::gltf_test {

inline BakedScene bake_for_shading(const Scene& scene) {
  BakeConfig config;
  config.purpose = baked::kShading;
  config.textures = true;
  return test::bake(scene, config);
}

inline void write(const std::filesystem::path& path, const std::vector<std::byte>& bytes) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

/// Imports a glTF file and bakes it with default settings.
inline BakedScene bake_again(const std::filesystem::path& path) {
  ImportOptions options;
  options.keep_textures = true;
  Diagnostics diagnostics;
  Progress progress;
  const ImportResult result = import_scene(path, options, diagnostics, progress);
  EXPECT_TRUE(diagnostics.entries().empty()) << diagnostics.entries().front().message;
  return bake_for_shading(result.scene);
}

} // namespace packtrace::gltf_test
