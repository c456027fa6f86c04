#include "compress/exchange/vertex16/vertex16_export.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "compress/exchange/vertex16/vertex16_fields.h"
#include "compress/exchange/vertex16/vertex16_file.h"
#include "compress/exchange/vertex16/vertex16_geometry.h"
#include "tests/compress/test_scenes.h"

namespace packtrace {
namespace {

using vertex16::DrawRecord;
using vertex16::Sections;

Vertex16Export export_of(const BakedFile& file) {
  Progress progress;
  return export_vertex16(file, progress);
}

using Corner = std::tuple<float, float, float, float, float, float, float, float>;
using Face = std::array<Corner, 3>;

/// All triangles of a geometry with their material slots, decoded from the baked file.
std::multiset<std::pair<uint32_t, Face>> faces_of(const BakedFile& file, uint32_t geometry) {
  std::multiset<std::pair<uint32_t, Face>> faces;
  for (uint32_t c = 0; c < file.clusters(geometry).size(); ++c) {
    const ClusterView view = file.cluster(geometry, c);
    for (uint32_t i = 0; i < view.triangle_count(); ++i) {
      std::array<Corner, 3> corners;
      for (int corner = 0; corner < 3; ++corner) {
        const uint32_t v = view.triangle(i)[corner];
        const Vec3 p = view.position(v), n = view.has_normals() ? view.normal(v) : Vec3(0.0f);
        const Vec2 uv = view.has_uvs() ? view.uv(v) : Vec2(0.0f);
        corners[static_cast<size_t>(corner)] = {p.x, p.y, p.z, n.x, n.y, n.z, uv.x, uv.y};
      }
      faces.insert({view.material_slot(), test::face_of(corners)});
    }
  }
  return faces;
}

std::multiset<std::pair<uint32_t, Face>> faces_of(const Sections& s, uint32_t geometry) {
  std::multiset<std::pair<uint32_t, Face>> faces;
  for (const DrawRecord& draw : s.draws) {
    if (draw.geometry != geometry) continue;
    for (uint32_t i = 0; i < draw.index_count; i += 3) {
      std::array<Corner, 3> corners;
      for (uint32_t corner = 0; corner < 3; ++corner) {
        const glm::uvec4 v = s.vertices[s.vertex(draw, i + corner)];
        const Vec3 p = vertex16::vertex16_position(v, s.geometries[geometry].frame);
        const Vec3 n = vertex16::vertex16_decode_normal(v);
        const Vec2 uv = vertex16::vertex16_uv(v, s.geometries[geometry].frame);
        corners[corner] = {p.x, p.y, p.z, n.x, n.y, n.z, uv.x, uv.y};
      }
      faces.insert({draw.material_slot, test::face_of(corners)});
    }
  }
  return faces;
}

TEST(Vertex16Export, HoldsTheSameTrianglesBitForBit) {
  BakeConfig config;
  config.normals = NormalEncoding::kAxis24;
  const BakedFile file = BakedFile::from_bytes(test::bake(test::mixed_scene(), config).bytes);
  const Vertex16Export exported = export_of(file);
  const Sections s = vertex16::validate(exported.bytes, "test");
  ASSERT_EQ(s.geometries.size(), file.geometries().size());
  for (uint32_t g = 0; g < s.geometries.size(); ++g) {
    EXPECT_EQ(faces_of(s, g), faces_of(file, g)) << g;
    EXPECT_EQ(s.geometries[g].bounds_lo, file.geometries()[g].bounds_lo);
    EXPECT_EQ(s.geometries[g].bounds_hi, file.geometries()[g].bounds_hi);
  }
  EXPECT_EQ(exported.report.max_position_error, 0.0);
  EXPECT_EQ(exported.report.max_normal_error_degrees, 0.0);
  EXPECT_EQ(exported.report.max_uv_error, 0.0);
  EXPECT_EQ(exported.report.triangles, exported.report.index_bytes / 6); // all indices have 16 bits
  EXPECT_EQ(exported.report.vertex_bytes, 16 * exported.report.vertices);
  ASSERT_EQ(s.instances.size(), file.instances().size());
  for (uint32_t i = 0; i < s.instances.size(); ++i)
    for (size_t row = 0; row < 3; ++row)
      for (size_t column = 0; column < 4; ++column)
        EXPECT_EQ(s.instances[i].world_from_object[4 * row + column],
                  file.instances()[i].world_from_object[3 * column + row]);
  EXPECT_EQ(s.materials.size(), 2u);
  EXPECT_EQ(s.masks.size(), 1u);
  EXPECT_EQ(s.mask_words.size(), 64u);
}

TEST(Vertex16Export, LeavesOutLevelsOfDetail) {
  BakeConfig config;
  config.lod = LodUse::kAll;
  const BakedFile without = BakedFile::from_bytes(test::bake(test::mixed_scene()).bytes);
  const BakedFile with = BakedFile::from_bytes(test::bake(test::mixed_scene(), config).bytes);
  ASSERT_GT(with.geometries().size(), without.geometries().size());
  EXPECT_EQ(export_of(with).bytes, export_of(without).bytes);
}

TEST(Vertex16Export, VerticesAreDistinctAndDrawsMerged) {
  const BakedFile file = BakedFile::from_bytes(test::bake(test::mixed_scene()).bytes);
  const Vertex16Export exported = export_of(file);
  const Sections s = vertex16::validate(exported.bytes, "test");
  ASSERT_EQ(s.geometries.size(), file.base_geometry_count());
  ASSERT_FALSE(s.draws.empty());
  for (const vertex16::GeometryRecord& g : s.geometries) {
    std::set<std::array<uint32_t, 4>> distinct;
    for (uint32_t v = 0; v < g.vertex_count; ++v) {
      const glm::uvec4 bits = s.vertices[g.first_vertex + v];
      EXPECT_TRUE(distinct.insert({bits.x, bits.y, bits.z, bits.w}).second);
    }
    std::set<std::pair<uint32_t, uint32_t>> draws;
    for (uint32_t d = 0; d < g.draw_count; ++d) {
      const DrawRecord& draw = s.draws[g.first_draw + d];
      EXPECT_TRUE(draws.insert({draw.material_slot, draw.flags}).second);
      for (uint32_t i = 0; i < draw.index_count; ++i)
        EXPECT_EQ(vertex16::vertex16_is_flat(s.vertices[s.vertex(draw, i)]), (draw.flags & vertex16::kDrawFlat) != 0);
    }
  }
}

TEST(Vertex16Export, OtherNormalsAreReencodedWithinTheCodesError) {
  for (const NormalEncoding encoding : {NormalEncoding::kOct32, NormalEncoding::kZsign32, NormalEncoding::kAxis16}) {
    BakeConfig config;
    config.normals = encoding;
    const Vertex16Export exported = export_of(BakedFile::from_bytes(test::bake(test::mixed_scene(), config).bytes));
    EXPECT_GT(exported.report.max_normal_error_degrees, 0.005);
    EXPECT_LE(exported.report.max_normal_error_degrees, format_of(NormalEncoding::kAxis24).max_error_degrees);
  }
}

TEST(Vertex16Export, WideWorldsLoseTheSameBitsEverywhereAndStayClosed) {
  // Two meshes that share an edge. Only a third, large mesh exceeds the range of a field, but all meshes must use the
  // same coarser lattice.
  Scene scene = test::scene_of(test::grid_mesh(4));
  test::add_shape(scene, test::grid_mesh(4), test::translation({1, 0, 0}));
  Mesh far = test::soup_mesh(3, 1);
  for (Vec3& p : far.positions) p *= 1000.0f;
  test::add_shape(scene, far);
  BakeConfig config;
  config.precision_kind = PrecisionKind::kAbsolute;
  config.precision = 1e-4;
  const BakedFile file = BakedFile::from_bytes(test::bake(scene, config).bytes);
  const Vertex16Export exported = export_of(file);
  EXPECT_EQ(exported.report.coarser_geometries, 3u);
  const Sections s = vertex16::validate(exported.bytes, "test");
  const double step = double{s.geometries[0].frame.step};
  EXPECT_EQ(s.geometries[0].frame.step, s.geometries[2].frame.step);
  EXPECT_GT(exported.report.max_position_error, 0.0);
  EXPECT_LE(exported.report.max_position_error, step / 2 + 1000.0 * 0x1p-23);
  const auto edge = [&](uint32_t g, float x) {
    std::set<std::array<float, 3>> points;
    for (uint32_t v = 0; v < s.geometries[g].vertex_count; ++v) {
      const Vec3 p = vertex16::vertex16_position(s.vertices[s.geometries[g].first_vertex + v], s.geometries[g].frame);
      if (std::abs(p.x - x) < 0.01f) points.insert({p.x, p.y, p.z});
    }
    return points;
  };
  EXPECT_EQ(edge(0, 1.0f).size(), 5u);
  EXPECT_EQ(edge(0, 1.0f), edge(1, 1.0f));
}

TEST(Vertex16Export, ShiftIsTheLeastThatFits) {
  constexpr int64_t kCodes = int64_t{1} << 21;
  EXPECT_EQ(vertex16_shift({{0, 0, 0}, {kCodes - 1, 5, 5}}), 0u);
  EXPECT_EQ(vertex16_shift({{0, 0, 0}, {kCodes, 5, 5}}), 1u);
  EXPECT_EQ(vertex16_shift({{0, -kCodes, 0}, {0, kCodes - 1, 5}}), 2u); // one more than half the range rounds up
  EXPECT_EQ(vertex16_shift({{int64_t{1} << 31, 0, 0}, {int64_t{1} << 31, 0, 0}}), 1u);
  EXPECT_EQ(coarser_lattice(-3, 1), -1);
  EXPECT_EQ(coarser_lattice(3, 1), 2);
  EXPECT_EQ(coarser_lattice(-8, 3), -1);
}

TEST(Vertex16Export, ChartsAreMovedToTheFirstTileWhereTexturesRepeat) {
  Scene scene = test::mixed_scene();
  Mesh& leaf = scene.meshes[1];
  for (Vec2& uv : leaf.uvs) uv += Vec2(500.0f, -300.0f);
  scene.masks[0].uv_scale = {2.0f, 1.0f};
  const auto uv_of_first = [&] {
    const BakedFile file = BakedFile::from_bytes(test::bake(scene).bytes);
    const Vertex16Export exported = export_of(file);
    const Sections s = vertex16::validate(exported.bytes, "test");
    for (const DrawRecord& draw : s.draws)
      if ((draw.flags & vertex16::kDrawUvs) != 0)
        return vertex16::vertex16_uv(s.vertices[s.vertex(draw, 0)], s.geometries[draw.geometry].frame);
    return Vec2(-1.0f);
  };
  const Vec2 moved = uv_of_first();
  EXPECT_TRUE(moved.x >= 0.0f && moved.x <= 1.0f && moved.y >= 0.0f && moved.y <= 1.0f);
  scene.masks[0].wrap = WrapMode::kClamp;
  EXPECT_GE(uv_of_first().x, 500.0f);
  scene.masks[0].wrap = WrapMode::kRepeat;
  scene.masks[0].uv_scale = {1.5f, 1.0f}; // one tile of uv is one and a half textures
  EXPECT_GE(uv_of_first().x, 500.0f);
}

TEST(Vertex16Export, TangentsPointAlongUWhereANormalMapNeedsThem) {
  Scene scene = test::scene_of(test::grid_mesh(20, 0.2f, true));
  Mesh mirrored = test::grid_mesh(20, 0.2f, true); // u is reversed, v unchanged
  for (Vec2& uv : mirrored.uvs) uv.x = 1.0f - uv.x;
  test::add_shape(scene, mirrored, test::translation({2, 0, 0}));
  scene.materials[0].flags |= kNormalMap;
  BakeConfig config;
  config.purpose = baked::kShading; // keeps texture coordinates
  const BakedFile file = BakedFile::from_bytes(test::bake(scene, config).bytes);
  const Vertex16Export exported = export_of(file);
  EXPECT_GT(exported.report.max_tangent_error_degrees, 0.3);
  EXPECT_LE(exported.report.max_tangent_error_degrees, 0.9);
  const Sections s = vertex16::validate(exported.bytes, "test");
  for (uint32_t g = 0; g < 2; ++g) {
    uint32_t vertices = 0;
    for (const DrawRecord& draw : s.draws)
      if (draw.geometry == g && (draw.flags & vertex16::kDrawTangents) != 0)
        for (uint32_t i = 0; i < draw.index_count; ++i, ++vertices) {
          const glm::uvec4 v = s.vertices[s.vertex(draw, i)];
          const glm::vec4 t = vertex16::vertex16_tangent(v, vertex16::vertex16_decode_normal(v));
          EXPECT_GT(g == 0 ? t.x : -t.x, 0.4f); // steep in places, but never perpendicular
          EXPECT_LT(std::abs(t.y), 0.6f);
          EXPECT_EQ(t.w, g == 0 ? 1.0f : -1.0f);
        }
    EXPECT_GT(vertices, 1000u);
  }
  EXPECT_EQ(export_of(BakedFile::from_bytes(test::bake(scene).bytes)).report.max_tangent_error_degrees, 0.0);
}

/// Two instances of one geometry; only the second has a normal map and a clamped texture.
TEST(Vertex16Export, SlotsTakeTheMaterialsOfAllInstances) {
  Scene scene = test::scene_of(test::grid_mesh(20, 0.2f, true));
  for (Vec2& uv : scene.meshes[0].uvs) uv += Vec2(40.0f, 0.0f);
  scene.textures.push_back({"t", 2, 2, WrapMode::kClamp, Vec2(1), Vec2(0), std::vector<uint8_t>(12, 9)});
  scene.textures.push_back({"u", 2, 2, WrapMode::kRepeat, Vec2(1), Vec2(0), std::vector<uint8_t>(12, 9)});
  scene.materials[0] = {"repeats", kAlbedoTexture, Vec3(0.5f), kNoMask, kNoMask, 1};
  scene.materials.push_back({"ends", kAlbedoTexture | kNormalMap, Vec3(0.5f), kNoMask, kNoMask, 0});
  scene.shapes.emplace_back(0, 1, false, test::translation({5, 0, 0}));
  BakeConfig config;
  config.purpose = baked::kShading;
  config.textures = true;
  const auto check = [&](uint32_t flags, float least_u, float most_u) {
    const BakedFile file = BakedFile::from_bytes(test::bake(scene, config).bytes);
    const Vertex16Export exported = export_of(file);
    const Sections s = vertex16::validate(exported.bytes, "test");
    ASSERT_EQ(s.geometries[s.instances[1].geometry].slot_count, 1u);
    ASSERT_EQ(s.instances[0].geometry, s.instances[1].geometry);
    for (uint32_t i = 0; i < 2; ++i) EXPECT_EQ(s.material_slots[s.instances[i].first_slot], i);
    for (const DrawRecord& draw : s.draws) {
      EXPECT_EQ(draw.material_slot, 0u);
      EXPECT_EQ(draw.flags, flags);
      const Vec2 uv = vertex16::vertex16_uv(s.vertices[s.vertex(draw, 0)], s.geometries[draw.geometry].frame);
      EXPECT_TRUE(uv.x >= least_u && uv.x <= most_u) << uv.x;
    }
  };
  check(vertex16::kDrawUvs | vertex16::kDrawTangents, 40.0f, 41.0f);
  scene.materials[1].flags = kAlbedoTexture;
  check(vertex16::kDrawUvs, 40.0f, 41.0f);
  scene.textures[0].wrap = WrapMode::kRepeat;
  check(vertex16::kDrawUvs, 0.0f, 1.0f);
}

TEST(Vertex16Export, BytesDoNotDependOnThreads) {
  const BakedFile file = BakedFile::from_bytes(test::bake(test::mixed_scene()).bytes);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const std::vector<std::byte> alone = export_of(file).bytes;
  const tbb::global_control many(tbb::global_control::max_allowed_parallelism, 8);
  EXPECT_EQ(export_of(file).bytes, alone);
}

TEST(Vertex16Export, ManyVerticesGetIndicesOf32Bits) {
  const BakedFile file = BakedFile::from_bytes(test::bake(test::scene_of(test::soup_mesh(22000, 2))).bytes);
  const Vertex16Export exported = export_of(file);
  const Sections s = vertex16::validate(exported.bytes, "test");
  EXPECT_EQ(s.geometries[0].index_bits, 32u);
  EXPECT_EQ(s.indices32.size(), 66000u);
  EXPECT_EQ(faces_of(s, 0), faces_of(file, 0));
}

TEST(Vertex16Export, ASceneWithoutTrianglesIsAFileWithoutVertices) {
  const Vertex16Export exported = export_of(BakedFile::from_bytes(test::bake(Scene{}).bytes));
  EXPECT_TRUE(vertex16::validate(exported.bytes, "test").vertices.empty());
}

} // namespace
} // namespace packtrace
