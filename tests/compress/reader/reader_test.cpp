#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sys/wait.h>

#include "compress/format/file/baked_file.h"
#include "compress/format/pages/page_codec.h"
#include "compress/format/pages/page_encoder.h"
#include "pbrt_import/base/file_bytes.h"
#include "pbrt_import/scene/separate_motion.h"
#include "tests/compress/file_hashes.h"
#include "tests/compress/reader/reader_dump.h"
#include "tests/compress/test_scenes.h"
#include "tests/pbrt_import/scene_folder.h"

namespace packtrace {
namespace {

namespace fs = std::filesystem;
using reader_test::dump;
/// Files of a baked scene, and an independent reader written from the description of the format.
class IndependentReader : public testing::Test {
protected:
  void SetUp() override {
    if (std::string_view(PACKTRACE_PYTHON).empty()) GTEST_SKIP() << "CMake found no Python";
  }

  void write(const Scene& scene, BakeConfig config = {}) {
    config.repeated_clusters = RepeatedClusters::kMost; // for every codec, so that all files hold the same clusters
    for (const PageCodec codec : {PageCodec::kFast, PageCodec::kSmall}) {
      config.codec = codec;
      disk_[codec] = test::bake(scene, config).bytes;
    }
    config.codec = PageCodec::kNone;
    baked_ = test::bake(scene, config).bytes;
    dump_ = dump(BakedFile::from_bytes(baked_));
  }
  /// Bytes of the file with codec none.
  std::vector<std::byte>& baked() { return baked_; }
  std::vector<std::byte>& dumped() { return dump_; }
  std::vector<std::byte>& disk(PageCodec codec) { return disk_[codec]; }

