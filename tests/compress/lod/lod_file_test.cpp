// Tests LOD levels read back from files.

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <set>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "compress/bake/lod/lod_encoder.h"
#include "compress/format/file/baked_file.h"
#include "compress/format/file/file_summary.h"
#include "pbrt_import/base/error.h"
#include "pbrt_import/base/file_bytes.h"
#include "tests/compress/lod/lod_meshes.h"
#include "tests/compress/lod/surface_distance.h"
#include "tests/compress/test_scenes.h"
#include "tests/sanitized.h"

namespace packtrace::test {
namespace {

/// Object-space positions of ClusterLod::positions, as decoded.
std::vector<DVec3> decoded_positions(const BakedFile& file, uint32_t geometry, const ClusterLod& lod) {
  const baked::GeometryRecord& g = file.geometries()[geometry];
  const double step = PositionGrid{g.step_mantissa, g.step_exponent}.step();
  std::vector<DVec3> points;
  for (const LatticePoint& p : lod.positions)
    points.emplace_back(from_lattice(p[0], step), from_lattice(p[1], step), from_lattice(p[2], step));
  return points;
}

std::vector<Triangle> triangles_of(const ClusterLod& lod, const std::vector<uint32_t>& clusters) {
  std::vector<Triangle> result;
  for (const uint32_t number : clusters)
    for (uint32_t i = 0; i < lod.clusters[number].range.triangle_count; ++i) {
      const Triangle& t = lod.triangles[lod.clusters[number].range.first_triangle + i];
      result.emplace_back(lod.vertices[t.x].position, lod.vertices[t.y].position, lod.vertices[t.z].position);
    }
  return result;
}

/// Clusters of a level and of terminal groups below it.
std::vector<uint32_t> discrete_level(const ClusterLod& lod, uint32_t level) {
  std::vector<uint32_t> clusters;
  for (uint32_t i = 0; i < lod.clusters.size(); ++i)
    if (lod.clusters[i].level == level || (lod.clusters[i].level < level && lod.groups[lod.clusters[i].group].terminal))
      clusters.push_back(i);
  return clusters;
}

/// Fails if a decoded level is further from decoded level 0 than its stated error, in either direction.
/// @param slack tolerance of the measurement, object units
void expect_honest_levels(const BakedFile& file, uint32_t geometry, double slack) {
  const ClusterLod lod = read_lod(file, geometry);
  std::vector<DVec3> points = decoded_positions(file, geometry, lod);
  const DVec3 origin = points.front(); // keeps float coordinates of the measurement small
  for (DVec3& p : points) p -= origin;
  const std::vector<Triangle> base = triangles_of(lod, discrete_level(lod, 0));
  const SurfaceDistance to_base(points, base);
  for (uint32_t level = 1; level < lod.level_count; ++level) {
    const std::vector<Triangle> coarse = triangles_of(lod, discrete_level(lod, level));
    const SurfaceDistance to_coarse(points, coarse);
    const double stated = file.lod(geometry).levels[level].error * (1.0 + 1e-6) + slack;
    EXPECT_LE(surface_distance(points, base, to_coarse, 4000).max, stated) << "level " << level;
    EXPECT_LE(surface_distance(points, coarse, to_base, 4000).max, stated) << "level " << level;
  }
}

double step_of(const baked::GeometryRecord& g) { return PositionGrid{g.step_mantissa, g.step_exponent}.step(); }

/// The bytes of a stress mesh with LOD levels, baked once per program.
std::vector<std::byte> baked_bytes(const NamedMesh& mesh) {
  static std::map<std::string, std::vector<std::byte>> baked; // by name
  const auto [at, is_new] = baked.try_emplace(mesh.name);
  if (is_new) at->second = bake(scene_of(mesh.make()), config_with_levels()).bytes;
  return at->second;
}

class LodFileOf : public testing::TestWithParam<NamedMesh> {
protected:
  const BakedFile file_ = BakedFile::from_bytes(baked_bytes(GetParam()));
  const LodView view_ = file_.lod(0);
};

TEST_P(LodFileOf, LevelsAreHonest) {
  if (sanitized()) GTEST_SKIP() << kOthersRunItsCode;
  ASSERT_FALSE(view_.levels.empty());
  expect_honest_levels(file_, 0, 1e-6 * step_of(file_.geometries()[0]));
}

TEST_P(LodFileOf, SpheresHoldThoseBelowInFloatToo) {
  for (size_t level = 0; level < view_.levels.size(); ++level) {
    const uint32_t geometry = view_.levels[level].geometry;
    const std::vector<LodLink> links = view_.links_of(level);
    for (uint32_t c = 0; c < links.size(); ++c) {
      const LodLink& link = links[c];
      const baked::LodGroupRecord& outer = view_.groups[link.group];
      const auto center = [](const baked::LodGroupRecord& g) { return Vec3(g.center[0], g.center[1], g.center[2]); };
      if (level > 0) {
        const baked::LodGroupRecord& inner = view_.groups[link.generating_group];
        EXPECT_LE(glm::length(center(outer) - center(inner)) + inner.radius, outer.radius);
        EXPECT_LE(inner.error, outer.error);
      }
      const ClusterView cluster = file_.cluster(geometry, c);
      for (uint32_t v = 0; v < cluster.vertex_count(); ++v)
        EXPECT_LE(glm::length(DVec3(cluster.position(v)) - DVec3(center(outer))), double{outer.radius});
    }
  }
}

TEST_P(LodFileOf, ClosedMeshesHaveClosedCuts) {
  if (!GetParam().closed) GTEST_SKIP() << "the mesh is open";
  const ClusterLod lod = read_lod(file_, 0);
  ASSERT_TRUE(boundary(lod, cut_clusters(lod, -0.0)).empty());
  const std::vector<double> all = thresholds(lod);
  const size_t step = std::max<size_t>(all.size() / 30, 1);
  for (size_t i = 0; i < all.size(); i += step) {
    const std::vector<uint32_t> cut = cut_clusters(lod, all[i]);
    EXPECT_FALSE(cut.empty());
    EXPECT_TRUE(boundary(lod, cut).empty()) << "at " << all[i];
  }
  for (uint32_t level = 0; level < lod.level_count; ++level)
    EXPECT_TRUE(boundary(lod, discrete_level(lod, level)).empty()) << "level " << level;
}

TEST_P(LodFileOf, SharedVerticesHaveTheSameBitsInAllClustersAndLevels) {
  std::map<LatticePoint, std::array<uint32_t, 3>> bits_of;
  size_t shared = 0;
  std::vector<Vec3> positions(256);
  for (const baked::LodLevelRecord& level : view_.levels)
    for (uint32_t c = 0; c < file_.clusters(level.geometry).size(); ++c) {
      const ClusterView cluster = file_.cluster(level.geometry, c);
      decode_positions(cluster, positions);
      for (uint32_t v = 0; v < cluster.vertex_count(); ++v) {
        const Vec3& p = positions[v];
        const std::array<uint32_t, 3> bits{std::bit_cast<uint32_t>(p.x), std::bit_cast<uint32_t>(p.y),
                                           std::bit_cast<uint32_t>(p.z)};
        const auto [at, added] = bits_of.emplace(cluster.lattice(v), bits);
        EXPECT_EQ(at->second, bits);
        shared += !added;
      }
    }
  EXPECT_GT(shared, 0u);
}

std::vector<NamedMesh> meshes_with_levels() {
  std::vector<NamedMesh> meshes = stress_meshes();
  std::erase_if(meshes, [](const NamedMesh& mesh) {
    return mesh.name == "one triangle" || mesh.name == "triangles without area";
  });
  return meshes;
}

INSTANTIATE_TEST_SUITE_P(StressMeshes, LodFileOf, testing::ValuesIn(meshes_with_levels()),
                         [](const auto& tested) { return identifier(tested.param.name); });

TEST(LodFile, MeshesThatCannotBeSimplifiedHaveNoLevels) {
  uint32_t count = 0;
  for (const NamedMesh& mesh : stress_meshes()) {
    if (mesh.name != "one triangle" && mesh.name != "triangles without area") continue;
    const BakedFile file = BakedFile::from_bytes(bake(scene_of(mesh.make()), config_with_levels()).bytes);
    EXPECT_TRUE(file.lod(0).levels.empty()) << mesh.name;
    EXPECT_EQ(file.base_geometry_count(), file.geometries().size()) << mesh.name;
    ++count;
  }
  EXPECT_EQ(count, 2u);
}

/// Rotated and far from the origin, decoded points leave the plane; errors must include this.
TEST(LodFile, ErrorsCountWhatFloatsLoseFarFromTheOrigin) {
  const DAffine turned(DVec3(0.36, 0.48, -0.8), DVec3(-0.8, 0.6, 0.0), DVec3(0.48, 0.64, 0.6), DVec3(3e4, -2e4, 1e4));
  const BakedFile file = BakedFile::from_bytes(bake(scene_of(grid_mesh(60), turned), config_with_levels()).bytes);
  ASSERT_GE(file.lod(0).levels.size(), 3u);
  EXPECT_GT(file.lod(0).levels[1].error, 3e4f * 0x1p-24f);
  expect_honest_levels(file, 0, 1e-9);
}

TEST(LodFile, StoredErrorsAndSpheresAreNotSmallerThanTheBuilders) {
  BuiltLod built = build_lod(torus_mesh(96, 64));
  const double step = built.geometry.grid.step();
  const std::vector<LodGroup> groups = built.lod.groups;
  const EncodedLod encoded = encode_lod(built.geometry, built.lod);
  ASSERT_EQ(encoded.groups.size(), groups.size());
  for (size_t i = 0; i < groups.size(); ++i) {
    const baked::LodGroupRecord& record = encoded.groups[i];
    EXPECT_EQ(record.level, groups[i].level);
    EXPECT_EQ(std::isinf(record.error), groups[i].terminal);
    EXPECT_GE(double{record.error}, groups[i].error * step);
    if (!groups[i].terminal) {
      EXPECT_LE(double{record.error}, groups[i].error * step * (1.0 + 1e-6));
    }
    const DVec3 center = (DVec3(built.geometry.origin[0], built.geometry.origin[1], built.geometry.origin[2]) +
                          groups[i].sphere.center) *
                         step;
    const DVec3 stored(record.center[0], record.center[1], record.center[2]);
    EXPECT_GE(double{record.radius}, glm::length(stored - center) + groups[i].sphere.radius * step);
    EXPECT_LE(double{record.radius}, groups[i].sphere.radius * step * (1.0 + 1e-4));
  }
}

TEST(LodFile, LevelsKeepSlotsClassesAndStreams) {
  const BakedFile file = BakedFile::from_bytes(bake(mixed_lod_scene(), config_with_levels()).bytes);
  const uint32_t geometry = file.instances()[1].geometry;
  const LodView lod = file.lod(geometry);
  ASSERT_GE(lod.levels.size(), 4u);
  for (const baked::LodLevelRecord& level : lod.levels) {
    std::set<uint32_t> slots;
    for (uint32_t c = 0; c < file.clusters(level.geometry).size(); ++c) {
      const ClusterView cluster = file.cluster(level.geometry, c);
      slots.insert(cluster.material_slot());
      EXPECT_EQ(cluster.has_uvs(), cluster.material_slot() == 1); // the alpha-masked material
      EXPECT_TRUE(cluster.has_normals());
      for (uint32_t v = 0; v < cluster.vertex_count(); ++v) {
        EXPECT_NEAR(glm::length(cluster.normal(v)), 1.0f, 1e-5f);
        if (!cluster.has_uvs()) continue;
        // The plane's texture coordinates equal its positions.
        EXPECT_LT(glm::length(cluster.uv(v) - Vec2(cluster.position(v))), 0.01f);
      }
    }
    // The last level, of 22 triangles, has dropped the plane, which is nearer to the torus than the stated error.
    if (&level != &lod.levels.back()) {
      EXPECT_EQ(slots.size(), 2u) << "level " << level.level;
    }
  }
  expect_honest_levels(file, geometry, 1e-6 * step_of(file.geometries()[geometry]));
}

TEST(LodFile, SaysWhichGeometriesGetLevels) {
  const auto with = [](LodUse use, uint32_t min_triangles) {
    const BakedFile file = BakedFile::from_bytes(bake(mixed_lod_scene(), config_with_levels(use, min_triangles)).bytes);
    // torus with 768 triangles, both meshes with 5600
    return std::pair(!file.lod(0).levels.empty(), !file.lod(1).levels.empty());
  };
  EXPECT_EQ(with(LodUse::kOff, 1), std::pair(false, false));
  EXPECT_EQ(with(LodUse::kInstanced, 1), std::pair(false, true));
  EXPECT_EQ(with(LodUse::kInstanced, 5601), std::pair(false, false));
  EXPECT_EQ(with(LodUse::kAll, 768), std::pair(true, true));
  EXPECT_EQ(with(LodUse::kAll, 769), std::pair(false, true));
}

TEST(LodFile, LimitsTheNumberOfLevels) {
  for (const uint32_t levels : {1u, 3u}) {
    BakeConfig config = config_with_levels();
    config.lod_levels = levels;
    const BakedFile file = BakedFile::from_bytes(bake(scene_of(torus_mesh(96, 64)), config).bytes);
    ASSERT_EQ(file.lod(0).levels.size(), levels + 1);
    for (const baked::LodGroupRecord& group : file.lod(0).groups_of(levels)) EXPECT_TRUE(std::isinf(group.error));
  }
  for (const uint32_t levels : {0u, 32u}) {
    BakeConfig config = config_with_levels();
    config.lod_levels = levels;
    EXPECT_THROW(config.validate(), Error) << levels;
  }
}

TEST(LodFile, LevelZeroIsTheSameWithAndWithoutLevels) {
  const BakedFile without = BakedFile::from_bytes(bake(mixed_lod_scene()).bytes);
  const BakedFile with = BakedFile::from_bytes(bake(mixed_lod_scene(), config_with_levels()).bytes);
  ASSERT_EQ(with.base_geometry_count(), without.geometries().size());
  for (uint32_t g = 0; g < with.base_geometry_count(); ++g) {
    const Decoded a = decode(without, g), b = decode(with, g);
    EXPECT_EQ(a.positions, b.positions);
    EXPECT_EQ(a.normals, b.normals);
    EXPECT_EQ(a.triangles, b.triangles);
  }
  const FileSummary plain = summarize(without), levels = summarize(with);
  EXPECT_EQ(plain.triangles, levels.triangles);
  EXPECT_EQ(plain.clusters, levels.clusters);
  EXPECT_EQ(plain.geometries, levels.geometries);
  EXPECT_EQ(plain.placed_triangles, levels.placed_triangles);
  EXPECT_TRUE(plain.lod.by_geometry.empty());
}

TEST(LodFile, SameBytesForAnyThreadCountAndCodec) {
  if (sanitized()) GTEST_SKIP() << kOthersRunItsCode;
  const auto bytes = [](size_t threads, PageCodec codec) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    BakeConfig config = config_with_levels();
    config.codec = codec;
    return bake(mixed_lod_scene(), config).bytes;
  };
  const std::vector<std::byte> one = bytes(1, PageCodec::kNone);
  EXPECT_EQ(one, bytes(4, PageCodec::kNone));
  for (const PageCodec codec : {PageCodec::kFast, PageCodec::kSmall}) {
    const std::vector<std::byte> disk = bytes(4, codec);
    EXPECT_LT(disk.size(), one.size());
    EXPECT_TRUE(std::ranges::equal(BakedFile::from_bytes(disk).bytes(), one)) << name_of(codec);
  }
}

TEST(LodFile, SummaryCountsLevelsAndTheirBytes) {
  const BakedFile file = BakedFile::from_bytes(bake(mixed_lod_scene(), config_with_levels()).bytes);
  const FileSummary s = summarize(file);
  ASSERT_EQ(s.lod.by_geometry.size(), 2u);
  const LodTable &small = s.lod.by_geometry[0].table, &large = s.lod.by_geometry[1].table;
  ASSERT_LT(small.levels.size(), large.levels.size());
  EXPECT_EQ(s.lod.all.levels.size(), large.levels.size());
  EXPECT_EQ(s.lod.all.base_triangles(), s.triangles);
  EXPECT_EQ(s.lod.all.bytes(), small.bytes() + large.bytes());
  EXPECT_EQ(s.lod.all.levels.back().triangles, small.levels.back().triangles + large.levels.back().triangles);
  EXPECT_EQ(s.lod.all.levels.back().geometries, 1u);
  ClusterView::StreamBits bits;
  for (const LodLevelUse& level : s.lod.all.levels) {
    bits.indices += level.stream_bits.indices, bits.positions += level.stream_bits.positions;
    bits.normals += level.stream_bits.normals, bits.uvs += level.stream_bits.uvs;
  }
  EXPECT_EQ((std::array{bits.indices, bits.positions, bits.normals, bits.uvs}), s.bake.stream_bits);
  const StreamBytes& b = s.bytes;
  EXPECT_GT(b.lod_records, 0u);
  EXPECT_EQ(s.lod.all.bytes(),
            file.sections().payload.size() - 8 + b.cluster_records + b.geometry_records + b.lod_records);
  EXPECT_EQ(b.indices + b.positions + b.normals + b.uvs + b.payload_padding + b.cluster_records + b.geometry_records +
                b.instance_records + b.material_records + b.masks + b.textures + b.cameras + b.strings +
                b.requirement_records + b.lod_records + b.trees + b.shading_materials + b.lights + b.environment_maps +
                b.proxies + b.header_and_alignment,
            b.total);
}

TEST(LodFile, ThousandsOfTinyGeometriesGetNone) {
  Scene scene = scene_of(soup_mesh(1, 1));
  for (uint32_t i = 0; i < 2000; ++i) add_shape(scene, soup_mesh(1 + i % 7, i), translation({double(i), 0, 0}));
  add_shape(scene, torus_mesh(24, 16), translation({0, 9, 0}));
  const BakedFile file = BakedFile::from_bytes(bake(scene, config_with_levels(LodUse::kAll, 512)).bytes);
  EXPECT_EQ(file.base_geometry_count(), 2002u);
  EXPECT_GT(file.lod(2001).levels.size(), 1u);
  EXPECT_EQ(file.sections().lod_levels.front().base, 2001u);
}

/// Sizes beyond the range of float get no levels, and the bake succeeds.
TEST(LodFile, GeometryAtTheEndOfTheFloatRange) {
  for (const double size : {2e38, 1e-40}) {
    const BakedFile file =
        BakedFile::from_bytes(bake(scene_of(torus_mesh(24, 16), scaling(DVec3(size))), config_with_levels()).bytes);
    EXPECT_EQ(file.geometries()[0].triangle_count, 768u);
    for (const baked::LodGroupRecord& group : file.lod(0).groups) EXPECT_TRUE(std::isfinite(group.radius));
  }
}

} // namespace
} // namespace packtrace::test
