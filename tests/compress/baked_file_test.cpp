#include "compress/format/file/baked_file.h"

#include <algorithm>
#include <cstring>

#include <gtest/gtest.h>

#include "compress/format/file/file_summary.h"
#include "pbrt_import/base/error.h"
#include "tests/compress/file_damage.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

using test::message_after, test::open_kind, test::rehash;

/// A small scene whose file has data in every section.
Scene full_scene() {
  Scene scene = test::scene_of(test::grid_mesh(3, 0.1f, true));
  AlphaMask mask;
  mask.width = 40, mask.height = 2;
  mask.words = {1, 2, 3, 4};
  mask.uv_scale = {2, 1};
  scene.masks.push_back(mask);
  scene.materials.push_back({"leaf", kAlphaMask, Vec3(0.1f, 0.5f, 0.2f), 0, kNoMask});
  scene.textures.push_back({"checks", 5, 3, WrapMode::kClamp, Vec2(1, 2), Vec2(0.5f, 0), {}});
  for (uint8_t i = 0; i < 45; ++i) scene.textures[0].rgb.push_back(static_cast<uint8_t>(i * 5));
  scene.materials[1].flags |= kAlbedoTexture;
  scene.materials[1].albedo_texture = 0;
  test::add_shape(scene, test::grid_mesh(2), test::translation({0, 0, 1}), 1);
  scene.meshes.push_back(test::sphere_mesh(4));
  Object object{"ball", {Shape{2, 0, false, DAffine(1.0)}}};
  scene.objects.push_back(object);
  scene.instances.push_back({0, Affine(test::translation({5, 0, 0}))});
  scene.instances.push_back({0, Affine(test::translation({-5, 0, 0}))});
  Camera camera;
  camera.screen_window = glm::dvec4(-1, 1, -2, 2);
  camera.film_name = "out.exr";
  scene.cameras.push_back(camera);
  scene.dropped_triangles = 3;
  return scene;
}

BakedScene full_bake() {
  BakeConfig config;
  config.purpose = baked::kShading;
  config.textures = true;
  config.texture_codec = TextureCodec::kBc1;
  return test::bake(full_scene(), config);
}

/// Reads everything that the interface of BakedFile gives access to.
void read_all(const BakedFile& file) {
  for (uint32_t g = 0; g < file.geometries().size(); ++g) {
    const test::Decoded all = test::decode(file, g);
    for (const Triangle& t : all.triangles) ASSERT_LT(std::max({t.x, t.y, t.z}), all.positions.size());
    for (const Vec3 p : all.positions) ASSERT_TRUE(is_finite(p));
    for (uint32_t i = 0; i < all.triangles.size(); ++i)
      ASSERT_LT(file.cluster_of_triangle(g, i), file.clusters(g).size());
    for (uint32_t c = 0; c < file.clusters(g).size(); ++c) {
      const ClusterView view = file.cluster(g, c);
      for (uint32_t i = 0; i < view.triangle_count(); ++i) {
        const Triangle t = view.triangle(i);
        ASSERT_LT(std::max({t.x, t.y, t.z}), view.vertex_count());
      }
    }
  }
  for (uint32_t i = 0; i < file.sections().masks.size(); ++i) (void)file.mask(i).opaque(Vec2(0.3f, 0.7f));
  for (uint32_t i = 0; i < file.sections().textures.size(); ++i) {
    const TextureView texture = file.texture(i);
    for (uint32_t x = 0; x < std::min(texture.width, 100u); ++x) (void)texture.texel(x, texture.height - 1);
    ASSERT_TRUE(is_finite(texture.sample(Vec2(0.3f, 0.7f))));
  }
  for (const Material& m : file.materials()) (void)m.name.size();
  (void)file.cameras();
  (void)summarize(file);
}

