#include "compress/format/pages/page_codec.h"

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "compress/format/file/file_summary.h"
#include "compress/format/pages/page_contexts.h"
#include "compress/format/pages/page_decoder.h"
#include "compress/format/pages/page_encoder.h"
#include "pbrt_import/base/error.h"
#include "tests/compress/file_hashes.h"
#include "tests/compress/test_scenes.h"
#include "tests/sanitized.h"

namespace packtrace {
namespace {

using Bytes = std::vector<std::byte>;

BakeConfig config_of(PageCodec codec, std::optional<NormalEncoding> normals = {}) {
  BakeConfig config;
  config.codec = codec;
  config.normals = normals;
  return config;
}

/// Bumps with normals, a mask with texture coordinates, creases, triangle soup, and an instanced sphere.
Scene mixed_scene(uint32_t n) {
  Scene scene = test::scene_of(test::grid_mesh(n, 0.1f, true));
  AlphaMask mask;
  mask.width = 40, mask.height = 2;
  mask.words = {1, 2, 3, 4};
  scene.masks.push_back(mask);
  scene.materials.push_back({"leaf", kAlphaMask, Vec3(0.1f, 0.5f, 0.2f), 0, kNoMask});
  test::add_shape(scene, test::grid_mesh(n / 2), test::translation({0, 0, 1}), 1);
  test::add_shape(scene, test::soup_mesh(n, 3), test::translation({0, 3, 0}));
  scene.meshes.push_back(test::sphere_mesh(n));
  scene.objects.push_back({"ball", {Shape{3, 0, false, DAffine(1.0)}}});
  scene.instances.push_back({0, Affine(test::translation({5, 0, 0}))});
  scene.instances.push_back({0, Affine(test::translation({-5, 0, 0}))});
  return scene;
}

ErrorKind open_kind(std::span<const std::byte> bytes) {
  try {
    (void)BakedFile::from_bytes(bytes);
  } catch (const Error& error) {
    return error.kind();
  }
  ADD_FAILURE() << "the file was accepted";
  return ErrorKind::kCancelled;
}

baked::PagedHeader header_of(const Bytes& bytes) {
  baked::PagedHeader header;
  std::memcpy(&header, bytes.data(), sizeof header);
  return header;
}

std::vector<baked::PageRecord> pages_of(const Bytes& bytes) {
  std::vector<baked::PageRecord> pages(header_of(bytes).page_count);
  if (!pages.empty())
    std::memcpy(pages.data(), bytes.data() + sizeof(baked::PagedHeader), pages.size() * sizeof pages[0]);
  return pages;
}

class PageCodecs : public testing::TestWithParam<PageCodec> {};
INSTANTIATE_TEST_SUITE_P(All, PageCodecs, testing::Values(PageCodec::kFast, PageCodec::kSmall),
                         [](const auto& codec) { return std::string(name_of(codec.param)); });

TEST_P(PageCodecs, EveryFileComesBackBitForBit) {
  for (const Scene& scene :
       {mixed_scene(4), mixed_scene(60), test::scene_of(test::grid_mesh(1)), test::scene_of(test::soup_mesh(500, 2)),
        test::scene_of(test::sphere_mesh(40), test::scaling(DVec3(1e-30))),
        test::scene_of(test::sphere_mesh(20), test::translation(DVec3(1e7))),
        test::scene_of(test::sphere_mesh(20), test::scaling(DVec3(1, 0, 1))), Scene{}}) {
    const Bytes plain = test::bake(scene).bytes, disk = test::bake(scene, config_of(GetParam())).bytes;
    DiskForm form;
    EXPECT_TRUE(expand_paged_file(disk, "memory", form) == plain);
    EXPECT_EQ(form.file_bytes, disk.size());
    const auto pages = pages_of(disk);
    EXPECT_EQ(pages.empty(), scene.shapes.empty() && scene.instances.empty());
    for (const baked::PageRecord& page : pages)
      EXPECT_NE(page.form, static_cast<uint32_t>(PageCodec::kNone)) << "a page was stored, not coded";
  }
}

TEST_P(PageCodecs, EveryNormalEncodingComesBack) {
  for (size_t i = 0; i < kNormalFormats.size(); ++i) {
    const auto encoding = static_cast<NormalEncoding>(i);
    const Scene scene = mixed_scene(30);
    const Bytes disk = test::bake(scene, config_of(GetParam(), encoding)).bytes;
    DiskForm form;
    EXPECT_TRUE(expand_paged_file(disk, "memory", form) ==
                test::bake(scene, config_of(PageCodec::kNone, encoding)).bytes)
        << kNormalFormats[i].name;
    for (const baked::PageRecord& page : pages_of(disk)) EXPECT_NE(page.form, 0u) << kNormalFormats[i].name;
  }
}

TEST_P(PageCodecs, FilesOfManyPagesAreSmallAndTheSameForAnyThreadCount) {
  const Scene scene = mixed_scene(150);
  const BakedScene baked = test::bake(scene, config_of(GetParam()));
  EXPECT_GT(pages_of(baked.bytes).size(), 5u);
  EXPECT_EQ(baked.report.file.disk.codec, GetParam());
  EXPECT_EQ(baked.report.file.disk.file_bytes, baked.bytes.size());
  uint64_t streams = baked.report.file.disk.table_bytes + baked.report.file.disk.node_bytes;
  for (const uint64_t bytes : baked.report.file.disk.stream_bytes) streams += bytes;
  EXPECT_EQ(streams, baked.bytes.size());
  EXPECT_LT(baked.bytes.size(), baked.report.file.bytes.total / 2);
  (void)BakedFile::from_bytes(baked.bytes);
  if (test::sanitized()) return; // equal bytes for any number of threads are compared in release builds
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_TRUE(test::bake(scene, config_of(GetParam())).bytes == baked.bytes);
}

TEST_P(PageCodecs, EqualBlocksComeBack) {
  BakeConfig config;
  config.choose_codec(GetParam());
  const Bytes disk = test::bake(mixed_scene(60), config).bytes;
  for (const baked::PageRecord& page : pages_of(disk)) EXPECT_NE(page.form, static_cast<uint32_t>(PageCodec::kNone));
  config.codec = PageCodec::kNone;
  DiskForm form;
  EXPECT_TRUE(expand_paged_file(disk, "memory", form) == test::bake(mixed_scene(60), config).bytes);
}

TEST(SmallPages, PagesAreNeverLargerThanThoseOfCodecFast) {
  Mesh mesh = test::grid_mesh(64, 0.1f);
  for (uint32_t j = 0; j < 64; ++j)
    for (uint32_t i = 0; i < 64; ++i) { // alternating diagonals
      const uint32_t q = 64 * j + i, a = 65 * j + i, b = a + 1, c = b + 65, d = a + 65;
      mesh.triangles[2 * q] = (i + j) % 2 == 0 ? Triangle(a, b, c) : Triangle(a, b, d);
      mesh.triangles[2 * q + 1] = (i + j) % 2 == 0 ? Triangle(a, c, d) : Triangle(b, c, d);
    }
  for (const Mesh& one : {mesh, test::grid_mesh(64, 0.1f), test::soup_mesh(500, 2)}) {
    const BakedFile file = BakedFile::from_bytes(test::bake(test::scene_of(one)).bytes);
    EXPECT_LE(encode_paged_file(file, PageCodec::kSmall).size(), encode_paged_file(file, PageCodec::kFast).size());
  }
  BakeConfig config;
  config.choose_codec(PageCodec::kSmall);
  const Bytes disk = test::bake(test::scene_of(mesh), config).bytes;
  for (const baked::PageRecord& page : pages_of(disk)) EXPECT_EQ(page.form, static_cast<uint32_t>(PageCodec::kFast));
  DiskForm form;
  const Bytes plain = expand_paged_file(disk, "memory", form);
  config.codec = PageCodec::kNone;
  EXPECT_TRUE(plain == test::bake(test::scene_of(mesh), config).bytes);
}

TEST(SmallPages, RepeatedStripsTakeFewBytes) {
  BakeConfig config;
  config.choose_codec(PageCodec::kSmall);
  const BakedScene baked = test::bake(test::scene_of(test::grid_mesh(128, 0.1f, true)), config);
  for (const baked::PageRecord& page : pages_of(baked.bytes))
    EXPECT_EQ(page.form, static_cast<uint32_t>(PageCodec::kSmall));
  const auto topology = baked.report.file.disk.stream_bytes[static_cast<size_t>(PageStream::kTopology)];
  EXPECT_LT(8 * topology, 2u * 128 * 128); // less than one bit per triangle
}

TEST_P(PageCodecs, WhatEncodersDoNotWriteIsStored) {
  Bytes plain = test::bake(test::scene_of(test::soup_mesh(300, 5))).bytes;
  { // set the last padding bit behind the first cluster's streams, which is never read
    const BakedFile file = BakedFile::from_bytes(plain);
    const ClusterView view = file.cluster(0, 0);
    const uint64_t bits = view.stream_bits().total();
    ASSERT_NE(bits % 32, 0u) << "no padding";
    const auto begin = static_cast<size_t>(view.bits() - reinterpret_cast<const uint8_t*>(file.bytes().data()));
    plain[begin + static_cast<size_t>(bits / 32 * 4 + 3)] |= std::byte{0x80};
  }
  test::rehash<baked::FileHeader>(plain);

  const Bytes disk = encode_paged_file(BakedFile::from_bytes(plain), GetParam());
  EXPECT_EQ(pages_of(disk).at(0).form, static_cast<uint32_t>(PageCodec::kNone));
  DiskForm form;
  EXPECT_TRUE(expand_paged_file(disk, "memory", form) == plain);
}

TEST_P(PageCodecs, EveryTruncatedPrefixIsRefused) {
  const Bytes bytes = test::bake(mixed_scene(6), config_of(GetParam())).bytes;
  for (size_t size = 0; size < bytes.size(); ++size)
    ASSERT_EQ(open_kind(std::span(bytes).first(size)), ErrorKind::kInput) << size;
  Bytes longer = bytes;
  longer.resize(bytes.size() + 1);
  EXPECT_EQ(open_kind(longer), ErrorKind::kInput);
  baked::PagedHeader header = header_of(longer); // counts the surplus byte, which is in no page
  header.file_bytes = longer.size();
  std::memcpy(longer.data(), &header, sizeof header);
  test::rehash_pages(longer);
  EXPECT_EQ(open_kind(longer), ErrorKind::kInput);
}

TEST_P(PageCodecs, EverySingleBitFlipIsRefused) {
  Bytes bytes = test::bake(mixed_scene(6), config_of(GetParam())).bytes;
  for (size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    const auto flip = static_cast<std::byte>(1u << (bit % 8));
    bytes[bit / 8] ^= flip;
    const bool in_version = bit / 8 >= 8 && bit / 8 < 12;
    ASSERT_EQ(open_kind(bytes), in_version ? ErrorKind::kUnsupported : ErrorKind::kInput) << bit;
    bytes[bit / 8] ^= flip;
  }
}

TEST_P(PageCodecs, DamageWithRightHashesIsRefusedOrHarmless) {
  const Scene scene = mixed_scene(12);
  const Bytes disk = test::bake(scene, config_of(GetParam())).bytes;
  DiskForm form;
  const Bytes plain = expand_paged_file(disk, "memory", form);
  test::Random random(21);
  uint32_t refused = 0;
  for (int round = 0; round < test::fewer(20000); ++round) {
    Bytes bytes = disk;
    const uint32_t changes = 1 + random.bits() % 3;
    for (uint32_t i = 0; i < changes; ++i) {
      const size_t at = 16 + random.bits() % (bytes.size() - 16);
      constexpr std::array<uint8_t, 6> kValues = {0, 1, 0x7f, 0x80, 0xff, 0xfe};
      bytes[at] = static_cast<std::byte>(random.bits() % 2 ? kValues[random.bits() % 6] : random.bits() & 0xffu);
    }
    test::rehash_pages(bytes);
    try {
      // Damage that decoding does not detect fails the content hash of the resident file. Otherwise the data must be
      // equal.
      const BakedFile file = BakedFile::from_bytes(bytes);
      ASSERT_EQ(file.file_bytes(), plain.size());
    } catch (const Error& error) {
      ASSERT_EQ(error.kind(), ErrorKind::kInput) << error.what();
      ++refused;
    }
  }
  EXPECT_GT(refused, test::fewer(15000u)); // the rest changes nothing, or only the stream sizes, which are not used
}

TEST_P(PageCodecs, HugeClaimsAreRefusedBeforeMemoryIsTaken) {
  const Bytes disk = test::bake(mixed_scene(6), config_of(GetParam())).bytes;
  const auto refused = [&](auto change) {
    Bytes bytes = disk;
    baked::PagedHeader header = header_of(bytes);
    std::vector<baked::PageRecord> pages = pages_of(bytes);
    change(header, pages[0]);
    std::memcpy(bytes.data(), &header, sizeof header);
    std::memcpy(bytes.data() + sizeof header, pages.data(), pages.size() * sizeof pages[0]);
    test::rehash_pages(bytes);
    return open_kind(bytes) == ErrorKind::kInput;
  };
  constexpr uint64_t kHuge = uint64_t{1} << 62;
  EXPECT_TRUE(refused([](auto& header, auto&) { header.resident_bytes = kHuge; }));
  EXPECT_TRUE(refused([](auto& header, auto&) { header.head_bytes = kHuge, header.resident_bytes += kHuge; }));
  EXPECT_TRUE(refused([](auto& header, auto&) { header.tail_bytes = kHuge, header.resident_bytes += kHuge; }));
  EXPECT_TRUE(refused([](auto& header, auto&) { header.page_count = ~0u; }));
  EXPECT_TRUE(refused([](auto& header, auto&) { header.head_disk_bytes = ~uint64_t{0}; }));
  EXPECT_TRUE(refused([](auto&, auto& page) { page.payload_bytes = ~3u; }));
  EXPECT_TRUE(refused([](auto&, auto& page) { page.cluster_count = ~0u; }));
  EXPECT_TRUE(refused([](auto&, auto& page) { page.disk_bytes = ~0u; }));
  EXPECT_TRUE(refused([](auto&, auto& page) { page.form = 3; }));
}

TEST(PageCodec, NamesComeBack) {
  for (const PageCodec codec : {PageCodec::kNone, PageCodec::kFast, PageCodec::kSmall})
    EXPECT_EQ(find_page_codec(name_of(codec)), codec);
  EXPECT_EQ(find_page_codec("zstd"), std::nullopt);
}

} // namespace
} // namespace packtrace
