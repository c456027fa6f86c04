// Writes the baked forms of scenes of the import corpus, so that the baked corpus always has the current format.

#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "compress/bake/bake_scene.h"
#include "pbrt_import/import_scene.h"
#include "pbrt_import/scene/file_bytes.h"
#include "tests/fuzz/scene_files.h"

namespace {

using namespace packtrace;

void bake_input(const std::filesystem::path& input, const std::filesystem::path& folder) {
  std::ifstream in(input, std::ios::binary);
  const std::string text(std::istreambuf_iterator<char>(in), {});
  fuzz::SceneFilesFolder files;
  ImportOptions options;
  options.keep_textures = true;
  options.tessellation_tolerance = 0.1; // small files make small changes matter
  Diagnostics diagnostics;
  Progress progress;
  const ImportResult result = import_scene(files.write(text), options, diagnostics, progress);
  const auto write = [&](PageCodec codec, LodUse lod, const std::string& ending) {
    BakeConfig config;
    config.lod = lod;
    config.lod_min_triangles = 129; // of more than one cluster
    config.purpose = baked::kShading;
    config.textures = true;
    config.codec = codec;
    write_file_bytes(folder / (input.stem().string() + "." + ending),
                     bake_to_bytes(result.scene, config, diagnostics, progress).bytes);
  };
  for (const PageCodec codec : {PageCodec::kNone, PageCodec::kFast, PageCodec::kSmall})
    write(codec, LodUse::kOff, std::string(name_of(codec)));
  write(PageCodec::kNone, LodUse::kAll, "lod");
}

} // namespace

int main(int count, char** arguments) {
  try {
    if (count < 3) throw std::runtime_error("usage: make_baked_corpus FOLDER INPUT...");
    std::filesystem::create_directories(arguments[1]);
    for (int i = 2; i < count; ++i) bake_input(arguments[i], arguments[1]);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