TEST(BakedFile, EverythingComesBack) {
  const Scene scene = full_scene();
  const BakedScene baked = full_bake();
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  ASSERT_EQ(file.geometries().size(), 3u);
  ASSERT_EQ(file.instances().size(), 4u);
  EXPECT_EQ(file.instances()[2].geometry, file.instances()[3].geometry);
  EXPECT_EQ(file.world_from_object(3)[3], Vec3(-5, 0, 0));
  const auto materials = file.materials();
  ASSERT_EQ(materials.size(), 2u);
  EXPECT_EQ(materials[1].name, "leaf");
  EXPECT_EQ(materials[1].flags, kAlphaMask | kAlbedoTexture);
  EXPECT_EQ(materials[1].albedo_texture, 0u);
  EXPECT_EQ(materials[0].albedo_texture, kNoTexture);
  const TextureView texture = file.texture(0);
  EXPECT_EQ(texture.width, 5u);
  EXPECT_EQ(texture.height, 3u);
  EXPECT_EQ(texture.wrap, WrapMode::kClamp);
  EXPECT_EQ(texture.uv_scale, Vec2(1, 2));
  EXPECT_EQ(texture.codec, TextureCodec::kBc1);
  EXPECT_EQ(file.text(file.sections().textures[0].name), "checks");
  EXPECT_EQ(materials[1].albedo, Vec3(0.1f, 0.5f, 0.2f));
  EXPECT_EQ(materials[1].alpha_mask, 0u);
  EXPECT_EQ(file.mask(0).width, 40u);
  EXPECT_EQ(file.mask(0).uv_scale, Vec2(2, 1));
  EXPECT_TRUE(std::ranges::equal(file.mask(0).words, scene.masks[0].words));
  const auto cameras = file.cameras();
  ASSERT_EQ(cameras.size(), 1u);
  EXPECT_EQ(cameras[0].screen_window, scene.cameras[0].screen_window);
  EXPECT_EQ(cameras[0].film_name, "out.exr");
  EXPECT_EQ(file.text(file.geometries()[2].name), "ball");
  EXPECT_EQ(file.summary().dropped_triangles, 3u);
  EXPECT_NEAR(file.world_bounds().lo.x, -6.0, 0.01);
  EXPECT_NEAR(file.world_bounds().hi.x, 6.0, 0.01);
  read_all(file);
}

TEST(BakedFile, EveryTruncatedPrefixIsRefused) {
  const BakedScene baked = full_bake();
  for (size_t size = 0; size < baked.bytes.size(); ++size)
    ASSERT_EQ(open_kind(std::span(baked.bytes).first(size)), ErrorKind::kInput) << size;
}

TEST(BakedFile, TrailingBytesAreRefused) {
  BakedScene baked = full_bake();
  baked.bytes.resize(baked.bytes.size() + 64);
  EXPECT_EQ(open_kind(baked.bytes), ErrorKind::kInput);
}

TEST(BakedFile, EverySingleBitFlipIsRefused) {
  BakedScene baked = full_bake();
  for (size_t bit = 0; bit < 8 * baked.bytes.size(); ++bit) {
    const auto flip = static_cast<std::byte>(1u << (bit % 8));
    baked.bytes[bit / 8] ^= flip;
    const ErrorKind kind = open_kind(baked.bytes);
    const bool in_version = bit / 8 >= 8 && bit / 8 < 12;
    ASSERT_EQ(kind, in_version ? ErrorKind::kUnsupported : ErrorKind::kInput) << bit;
    baked.bytes[bit / 8] ^= flip;
  }
}

TEST(BakedFile, DamageWithRightHashesIsRefusedOrHarmless) {
  const BakedScene baked = full_bake();
  test::Random random(14);
  uint32_t refused = 0, accepted = 0;
  for (int round = 0; round < 20000; ++round) {
    std::vector<std::byte> bytes = baked.bytes;
    const uint32_t changes = 1 + random.bits() % 3;
    for (uint32_t i = 0; i < changes; ++i) {
      const size_t at = 12 + random.bits() % (bytes.size() - 12); // behind magic and version
      constexpr std::array<uint8_t, 6> kValues = {0, 1, 0x7f, 0x80, 0xff, 0xfe};
      bytes[at] = static_cast<std::byte>(random.bits() % 2 ? kValues[random.bits() % 6] : random.bits() & 0xffu);
    }
    rehash<baked::FileHeader>(bytes);
    try {
      const BakedFile file = BakedFile::from_bytes(bytes);
      read_all(file);
      ++accepted;
    } catch (const Error& error) {
      ASSERT_EQ(error.kind(), ErrorKind::kInput) << error.what();
      ++refused;
    }
    if (testing::Test::HasFatalFailure()) return;
  }
  EXPECT_GT(refused, 1000u); // both outcomes must occur often enough
  EXPECT_GT(accepted, 100u);
}

