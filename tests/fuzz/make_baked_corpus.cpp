// Bakes scenes of the import corpus, so that the baked corpus always has the current format: with each codec, with and
// without LOD levels, without trees, and with each encoding of normals and textures that the scene has.

#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "compress/bake/bake_scene.h"
#include "pbrt_import/base/file_bytes.h"
#include "pbrt_import/import_scene.h"
#include "pbrt_import/scene/separate_motion.h"
#include "tests/fuzz/scene_files.h"

namespace {

using namespace packtrace;

Scene read_scene(const std::filesystem::path& input) {
  std::ifstream in(input, std::ios::binary);
  const std::string text(std::istreambuf_iterator<char>(in), {});
  fuzz::SceneFilesFolder files;
  ImportOptions options;
  options.keep_textures = options.keep_shading = true;
  options.tessellation_tolerance = 0.1; // coarse tessellation: in small files, small changes matter more
  Diagnostics diagnostics;
  Progress progress;
  Scene scene = import_scene(files.write(text), options, diagnostics, progress).scene;
  separate_motion(scene);
  return scene;
}

/// Five frames of a mesh that is sheared.
class SwayingFrames final : public MeshFrames {
public:
  explicit SwayingFrames(const Mesh& mesh) : mesh_(mesh) {}
  uint32_t count() const override { return 5; }
  std::vector<Vec3> positions(uint32_t frame) const override {
    std::vector<Vec3> moved = mesh_.positions;
    for (Vec3& p : moved) p.x += 0.1f * static_cast<float>(frame * frame) * p.y;
    return moved;
  }
  std::string name(uint32_t frame) const override { return "frame " + std::to_string(frame); }

private:
  const Mesh& mesh_;
};

/// Writes FOLDER/NAME.ending files of one scene.
class CorpusWriter {
public:
  CorpusWriter(const Scene& scene, std::filesystem::path stem) : scene_(scene), stem_(std::move(stem)) {
    config_.lod_min_triangles = 48; // allows LOD levels of geometries with one cluster
    config_.purpose = baked::kShading;
    config_.textures = true;
  }

  void write_all() const {
    for (const PageCodec codec : {PageCodec::kNone, PageCodec::kFast, PageCodec::kSmall}) {
      BakeConfig config = config_;
      config.choose_codec(codec);
      write(config, std::string(name_of(codec)));
      config.lod = LodUse::kAll;
      write(config, std::string(name_of(codec)) + ".lod");
    }
    BakeConfig config = config_;
    config.trees = false;
    write(config, "treeless");
    write_proxies();
    write_sequence();
    if (!scene_.textures.empty()) write_texture_codecs();
    if (has_normals()) write_normal_encodings();
  }

private:
  void write(const BakeConfig& config, const std::string& ending) const {
    Diagnostics diagnostics;
    Progress progress;
    write_file_bytes(stem_.string() + "." + ending, bake_to_bytes(scene_, config, diagnostics, progress).bytes);
  }

  void write_proxies() const {
    BakeConfig config = config_;
    config.proxy.use = ProxyUse::kVoxels;
    config.proxy.voxels = 6;
    config.proxy.materials = true;
    write(config, "voxels");
    config.proxy.voxels = 20;
    config.proxy.materials = false, config.proxy.dag = true, config.proxy.fill = true;
    config.codec = PageCodec::kSmall;
    write(config, "dag");
    config.proxy = {};
    config.proxy.use = ProxyUse::kField;
    config.proxy.voxels = 5;
    write(config, "sdf");
  }

  /// Moves the first mesh of the scene.
  void write_sequence() const {
    if (scene_.meshes.empty()) return;
    BakeConfig config = config_;
    config.sequence_group = 2; // several groups in few bytes
    config.sequences.push_back({0, std::make_shared<SwayingFrames>(scene_.meshes[0]), 24.0, 0});
    write(config, "sequence");
  }

  void write_texture_codecs() const {
    for (size_t codec = 0; codec < kTextureCodecNames.size(); ++codec) {
      BakeConfig config = config_;
      config.texture_codec = static_cast<TextureCodec>(codec);
      write(config, std::string(kTextureCodecNames[codec]));
    }
  }

  void write_normal_encodings() const {
    for (size_t encoding = 0; encoding < kNormalFormats.size(); ++encoding) {
      BakeConfig config = config_;
      config.normals = static_cast<NormalEncoding>(encoding);
      config.keep_normals = true;
      config.codec = encoding % 2 == 0 ? PageCodec::kFast : PageCodec::kSmall;
      write(config, std::string(kNormalFormats[encoding].name));
    }
  }

  bool has_normals() const {
    for (const Mesh& mesh : scene_.meshes)
      if (!mesh.normals.empty()) return true;
    return false;
  }

  const Scene& scene_;
  std::filesystem::path stem_;
  BakeConfig config_;
};

} // namespace

int main(int count, char** arguments) {
  try {
    if (count < 3) throw std::runtime_error("usage: make_baked_corpus FOLDER INPUT...");
    const std::filesystem::path folder = arguments[1];
    std::filesystem::create_directories(folder);
    for (int i = 2; i < count; ++i) {
      const std::filesystem::path input = arguments[i];
      const Scene scene = read_scene(input);
      CorpusWriter(scene, folder / input.stem()).write_all();
    }
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
