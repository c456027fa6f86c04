#include "compress/bake/plan/requirements.h"

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

using test::bake;

constexpr uint32_t kPlain = 0, kLeaf = 1, kPainted = 2, kBumpy = 3, kHidden = 4;

/// One material of each kind, and a bumpy mesh with normals and texture coordinates.
Scene materials_scene() {
  Scene scene;
  scene.materials.resize(5);
  scene.masks.push_back({64, 64, WrapMode::kRepeat, Vec2(1), Vec2(0), std::vector<uint32_t>(128, 0x0f0f0f0fu)});
  scene.materials[kLeaf].flags = kAlphaMask;
  scene.materials[kLeaf].alpha_mask = 0;
  scene.materials[kPainted].flags = kAlbedoTexture;
  scene.materials[kBumpy].flags = kNormalMap;
  scene.materials[kHidden].flags = kInvisible;
  return scene;
}

Mesh bumpy_mesh() { return test::grid_mesh(12, 0.2f, true); }

constexpr uint32_t kTriangles = 288, kVertices = 169;

Scene scene_with(uint32_t material, Mesh mesh = bumpy_mesh()) {
  Scene scene = materials_scene();
  test::add_shape(scene, std::move(mesh), DAffine(1.0), material);
  return scene;
}

BakeConfig config(baked::Purpose purpose, bool keep_normals = false, bool keep_uvs = false) {
  BakeConfig config;
  config.purpose = purpose;
  config.keep_normals = keep_normals;
  config.keep_uvs = keep_uvs;
  return config;
}

/// Needs of the first part of the first geometry.
PartNeeds needs(const Scene& scene, const BakeConfig& config) {
  const ScenePlan plan = plan_scene(scene);
  return analyse_requirements(scene, plan, plan.geometries.front(), config).parts.front();
}

TEST(Requirements, TextureCoordinatesStayForWhatLooksThemUp) {
  const auto uvs = [](uint32_t material, baked::Purpose purpose) {
    return needs(scene_with(material), config(purpose)).uvs;
  };
  EXPECT_EQ(uvs(kPlain, baked::kAo), baked::kUnused);
  EXPECT_EQ(uvs(kPlain, baked::kShading), baked::kUnused);
  EXPECT_EQ(uvs(kLeaf, baked::kAo), baked::kForMask);
  EXPECT_EQ(uvs(kLeaf, baked::kShading), baked::kForMask);
  EXPECT_EQ(uvs(kPainted, baked::kAo), baked::kUnused);
  EXPECT_EQ(uvs(kPainted, baked::kShading), baked::kForTexture);
  EXPECT_EQ(uvs(kBumpy, baked::kAo), baked::kUnused);
  EXPECT_EQ(uvs(kBumpy, baked::kShading), baked::kForNormalMap);
  Mesh bare = bumpy_mesh();
  bare.uvs.clear();
  EXPECT_EQ(needs(scene_with(kPainted, bare), config(baked::kShading)).uvs, baked::kAbsent);
  EXPECT_EQ(needs(scene_with(kPlain), config(baked::kAo, false, true)).uvs, baked::kOnRequest);
}

TEST(Requirements, WithTexturesStoredOnlyThoseLookTextureCoordinatesUp) {
  BakeConfig with_textures = config(baked::kShading);
  with_textures.textures = true;
  Scene scene = scene_with(kPainted); // its texture cannot be stored
  EXPECT_EQ(needs(scene, with_textures).uvs, baked::kUnused);
  scene.textures.push_back({"t", 64, 256, WrapMode::kRepeat, Vec2(2, 1), Vec2(0), std::vector<uint8_t>(3 * 64 * 256)});
  scene.materials[kPainted].albedo_texture = 0;
  EXPECT_EQ(needs(scene, with_textures).uvs, baked::kForTexture);
  const ScenePlan plan = plan_scene(scene);
  const GeometryNeeds stored = analyse_requirements(scene, plan, plan.geometries.front(), with_textures);
  EXPECT_EQ(stored.texels_per_uv, (std::array<double, 2>{128.0, 256.0}));
  const GeometryNeeds elsewhere = analyse_requirements(scene, plan, plan.geometries.front(), config(baked::kShading));
  EXPECT_EQ(elsewhere.texels_per_uv[0], 0.0); // no stored texture uses them
  EXPECT_EQ(elsewhere.uv_exponent[0], stored.uv_exponent[0] - 5);
  EXPECT_EQ(elsewhere.uv_exponent[1], stored.uv_exponent[1] - 4);
  scene.materials[kPainted].albedo_texture = 1;
  EXPECT_THROW((void)analyse_requirements(scene, plan, plan.geometries.front(), with_textures), Error);
}