TEST(BakedFile, MessagesNameWhatAndWhere) {
  BakedScene baked = full_bake();
  baked::FileHeader header;
  std::memcpy(&header, baked.bytes.data(), sizeof header);
  const size_t at = header.sections[baked::kInstances].offset + 3 * sizeof(baked::InstanceRecord) +
                    offsetof(baked::InstanceRecord, geometry);
  baked.bytes[at] = std::byte{200};
  rehash<baked::FileHeader>(baked.bytes);
  std::string message;
  EXPECT_EQ(open_kind(baked.bytes, &message), ErrorKind::kInput);
  EXPECT_EQ(message, "memory: damaged baked file: instance 3: geometry");
  const std::string_view text = "Shape \"sphere\"";
  EXPECT_EQ(open_kind(std::as_bytes(std::span(text)), &message), ErrorKind::kInput);
  EXPECT_EQ(message, "memory: not a packtrace baked file");
}

TEST(BakedFile, MaterialSlotsAreChecked) {
  Scene scene = full_scene(); // materials 0: plain, 1: masked
  scene.instances.push_back({1, Affine(1.0f)});
  scene.objects.push_back({"masked ball", {Shape{2, 1, false, DAffine(1.0)}, Shape{0, 0, false, DAffine(1.0)}}});
  const std::vector<std::byte> bytes = test::bake(scene).bytes;
  const BakedFile file = BakedFile::from_bytes(bytes);
  ASSERT_EQ(file.sections().material_slots.size(), 4u); // {0}, {1}, {0, 1}
  ASSERT_EQ(file.instances()[4].first_slot, 2u);
  ASSERT_EQ(file.geometries()[3].slot_count, 2u);
  const auto message = [&](baked::Section section, size_t at, uint32_t value) {
    return message_after(bytes, section, at, value);
  };
  const auto slots_of = [](size_t geometry) {
    return geometry * sizeof(baked::GeometryRecord) + offsetof(baked::GeometryRecord, slot_count);
  };
  const auto first_slot_of = [](size_t instance) {
    return instance * sizeof(baked::InstanceRecord) + offsetof(baked::InstanceRecord, first_slot);
  };
  const std::string damaged = "memory: damaged baked file: ";
  EXPECT_EQ(message(baked::kMaterialSlots, 4, 2), damaged + "material slot 1: material");
  EXPECT_EQ(message(baked::kGeometries, slots_of(0), 0), damaged + "geometry 0: material slots");
  EXPECT_EQ(message(baked::kGeometries, slots_of(2), 2), damaged + "geometry 2: material slots"); // it has one cluster
  EXPECT_EQ(message(baked::kGeometries, slots_of(2), ~0u), damaged + "instance 2: material slots");
  EXPECT_EQ(message(baked::kInstances, first_slot_of(4), 3), damaged + "instance 4: material slots");
  EXPECT_EQ(message(baked::kInstances, first_slot_of(0), ~0u), damaged + "instance 0: material slots");
  // Instance 2 has other classes.
  EXPECT_EQ(message(baked::kInstances, first_slot_of(3), 1), damaged + "instance 3: material classes");
  // The classes descend.
  EXPECT_EQ(message(baked::kInstances, first_slot_of(4), 1), damaged + "instance 4: material classes");
  EXPECT_EQ(message(baked::kInstances, first_slot_of(0), 1), damaged + "cluster 0: material class order");
  EXPECT_EQ(
      message(baked::kInstances, 4 * sizeof(baked::InstanceRecord) + offsetof(baked::InstanceRecord, geometry), 0),
      damaged + "geometry 3: no instance places it");
  EXPECT_EQ(message(baked::kClusters, offsetof(baked::ClusterRecord, material_slot), 1),
            damaged + "cluster 0: material slot");
}

