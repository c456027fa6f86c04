#include "compress/bake/bake_scene.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "tests/compress/bake_checks.h"

namespace packtrace {
namespace {

using test::bake, test::decode, test::Decoded, test::scene_of, test::masked_scene;

BakeConfig normals(std::optional<NormalEncoding> encoding, double error_degrees = 0.04) {
  BakeConfig config;
  config.normals = encoding;
  config.normal_error_degrees = error_degrees;
  return config;
}

TEST(BakeScene, NormalsComeBackWithinTheErrorOfEachEncoding) {
  const Mesh mesh = test::sphere_mesh(30);
  for (uint32_t i = 0; i < kNormalFormats.size(); ++i) {
    const auto encoding = static_cast<NormalEncoding>(i);
    const BakedScene baked = bake(scene_of(mesh), normals(encoding));
    const BakedFile file = BakedFile::from_bytes(baked.bytes);
    EXPECT_EQ(file.geometries()[0].normal_encoding, i);
    const double limit = kNormalFormats[i].max_error_degrees;
    const Decoded all = decode(file, 0);
    // On a unit sphere normals equal positions, here within 0.2 degrees.
    for (size_t v = 0; v < all.positions.size(); ++v)
      EXPECT_GT(glm::dot(all.normals[v], glm::normalize(all.positions[v])), std::cos((limit + 0.2) / 57.29));
    EXPECT_LE(baked.report.max_normal_error_degrees, limit) << kNormalFormats[i].name;
    if (encoding != NormalEncoding::kZsign32) { // its largest errors are rare
      EXPECT_GT(baked.report.max_normal_error_degrees, 0.3 * limit);
    }
    EXPECT_GT(baked.report.mean_normal_error_degrees, 0.0);
    EXPECT_EQ(file.geometries()[0].max_normal_error_degrees, static_cast<float>(baked.report.max_normal_error_degrees));
  }
}

TEST(BakeScene, AutoTakesTheFewestBitsThatKeepTheError) {
  const auto chosen = [](const Mesh& mesh, double error_degrees) {
    const BakedScene baked = bake(scene_of(mesh), normals(std::nullopt, error_degrees));
    EXPECT_LE(baked.report.max_normal_error_degrees, error_degrees);
    const std::vector<NormalUse>& uses = baked.report.file.normals;
    EXPECT_EQ(uses.size(), 1u);
    EXPECT_EQ(uses.front().geometries, 1u);
    EXPECT_EQ(uses.front().vertices, baked.report.file.vertices);
    return uses.front().encoding;
  };
  const Mesh sphere = test::sphere_mesh(30);
  EXPECT_EQ(chosen(sphere, 3.0), NormalEncoding::kAxis12);
  EXPECT_EQ(chosen(sphere, 1.0), NormalEncoding::kAxis16);
  EXPECT_EQ(chosen(sphere, 0.5), NormalEncoding::kOct20);
  EXPECT_EQ(chosen(sphere, 0.1), NormalEncoding::kAxis24);
  EXPECT_EQ(chosen(sphere, 0.04), NormalEncoding::kAxis24);
  EXPECT_EQ(chosen(sphere, 0.01), NormalEncoding::kAxis32);
  EXPECT_EQ(chosen(sphere, 0.0025), NormalEncoding::kAxis32);
  Mesh bent = test::grid_mesh(4); // all normals along an axis: every encoding is exact
  for (size_t i = 0; i < bent.positions.size(); ++i)
    bent.normals.push_back(i % 2 == 0 ? Vec3(1, 0, 0) : Vec3(0, -1, 0));
  EXPECT_EQ(chosen(bent, 0.0025), NormalEncoding::kAxis12);
}

TEST(BakeScene, CoarseGridsTakeCoarseNormals) {
  const auto chosen = [](double edge_fraction, std::optional<double> error_degrees) {
    BakeConfig config = test::precision(PrecisionKind::kEdgeFraction, edge_fraction);
    config.normal_error_degrees = error_degrees;
    const BakeReport report = bake(scene_of(test::sphere_mesh(30)), config).report;
    const NormalEncoding encoding = report.file.normals.at(0).encoding;
    const bool coarse = !error_degrees && edge_fraction > kDefaultEdgeFraction;
    const double merged = coarse ? format_of(encoding).max_error_degrees : 0.0;
    EXPECT_LE(report.max_normal_error_degrees, config.normal_limits(edge_fraction).error_degrees + merged);
    return encoding;
  };
  EXPECT_EQ(chosen(kDefaultEdgeFraction, std::nullopt), NormalEncoding::kAxis24);
  EXPECT_EQ(chosen(1.0 / 20.0, std::nullopt), NormalEncoding::kOct20);
  EXPECT_EQ(chosen(1.0 / 4.0, std::nullopt), NormalEncoding::kAxis16);
  EXPECT_EQ(chosen(1.0, std::nullopt), NormalEncoding::kAxis12);
  EXPECT_EQ(chosen(1.0 / 4.0, 0.04), NormalEncoding::kAxis24); // the requested error
}

TEST(BakeScene, VerticesThatFallTogetherShareANormalWithinTheLimit) {
  const auto vertices_per_triangle = [](std::optional<double> error_degrees) {
    BakeConfig config = test::precision(PrecisionKind::kPositionBits, 6);
    config.normal_error_degrees = error_degrees;
    const BakedScene baked = bake(scene_of(test::sphere_mesh(60)), config);
    EXPECT_GT(baked.report.max_normal_error_degrees, 0.0);
    EXPECT_GE(baked.report.max_normal_error_degrees, baked.report.mean_normal_error_degrees);
    if (error_degrees) {
      EXPECT_LE(baked.report.max_normal_error_degrees, *error_degrees);
    }
    return static_cast<double>(baked.report.file.vertices) / static_cast<double>(baked.report.file.triangles);
  };
  EXPECT_LT(vertices_per_triangle(std::nullopt), 0.9);
  EXPECT_GT(vertices_per_triangle(0.04), 1.1 * vertices_per_triangle(std::nullopt));
}

TEST(BakeScene, EveryPartOfAGeometryHasItsEncoding) {
  Scene scene;
  scene.materials.push_back({});
  Mesh bent = test::grid_mesh(4);
  bent.normals.assign(bent.positions.size(), Vec3(1, 0, 0));
  scene.meshes = {bent, test::sphere_mesh(12)};
  scene.objects.push_back({"two", {Shape{0, 0, false, DAffine(1.0)}, Shape{1, 0, false, DAffine(1.0)}}});
  scene.instances.push_back({0, Affine(1.0f)});
  const BakedFile file = BakedFile::from_bytes(bake(scene).bytes);
  EXPECT_EQ(file.geometries()[0].normal_encoding, static_cast<uint32_t>(NormalEncoding::kAxis24));
  const Decoded all = decode(file, 0);
  EXPECT_GE(std::count(all.normals.begin(), all.normals.end(), Vec3(1, 0, 0)), 25); // the sphere may have some as well
}

TEST(BakeScene, FlatNormalsAreDroppedAndSaidToBe) {
  const BakedScene baked = bake(scene_of(test::grid_mesh(20, 0.0f, true)));
  EXPECT_EQ(baked.report.file.bytes.normals, 0u);
  const std::vector<baked::RequirementRecord>& rows = baked.report.file.requirements;
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_EQ(rows[0].stream, baked::kNormals);
  EXPECT_EQ(rows[0].reason, baked::kInferred);
  EXPECT_EQ(rows[0].triangles, 800u);
  EXPECT_EQ(rows[0].source_bytes, 441u * 12);
  EXPECT_EQ(rows[1].stream, baked::kUvs);
  EXPECT_EQ(rows[1].reason, baked::kUnused);
  EXPECT_EQ(rows[1].source_bytes, 441u * 8);
  EXPECT_GT(bake(scene_of(test::grid_mesh(20, 0.2f, true))).report.file.bytes.normals, 0u);
}

TEST(BakeScene, SplitVerticesMerge) {
  Mesh mesh = test::grid_mesh(20, 0.1f, true);
  Mesh split; // every triangle has its own vertices
  split.name = "split";
  for (const Triangle& t : mesh.triangles) {
    const auto base = static_cast<uint32_t>(split.positions.size());
    for (int corner = 0; corner < 3; ++corner) {
      split.positions.push_back(mesh.positions[t[corner]]);
      split.normals.push_back(mesh.normals[t[corner]]);
    }
    split.triangles.emplace_back(base, base + 1, base + 2);
  }
  mesh.uvs.clear();
  const BakedScene a = bake(scene_of(mesh)), b = bake(scene_of(split));
  EXPECT_EQ(b.report.merged_vertices, 2400u - 441u);
  EXPECT_EQ(a.report.merged_vertices, 0u);
  EXPECT_EQ(a.report.file.vertices, b.report.file.vertices);
}

TEST(BakeScene, TextureCoordinatesAreKeptWhereAMaskNeedsThem) {
  Scene scene = masked_scene();
  const Mesh leaf = test::grid_mesh(12, 0.1f);
  test::add_shape(scene, leaf, DAffine(1.0), 1);
  const BakedScene baked = bake(scene);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  EXPECT_FALSE(file.cluster(0, 0).has_uvs());
  EXPECT_TRUE(file.cluster(1, 0).has_uvs());
  const Decoded all = decode(file, 1);
  for (size_t i = 0; i < all.positions.size(); ++i) { // the grid's uvs equal its x and y
    EXPECT_NEAR(all.uvs[i].x, all.positions[i].x, 1.0 / (2 * 16 * 64) + 0.001);
    EXPECT_NEAR(all.uvs[i].y, all.positions[i].y, 1.0 / (2 * 16 * 32) + 0.001);
  }
  EXPECT_GT(baked.report.max_uv_error, 0.0);
  EXPECT_LE(baked.report.max_uv_error, 1.0 / (2 * 16 * 32));
}

TEST(BakeScene, EncodingsOfTextureCoordinatesAreSelectable) {
  Scene scene = masked_scene();
  scene.shapes[0].material = 1;
  for (const UvEncoding encoding : {UvEncoding::kUnorm16, UvEncoding::kFp16}) {
    BakeConfig config;
    config.uvs = encoding;
    const BakedScene baked = bake(scene, config);
    const BakedFile file = BakedFile::from_bytes(baked.bytes);
    EXPECT_EQ(file.geometries()[0].uv_encoding, static_cast<uint32_t>(encoding));
    EXPECT_EQ(file.geometries()[0].uv_exponent, (std::array<int16_t, 2>{}));
    ASSERT_EQ(baked.report.file.uvs.size(), 1u);
    EXPECT_EQ(baked.report.file.uvs[0].encoding, encoding);
    const float bound = encoding == UvEncoding::kUnorm16 ? 0.5f / 65535.0f + 0x1p-24f : 0x1p-12f;
    EXPECT_GT(baked.report.max_uv_error, 0.0);
    EXPECT_LE(baked.report.max_uv_error, bound);
    EXPECT_LE(baked.report.max_uv_error_texels, baked.report.file.uvs[0].max_error_texels * (1 + 1e-6));
    const Decoded all = decode(file, 0);
    for (size_t i = 0; i < all.positions.size(); ++i) EXPECT_NEAR(all.uvs[i].x, all.positions[i].x, bound + 0.001);
    for (const PageCodec codec : {PageCodec::kFast, PageCodec::kSmall}) {
      config.codec = codec;
      const std::vector<std::byte> paged = bake(scene, config).bytes;
      const BakedFile small = BakedFile::from_bytes(paged);
      EXPECT_TRUE(std::equal(small.bytes().begin(), small.bytes().end(), baked.bytes.begin(), baked.bytes.end()));
    }
  }
}

TEST(BakeScene, HalfFloatCoordinatesAreRefusedOrWarnedOfWhereTheyBreak) {
  Scene scene = masked_scene();
  scene.shapes[0].material = 1;
  BakeConfig config;
  config.uvs = UvEncoding::kFp16;
  EXPECT_TRUE(bake(scene, config).report.warnings.empty()); // the mask has only 64 texels
  for (Vec2& uv : scene.meshes[0].uvs) uv *= 40.0f;
  const BakedScene rough = bake(scene, config);
  ASSERT_EQ(rough.report.warnings.size(), 1u);
  EXPECT_NE(rough.report.warnings[0].find("texels off"), std::string::npos);
  EXPECT_TRUE(bake(scene).report.warnings.empty());
  scene.meshes[0].uvs[3].x = 70000.0f;
  EXPECT_THROW(bake(scene, config), Error);
  config.uvs = UvEncoding::kUnorm16;
  EXPECT_THROW(bake(scene, config), Error);
  EXPECT_LE(bake(scene).report.max_uv_error_texels, 1.0 / 32.0);
}

TEST(BakeScene, TextureCoordinatesThatAreNotFiniteAreReplacedWithAWarning) {
  Scene scene = masked_scene();
  scene.shapes[0].material = 1;
  scene.meshes[0].uvs[5].x = std::nanf("");
  const BakedScene baked = bake(scene);
  ASSERT_EQ(baked.report.warnings.size(), 1u);
  EXPECT_NE(baked.report.warnings[0].find("1 texture coordinates are not finite"), std::string::npos);
}

TEST(BakeScene, NormalsSurviveFlatteningTransforms) {
  const BakedScene baked = bake(scene_of(test::sphere_mesh(10), test::scaling({1, 1, 0})));
  const std::vector<Vec3> normals = decode(BakedFile::from_bytes(baked.bytes), 0).normals;
  ASSERT_FALSE(normals.empty());
  for (const Vec3 n : normals)
    EXPECT_TRUE(n == Vec3(0) || std::abs(std::abs(n.z) - 1.0f) < 1e-5f); // dropped as flat, or along z
}

} // namespace
} // namespace packtrace