TEST(Requirements, NormalsStayWhereTheCameraSeesThem) {
  const auto normals = [](uint32_t material, const BakeConfig& c) { return needs(scene_with(material), c).normals; };
  EXPECT_EQ(normals(kPlain, config(baked::kAo)), baked::kForShading);
  EXPECT_EQ(normals(kHidden, config(baked::kAo)), baked::kUnused);
  EXPECT_EQ(normals(kHidden, config(baked::kAo, true)), baked::kOnRequest);
  EXPECT_EQ(needs(scene_with(kPlain, test::grid_mesh(3)), config(baked::kAo)).normals, baked::kAbsent);
  EXPECT_EQ(bake(scene_with(kHidden)).report.file.bytes.normals, 0u);
  EXPECT_GT(bake(scene_with(kPlain)).report.file.bytes.normals, 0u);
}

TEST(Requirements, TangentsOnlyForNormalMapsAndShading) {
  EXPECT_EQ(needs(scene_with(kPainted), config(baked::kShading)).tangents, baked::kAbsent);
  EXPECT_EQ(needs(scene_with(kBumpy), config(baked::kShading)).tangents, baked::kForNormalMap);
  EXPECT_EQ(needs(scene_with(kBumpy), config(baked::kAo)).tangents, baked::kUnused);
}

TEST(Requirements, SharedGeometryNeedsWhatAnyOfItsMaterialsNeeds) {
  Scene scene = scene_with(kPlain);
  scene.shapes.emplace_back(0, kPainted, false, test::translation({5, 0, 0}));
  ASSERT_EQ(plan_scene(scene).geometries.size(), 1u);
  EXPECT_EQ(needs(scene, config(baked::kAo)).uvs, baked::kUnused);
  EXPECT_EQ(needs(scene, config(baked::kShading)).uvs, baked::kForTexture);
}

TEST(Requirements, TheFinestOfSeveralMasksChoosesTheStep) {
  Scene scene = scene_with(kLeaf);
  const auto step = [](const Scene& s) {
    const ScenePlan plan = plan_scene(s);
    return analyse_requirements(s, plan, plan.geometries.front(), {}).uv_exponent;
  };
  const auto coarse = step(scene);
  scene.masks.push_back({512, 64, WrapMode::kRepeat, Vec2(1), Vec2(0), std::vector<uint32_t>(1024, 1u)});
  scene.materials.push_back({"finer", kShadowAlphaMask, Vec3(0.5f), kNoMask, 1});
  scene.shapes.emplace_back(0, 5, false, test::translation({5, 0, 0}));
  ASSERT_EQ(plan_scene(scene).geometries.size(), 1u);
  EXPECT_EQ(step(scene)[0], coarse[0] - 3);
  EXPECT_EQ(step(scene)[1], coarse[1]);
}

TEST(Requirements, DecisionsAreInTheFileWithCountsAndBytes) {
  Scene scene = scene_with(kPainted);
  test::add_shape(scene, test::grid_mesh(12, 0.0f, true), DAffine(1.0), kLeaf); // flat normals
  const BakedFile file = BakedFile::from_bytes(bake(scene, config(baked::kAo, false, false)).bytes);
  struct Row {
    uint32_t stream, reason, geometries;
    uint64_t triangles, source_bytes;
    bool operator==(const Row&) const = default;
  };
  std::vector<Row> rows;
  for (const baked::RequirementRecord& r : file.sections().requirements)
    rows.push_back({r.stream, r.reason, r.geometries, r.triangles, r.source_bytes});
  const std::vector<Row> expected = {{baked::kNormals, baked::kInferred, 1, kTriangles, kVertices * 12},
                                     {baked::kNormals, baked::kForShading, 1, kTriangles, kVertices * 12},
                                     {baked::kUvs, baked::kUnused, 1, kTriangles, kVertices * 8},
                                     {baked::kUvs, baked::kForMask, 1, kTriangles, kVertices * 8},
                                     {baked::kTangents, baked::kAbsent, 2, 2 * kTriangles, 0}};
  EXPECT_TRUE(rows == expected);
  EXPECT_EQ(file.sections().requirements[1].stored_bits, file.summary().stream_bits[2]);
  EXPECT_EQ(file.sections().requirements[3].stored_bits, file.summary().stream_bits[3]);
  EXPECT_EQ(file.geometries()[0].requirements, baked::requirement_bit(baked::kNormals, baked::kForShading) |
                                                   baked::requirement_bit(baked::kUvs, baked::kUnused) |
                                                   baked::requirement_bit(baked::kTangents, baked::kAbsent));
  EXPECT_EQ(file.summary().purpose, baked::kAo);

  const FileSummary summary = summarize(file);
  EXPECT_EQ(summary.materials, 5u);
  EXPECT_EQ(summary.materials_in_use, 2u);
  EXPECT_EQ(summary.material_flags, kAlphaMask | kAlbedoTexture);
  EXPECT_EQ(summary.max_slots, 1u);
  ASSERT_EQ(summary.by_geometry.size(), 2u);
  EXPECT_EQ(summary.by_geometry[0].normal_triangles, kTriangles);
  EXPECT_EQ(summary.by_geometry[0].uv_triangles, 0u);
  EXPECT_EQ(summary.by_geometry[1].normal_triangles, 0u);
  EXPECT_EQ(summary.by_geometry[1].uv_triangles, kTriangles);
}