TEST(BakedFile, MaskedClustersNeedTextureCoordinates) {
  const std::vector<std::byte> bytes = test::bake(full_scene()).bytes;
  const BakedFile file = BakedFile::from_bytes(bytes);
  ASSERT_EQ(file.clusters(1).size(), 1u); // masked
  const baked::ClusterRecord record = file.clusters(1)[0];
  ASSERT_NE(record.flags & baked::kClusterHasUvs, 0);
  constexpr size_t kWord = offsetof(baked::ClusterRecord, flags) - 3; // the u32 with the flags in its highest byte
  uint32_t word = 0;
  std::memcpy(&word, reinterpret_cast<const std::byte*>(&record) + kWord, sizeof word);
  const size_t at = static_cast<size_t>(file.geometries()[1].first_cluster) * sizeof record + kWord;
  EXPECT_EQ(message_after(bytes, baked::kClusters, at, word & ~(uint32_t{baked::kClusterHasUvs} << 24)),
            "memory: damaged baked file: cluster 1: masked material without texture coordinates");
}

TEST(BakedFile, RequirementsAreChecked) {
  const std::vector<std::byte> bytes = test::bake(full_scene()).bytes;
  ASSERT_GE(BakedFile::from_bytes(bytes).sections().requirements.size(), 3u);
  const std::string damaged = "memory: damaged baked file: ";
  constexpr size_t kRow = sizeof(baked::RequirementRecord);
  const auto message = [&](size_t at, uint32_t value) { return message_after(bytes, baked::kRequirements, at, value); };
  EXPECT_EQ(message(0, baked::kStreamCount), damaged + "requirement 0: stream or reason");
  EXPECT_EQ(message(4, baked::kReasonCount), damaged + "requirement 0: stream or reason");
  EXPECT_EQ(message(kRow + 8, 0), damaged + "requirement 1: geometries");
  EXPECT_EQ(message(kRow + 8, 4), damaged + "requirement 1: geometries"); // of three geometries
  EXPECT_EQ(message(kRow + 12, 1), damaged + "requirement 1: stream or reason");
  EXPECT_EQ(message(0, baked::kTangents), damaged + "requirement 1: order");
  EXPECT_EQ(message_after(bytes, baked::kSummary, offsetof(baked::SummaryRecord, purpose), 2), damaged + "purpose");
  EXPECT_EQ(message_after(bytes, baked::kSummary, offsetof(baked::SummaryRecord, purpose), 8u << baked::kKeepShift),
            damaged + "purpose");
  EXPECT_EQ(message_after(bytes, baked::kGeometries, offsetof(baked::GeometryRecord, requirements), 1u << 24),
            damaged + "geometry 0: requirements");
}

TEST(BakedFile, MovingKeepsItsViewsValid) {
  BakedFile first = BakedFile::from_bytes(full_bake().bytes);
  const ClusterView view = first.cluster(0, 0);
  const Vec3 before = view.position(0);
  const BakedFile second = std::move(first);
  EXPECT_EQ(view.position(0), before);
  EXPECT_EQ(second.cluster(0, 0).position(0), before);
}

TEST(FileSummary, StreamsAddUpToTheFile) {
  const FileSummary s = summarize(BakedFile::from_bytes(full_bake().bytes));
  const StreamBytes& b = s.bytes;
  EXPECT_EQ(b.indices + b.positions + b.normals + b.uvs + b.payload_padding + b.cluster_records + b.geometry_records +
                b.instance_records + b.material_records + b.masks + b.textures + b.cameras + b.strings +
                b.requirement_records + b.trees + b.shading_materials + b.lights + b.environment_maps + b.proxies +
                b.header_and_alignment,
            b.total);
  EXPECT_GT(b.uvs, 0u);
  EXPECT_GT(b.normals, 0u);
  EXPECT_GT(b.textures, 0u);
  EXPECT_EQ(b.trees, s.trees * sizeof(baked::TreeRecord) + s.nodes * sizeof(baked::PackedNode));
  EXPECT_EQ(s.trees, 2u);
  ASSERT_EQ(s.textures.size(), 1u);
  EXPECT_EQ(s.textures[0].bytes, 16u);
  EXPECT_GT(s.textures[0].psnr_db, 20.0f);
  EXPECT_EQ(s.shared_geometries, 1u);
  EXPECT_EQ(s.placed_triangles, 18u + 8u + 2u * 48u);
  EXPECT_EQ(s.triangles, 18u + 8u + 48u);
  ASSERT_EQ(s.grids.size(), 3u); // two nested grids in world space, one of the object
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(s.grids[i].world_space, i < 2);
    EXPECT_EQ(s.grids[i].geometries, 1u);
  }
  EXPECT_LE(s.max_position_error, s.max_position_error_bound);
}

} // namespace
} // namespace packtrace