  /// Exit code of the reader for the file with codec none: 0 if it decodes the same data.
  int read() const { return read(baked_); }
  int read(const std::vector<std::byte>& bytes) const {
    store("scene.ptk", bytes);
    store("scene.dump", dump_);
    const auto path = [&](const char* name) { return "'" + (folder_.path() / name).string() + "'"; };
    const std::string command =
        "'" PACKTRACE_PYTHON "' '" PACKTRACE_SOURCE_DIR "/tests/compress/reader/ptk_reader.py' " + path("scene.ptk") +
        " --expect " + path("scene.dump") + " --resident " + path("scene.resident") + " >/dev/null";
    const int status = std::system(command.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  /// The resident form of the last file, as the reader restored it.
  std::vector<std::byte> resident() const { return read_file_bytes(folder_.path() / "scene.resident"); }

  /// Expects the same data from the files of all codecs, and the resident form byte for byte.
  void expect_reads_every_codec() const {
    EXPECT_EQ(read(), 0);
    for (const auto& [codec, bytes] : disk_) {
      EXPECT_EQ(read(bytes), 0) << name_of(codec);
      EXPECT_TRUE(resident() == baked_) << name_of(codec);
    }
  }

private:
  void store(const std::string& name, const std::vector<std::byte>& bytes) const {
    folder_.write(name, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  }

  SceneFolder folder_;
  std::map<PageCodec, std::vector<std::byte>> disk_;
  std::vector<std::byte> baked_, dump_;
};

class IndependentReaderOfAssets : public IndependentReader, public testing::WithParamInterface<const char*> {};

TEST_F(IndependentReader, DecodesMotion) {
  Diagnostics diagnostics;
  Progress progress;
  const fs::path file = fs::path(PACKTRACE_SOURCE_DIR) / "tests/fuzz/corpus/import/bake_motion";
  Scene scene = import_scene(file, {}, diagnostics, progress).scene;
  separate_motion(scene);
  MotionTrack track = scene.motion.tracks[scene.motion.instances[0].track];
  track.interpolation = KeyInterpolation::kCatmullRom, track.loop = true;
  track.keys.insert(track.keys.begin() + 1, track.keys[0]);
  track.keys[1].time_s += 0.3, track.keys[1].translation += DVec3(1, 2, 3), track.keys[1].scale[1][0] = 0.5;
  scene.motion.tracks.push_back(track);
  InstanceMotion& first = scene.motion.instances[0];
  first.track = static_cast<uint32_t>(scene.motion.tracks.size() - 1), first.relative = true,
  first.pivot = Vec3(1, 2, 3);
  write(scene);
  EXPECT_GT(BakedFile::from_bytes(baked()).sections().rigid_motion.size(), 200u);
  expect_reads_every_codec();
}

TEST_P(IndependentReaderOfAssets, DecodesTheSame) {
  const fs::path file = fs::path(PACKTRACE_SOURCE_DIR) / "assets" / GetParam();
  Diagnostics diagnostics;
  Progress progress;
  write(import_scene(file, {}, diagnostics, progress).scene);
  EXPECT_GT(baked().size(), 5'000u);
  expect_reads_every_codec();
}

INSTANTIATE_TEST_SUITE_P(Scenes, IndependentReaderOfAssets,
                         testing::Values("room/room.pbrt", "extreme/extreme.pbrt", "features/quadrics.pbrt"),
                         [](const auto& scene) {
                           const std::string name = scene.param;
                           return name.substr(name.find('/') + 1, name.rfind('.') - name.find('/') - 1);
                         });

/// Normals in every direction, a palette of normals, texture coordinates, single triangles, instances.
/// @param rings of the sphere; the other meshes grow with it
Scene scene_of_every_stream(uint32_t rings = 30) {
  Scene scene = test::scene_of(test::sphere_mesh(rings));
  scene.masks.push_back(test::striped_mask());
  scene.materials.push_back({"leaf", kAlphaMask, Vec3(0.5f), 0, kNoMask});
  test::add_shape(scene, test::grid_mesh(rings * 4 / 3, 0.3f, true), test::translation({-3, 2, 1}), 1);
  Mesh faceted = test::grid_mesh(rings * 2 / 3, 0.4f);
  faceted.normals.assign(faceted.positions.size(), Vec3(0.0f, 0.6f, 0.8f));
  for (size_t i = 0; i < faceted.normals.size(); i += 3) faceted.normals[i] = Vec3(0.6f, 0.0f, -0.8f);
  test::add_shape(scene, faceted, test::scaling({1, -1, 1}));
  test::add_shape(scene, test::soup_mesh(rings * 10, 4));
  scene.meshes.push_back(test::sphere_mesh(9));
  scene.objects.push_back({"ball", {Shape{static_cast<uint32_t>(scene.meshes.size() - 1), 0, false, DAffine(1.0)}}});
  scene.instances.push_back({0, Affine(test::translation({5, 5, 5}))});
  scene.materials.push_back({"red", 0, Vec3(0.9f, 0.1f, 0.1f), kNoMask, kNoMask});
  scene.objects.push_back({"red ball", {scene.objects[0].shapes[0]}});
  scene.objects[1].shapes[0].material = 2;
  scene.instances.push_back({1, Affine(test::translation({-5, 5, 5}))}); // shares the ball's geometry
  return scene;
}

/// Enough for several clusters, and a quarter of the time that the reader takes for the default.
constexpr uint32_t kFewRings = 12;

TEST_F(IndependentReader, DecodesEveryStream) {
  write(scene_of_every_stream());
  const BakedFile file = BakedFile::from_bytes(baked());
  EXPECT_GT(file.summary().stream_bits[2], 0u); // normals
  EXPECT_GT(file.summary().stream_bits[3], 0u); // texture coordinates
  expect_reads_every_codec();
}

TEST_F(IndependentReader, DecodesEveryEncodingOfNormals) {
  for (uint32_t encoding = 0; encoding < kNormalFormats.size(); ++encoding) {
    BakeConfig config;
    config.normals = static_cast<NormalEncoding>(encoding);
    write(scene_of_every_stream(kFewRings), config);
    SCOPED_TRACE(format_of(*config.normals).name);
    expect_reads_every_codec();
  }
}

TEST_F(IndependentReader, DecodesEveryEncodingOfTextureCoordinates) {
  for (const UvEncoding encoding : {UvEncoding::kLattice, UvEncoding::kUnorm16, UvEncoding::kFp16}) {
    BakeConfig config;
    config.uvs = encoding;
    Scene scene = scene_of_every_stream(kFewRings);
    for (Vec2& uv : scene.meshes[1].uvs) uv = uv * 7.0f - Vec2(3.0f);
    write(scene, config);
    SCOPED_TRACE(kUvEncodingNames[static_cast<size_t>(encoding)]);
    expect_reads_every_codec();
  }
}

TEST_F(IndependentReader, DecodesEveryCodecOfTextures) {
  Scene scene = test::scene_of(test::grid_mesh(4));
  scene.materials[0].flags = kAlbedoTexture, scene.materials[0].albedo_texture = 0;
  test::Random random(8);
  for (const uint32_t width : {16u, 7u}) {
    scene.textures.push_back({"noise", width, 9, WrapMode::kRepeat, Vec2(1), Vec2(0), {}});
    for (uint32_t i = 0; i < 3 * width * 9; ++i)
      scene.textures.back().rgb.push_back(static_cast<uint8_t>(random.bits() % (1 + i / 3)));
  }
  for (size_t codec = 0; codec < kTextureCodecNames.size(); ++codec) {
    BakeConfig config;
    config.purpose = baked::kShading;
    config.textures = true;
    config.texture_codec = static_cast<TextureCodec>(codec);
    write(scene, config);
    EXPECT_EQ(read(), 0) << kTextureCodecNames[codec];
    dumped()[dumped().size() - 1 - sizeof(uint32_t)] ^= std::byte{1}; // the byte before the number of levels
    EXPECT_EQ(read(), 1) << "a texel that differs";
  }
}

TEST_F(IndependentReader, DecodesShading) {
  Scene scene = test::scene_of(test::grid_mesh(4));
  SurfaceShading& s = scene.materials[0].shading;
  s = {kFresnelConductor | kThin, 0.5f, Vec3(0.1f), Vec3(0.2f), Vec3(0.3f), Vec3(2.0f), Vec3(3.0f), 1.4f, 0.5f, 10.0f};
  for (uint32_t kind = 0; kind < 4; ++kind) {
    Light light;
    light.kind = static_cast<LightKind>(kind), light.radiance = Vec3(1.0f, 2.0f, static_cast<float>(kind));
    if (light.kind == LightKind::kInfinite) light.map = 0;
    scene.lights.push_back(light);
  }
  scene.environment_maps.push_back({"sky", 2, 1, {Vec3(0.1f, 0.2f, 0.3f), Vec3(1000.0f)}});
  BakeConfig config;
  config.purpose = baked::kShading;
  write(scene, config);
  expect_reads_every_codec();
  dumped()[dumped().size() - 1] ^= std::byte{1};
  EXPECT_EQ(read(), 1) << "a map that differs";
}

TEST_F(IndependentReader, DecodesGeometryOfMoreThanTwoToThe31Steps) {
  Scene scene = test::scene_of(test::grid_mesh(3), test::scaling(DVec3(1e-6)));
  Mesh& mesh = scene.meshes[0];
  const Mesh far = test::grid_mesh(3);
  const auto first = static_cast<uint32_t>(mesh.positions.size());
  for (const Vec3 p : far.positions) mesh.positions.push_back(p + Vec3(1e6f, -1e6f, 1e6f));
  for (const Triangle& t : far.triangles) mesh.triangles.push_back(t + first);
  mesh.uvs.clear();
  BakeConfig config;
  config.precision_kind = PrecisionKind::kPositionBits;
  config.precision = 40.0;
  write(scene, config);
  EXPECT_GT(BakedFile::from_bytes(baked()).geometries()[0].anchor_shift, 0u);
  expect_reads_every_codec();
}

TEST_F(IndependentReader, DecodesLevelsOfDetailAndCutsThem) {
  Scene scene = scene_of_every_stream();
  for (Vec3& n : scene.meshes[0].normals) n = glm::normalize(n + Vec3(0.0f, 0.3f, 0.0f));
  BakeConfig config;
  config.lod = LodUse::kAll;
  config.lod_min_triangles = 200;
  write(scene, config);
  const BakedFile file = BakedFile::from_bytes(baked());
  ASSERT_GT(file.lod(0).levels.size(), 3u);
  ASSERT_GT(file.lod(1).levels.size(), 3u);
  ASSERT_GT(file.lod(file.base_geometry_count() - 1).levels.size(), 1u);
  expect_reads_every_codec();
  dumped().back() ^= std::byte{1}; // the last cluster of the last cut
  EXPECT_EQ(read(), 1);
  // A level that states fewer triangles than a cut at its error has.
  baked::FileHeader header;
  std::memcpy(&header, baked().data(), sizeof header);
  const size_t at = header.sections[baked::kLodLevels].offset + sizeof(baked::LodLevelRecord);
  std::memset(baked().data() + at + offsetof(baked::LodLevelRecord, triangles), 0, sizeof(uint32_t));
  EXPECT_EQ(read(), 3);
}

TEST_F(IndependentReader, SeesBoxesThatDoNotHoldTheirTriangles) {
  write(test::scene_of(test::sphere_mesh(16)));
  const BakedFile file = BakedFile::from_bytes(baked());
  const std::span<const baked::PackedNode> nodes = file.sections().nodes;
  ASSERT_GT(nodes.size(), 2u);
  EXPECT_EQ(read(), 0);
  baked::FileHeader header;
  std::memcpy(&header, baked().data(), sizeof header);
  for (const size_t node : {size_t{0}, nodes.size() - 1}) {
    const size_t at = header.sections[baked::kNodes].offset + node * sizeof(baked::PackedNode);
    std::byte& origin = baked()[at + offsetof(baked::PackedNode, origin)];
    origin ^= std::byte{8};
    EXPECT_EQ(read(), 3) << node;
    origin ^= std::byte{8};
  }
}

TEST_F(IndependentReader, ReadsPagesAndNodesThatAreStoredWhole) {
  write(test::scene_of(test::soup_mesh(300, 5)));
  std::vector<std::byte> odd = baked();
  const BakedFile file = BakedFile::from_bytes(baked());
  const ClusterView view = file.cluster(0, 0);
  ASSERT_NE(view.stream_bits().total() % 32, 0u) << "no padding";
  const auto begin = static_cast<size_t>(view.bits() - reinterpret_cast<const uint8_t*>(file.bytes().data()));
  // A padding bit, which is never read.
  odd[begin + static_cast<size_t>(view.stream_bits().total() / 32 * 4 + 3)] |= std::byte{0x80};
  baked::FileHeader header;
  std::memcpy(&header, odd.data(), sizeof header);
  // No longer the nearest bound.
  odd[header.sections[baked::kNodes].offset + offsetof(baked::PackedNode, hi)] ^= std::byte{1};
  test::rehash<baked::FileHeader>(odd);
  for (const PageCodec codec : {PageCodec::kFast, PageCodec::kSmall}) {
    const std::vector<std::byte> stored = encode_paged_file(BakedFile::from_bytes(odd), codec);
    baked::PagedHeader paged;
    std::memcpy(&paged, stored.data(), sizeof paged);
    EXPECT_EQ(paged.node_form, 0u);
    EXPECT_EQ(read(stored), 3) << "what nobody reads is not as the description says";
    EXPECT_TRUE(resident() == odd) << name_of(codec);
  }
}

TEST_F(IndependentReader, RefusesPagesThatAreNotWhole) {
  write(test::scene_of(test::sphere_mesh(8)));
  for (const PageCodec codec : {PageCodec::kFast, PageCodec::kSmall}) {
    ASSERT_EQ(read(disk(codec)), 0);
    for (const size_t from_end : {size_t{1}, size_t{60}, size_t{200}}) {
      std::vector<std::byte> damaged = disk(codec);
      damaged[damaged.size() - from_end] ^= std::byte{0x10};
      EXPECT_NE(read(damaged), 0) << name_of(codec) << " " << from_end;
    }
    disk(codec).pop_back();
    EXPECT_EQ(read(disk(codec)), 3);
  }
}

TEST_F(IndependentReader, TellsWhatDiffersFromWhatIsNoFile) {
  write(test::scene_of(test::sphere_mesh(8)));
  ASSERT_EQ(read(), 0);
  const std::vector<std::byte> good = dumped();
  dumped()[16] ^= std::byte{1}; // in the first lattice coordinate
  EXPECT_EQ(read(), 1);
  dumped() = good;
  dumped().pop_back();
  EXPECT_EQ(read(), 1);
  dumped() = good;
  baked()[8] ^= std::byte{0x40}; // the version
  EXPECT_EQ(read(), 3);
}

} // namespace
} // namespace packtrace