/// Replaces the normals at the corners of every n-th triangle by its face normal; neighbours share these vertices.
Mesh with_flat_triangles(Mesh mesh, uint32_t n) {
  for (uint32_t i = 0; i < mesh.triangles.size(); i += n) {
    const Triangle& t = mesh.triangles[i];
    const Vec3 a = mesh.positions[t.x], b = mesh.positions[t.y], c = mesh.positions[t.z];
    for (int corner = 0; corner < 3; ++corner) mesh.normals[t[corner]] = glm::normalize(glm::cross(b - a, c - a));
  }
  return mesh;
}

TEST(Requirements, NormalsAreInferredWhereThatMakesTheFileSmaller) {
  // The step is so fine that the normals of decoded faces stay within the allowed error.
  const auto inferred = [](const Mesh& mesh) {
    BakeConfig by_need = config(baked::kAo), all = config(baked::kAo, true);
    by_need.precision = all.precision = 1e-5;
    const BakedScene baked = bake(scene_with(kPlain, mesh), by_need);
    EXPECT_LE(baked.bytes.size(), bake(scene_with(kPlain, mesh), all).bytes.size());
    const baked::RequirementRecord& first = baked.report.file.requirements.front();
    return first.reason == baked::kInferred ? first.triangles : 0;
  };
  const Mesh sphere = test::sphere_mesh(40);
  Mesh half_flat = sphere;
  const Mesh floor = test::grid_mesh(40, 0.0f, true);
  const auto first = static_cast<uint32_t>(half_flat.positions.size());
  half_flat.positions.insert(half_flat.positions.end(), floor.positions.begin(), floor.positions.end());
  half_flat.normals.insert(half_flat.normals.end(), floor.normals.begin(), floor.normals.end());
  for (const Triangle& t : floor.triangles) half_flat.triangles.push_back(t + first);
  EXPECT_EQ(inferred(half_flat), floor.triangles.size());
  EXPECT_EQ(inferred(with_flat_triangles(sphere, 60)), 0u); // scattered: separate clusters would take more bytes
  // Regions are judged separately: the floor is stored without normals, the sphere's isolated flat triangles with them.
  EXPECT_EQ(inferred(with_flat_triangles(half_flat, 60)), floor.triangles.size());
}

TEST(Requirements, WhatIsKeptOnRequestIsStoredEverywhere) {
  Scene scene = scene_with(kHidden);
  test::add_shape(scene, test::grid_mesh(12, 0.0f, true), DAffine(1.0), kPlain); // flat normals
  const BakedScene kept = bake(scene, config(baked::kShading, true, true));
  for (const GeometryUse& use : kept.report.file.by_geometry) {
    EXPECT_EQ(use.normal_triangles, kTriangles);
    EXPECT_EQ(use.uv_triangles, kTriangles);
  }
  EXPECT_EQ(kept.report.file.bake.purpose, baked::kShading | (0b11u << baked::kKeepShift));
  EXPECT_LE(kept.report.max_uv_error, 1.0 / (2 * 16 * kAssumedTexels));
  const test::Decoded all = test::decode(BakedFile::from_bytes(kept.bytes), 1);
  for (size_t i = 0; i < all.positions.size(); ++i) {
    EXPECT_NEAR(all.uvs[i].x, all.positions[i].x, 0.001);
    EXPECT_NEAR(all.normals[i].z, 1.0f, 1e-4f);
  }
  const BakedScene dropped = bake(scene, config(baked::kShading));
  EXPECT_EQ(dropped.report.file.bytes.normals + dropped.report.file.bytes.uvs, 0u);
}

} // namespace
} // namespace packtrace
