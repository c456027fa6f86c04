// Tests geometries that touch: what is closed at level 0 stays closed for any combination of levels.

#include "compress/bake/lod/shared_borders.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <set>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "compress/bake/grid/geometry_measure.h"
#include "compress/bake/plan/requirements.h"
#include "tests/compress/lod/lod_meshes.h"
#include "tests/compress/test_scenes.h"
#include "tests/pbrt_import/scene_folder.h"
#include "tests/sanitized.h"

namespace packtrace::test {
namespace {

/// Splits the mesh into parts that share only the points between them; part_of(centroid) returns the part.
template <typename PartOf>
std::vector<Mesh> split_mesh(const Mesh& mesh, const PartOf& part_of) {
  std::vector<Mesh> parts;
  std::vector<std::map<uint32_t, uint32_t>> numbers;
  for (const Triangle& t : mesh.triangles) {
    const uint32_t part = part_of((mesh.positions[t.x] + mesh.positions[t.y] + mesh.positions[t.z]) / 3.0f);
    if (part >= parts.size()) parts.resize(part + 1), numbers.resize(part + 1);
    Triangle own{};
    for (int corner = 0; corner < 3; ++corner) {
      const auto next = static_cast<uint32_t>(parts[part].positions.size());
      const auto [at, added] = numbers[part].emplace(t[corner], next);
      if (added) parts[part].positions.push_back(mesh.positions[t[corner]]);
      own[corner] = at->second;
    }
    parts[part].triangles.push_back(own);
  }
  return parts;
}

Scene scene_of_parts(const std::vector<Mesh>& parts) {
  Scene scene = scene_of(parts.front());
  for (size_t i = 1; i < parts.size(); ++i) add_shape(scene, parts[i]);
  return scene;
}

/// A torus in three parts, with borders across it, along it and in saw teeth.
std::vector<Mesh> torus_parts() {
  return split_mesh(torus_mesh(96, 64), [](Vec3 p) { return p.x < 0.0f ? 0u : p.z < 0.0f ? 1u : 2u; });
}

BakeConfig lod_config() {
  BakeConfig config;
  config.lod = LodUse::kAll;
  config.lod_min_triangles = 1;
  return config;
}

/// LOD levels of all geometries, on the finest of their nested lattices.
std::vector<ClusterLod> bake_levels(const Scene& scene, const BakeConfig& config = lod_config()) {
  const BakedFile file = BakedFile::from_bytes(bake(scene, config).bytes);
  const auto exponent = [&](uint32_t g) { return file.geometries()[g].step_exponent; };
  int32_t finest = exponent(0);
  for (uint32_t g = 1; g < file.base_geometry_count(); ++g) finest = std::min(finest, exponent(g));
  std::vector<ClusterLod> lods;
  for (uint32_t g = 0; g < file.base_geometry_count(); ++g) {
    lods.push_back(read_lod(file, g));
    for (LatticePoint& p : lods.back().positions)
      for (int64_t& coordinate : p) coordinate *= int64_t{1} << (exponent(g) - finest);
  }
  return lods;
}

using Chain = std::map<std::pair<LatticePoint, LatticePoint>, int64_t>;

/// Adds the boundary of a cut; edges that cancel are removed.
void add_boundary(Chain& chain, const ClusterLod& lod, const std::vector<uint32_t>& cut) {
  for (const BoundaryEdge& edge : boundary(lod, cut)) {
    const auto at = chain.emplace(std::pair(edge.a, edge.b), 0).first;
    if ((at->second += edge.count) == 0) chain.erase(at);
  }
}

/// The cut of a view from `eye`: a group passes if its error is at most `slope` times its distance.
std::vector<uint32_t> cut_from(const ClusterLod& lod, DVec3 eye, double slope) {
  const auto passes = [&](uint32_t number) {
    const LodGroup& group = lod.groups[number];
    return group.error <= slope * std::max(0.0, glm::length(group.sphere.center - eye) - group.sphere.radius);
  };
  std::vector<uint32_t> cut;
  for (uint32_t i = 0; i < lod.clusters.size(); ++i) {
    const LodCluster& c = lod.clusters[i];
    if (!passes(c.group) && (c.generating_group == kNoGroup || passes(c.generating_group))) cut.push_back(i);
  }
  return cut;
}

std::vector<double> some_thresholds(const ClusterLod& lod, size_t count) {
  const std::vector<double> all = thresholds(lod);
  std::vector<double> some;
  for (size_t i = 0; i < all.size(); i += std::max<size_t>(all.size() / count, 1)) some.push_back(all[i]);
  some.push_back(1e300); // the coarsest
  return some;
}

TEST(SharedBorders, AClosedSurfaceOfSeveralGeometriesIsClosedAtEveryPairOfLevels) {
  if (sanitized()) GTEST_SKIP() << kOthersRunItsCode;
  const std::vector<ClusterLod> parts = bake_levels(scene_of_parts(torus_parts()));
  ASSERT_EQ(parts.size(), 3u);
  for (const ClusterLod& part : parts) ASSERT_GE(part.level_count, 4u);
  for (size_t a = 0; a < parts.size(); ++a)
    for (size_t b = a + 1; b < parts.size(); ++b) {
      Chain rest; // the third part remains at level 0
      add_boundary(rest, parts[3 - a - b], cut_clusters(parts[3 - a - b], 0.0));
      for (const double in_a : some_thresholds(parts[a], 12))
        for (const double in_b : some_thresholds(parts[b], 12)) {
          Chain chain = rest;
          add_boundary(chain, parts[a], cut_clusters(parts[a], in_a));
          add_boundary(chain, parts[b], cut_clusters(parts[b], in_b));
          EXPECT_TRUE(chain.empty()) << chain.size() << " open edges, parts " << a << " and " << b << " at " << in_a
                                     << " and " << in_b;
        }
    }
}

TEST(SharedBorders, CutsOfAnyViewsAreClosedAcrossGeometries) {
  const std::vector<ClusterLod> parts = bake_levels(scene_of_parts(torus_parts()));
  ASSERT_GE(parts.size(), 2u);
  for (const ClusterLod& part : parts) ASSERT_GE(part.level_count, 2u);
  Random random(3);
  for (int repeat = 0; repeat < 200; ++repeat) {
    Chain chain;
    for (const ClusterLod& part : parts) {
      const DVec3 eye(random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-3, 3));
      add_boundary(chain, part, cut_from(part, eye, std::pow(10.0, double{random.uniform(-4, 0)})));
    }
    EXPECT_TRUE(chain.empty()) << chain.size() << " open edges";
  }
}

/// Level 0 is open here, so the surface is not closed, but the common border is the same edge by edge.
TEST(SharedBorders, TheSeamOfTwoOpenSheetsStaysAsItIs) {
  const std::vector<Mesh> meshes =
      split_mesh(grid_mesh(60, 0.05f), [](Vec3 p) { return p.x + 0.1f * std::sin(20.0f * p.y) < 0.5f ? 0u : 1u; });
  const std::vector<ClusterLod> parts = bake_levels(scene_of_parts(meshes));
  std::array<Chain, 2> whole;
  for (size_t i = 0; i < 2; ++i) add_boundary(whole[i], parts[i], cut_clusters(parts[i], 0.0));
  Chain seam;
  for (const auto& [edge, count] : whole[0])
    if (const auto other = whole[1].find(edge); other != whole[1].end() && other->second == -count)
      seam.emplace(edge, count);
  ASSERT_GT(seam.size(), 60u);
  for (size_t i = 0; i < 2; ++i)
    for (const double threshold : some_thresholds(parts[i], 40)) {
      Chain chain;
      add_boundary(chain, parts[i], cut_clusters(parts[i], threshold));
      for (const auto& [edge, count] : seam) {
        const auto found = chain.find(edge);
        ASSERT_TRUE(found != chain.end()) << "at " << threshold;
        EXPECT_EQ(found->second, i == 0 ? count : -count);
      }
      EXPECT_LE(chain.size(), whole[i].size());
    }
  EXPECT_LT(level_triangles(parts[0], 2), level_triangles(parts[0], 0) / 3); // the interior is simplified
}

/// A wall that stands on a floor: its border runs over interior points of the floor.
TEST(SharedBorders, ABorderOnTheInsideOfAnotherGeometryStays) {
  Mesh floor = grid_mesh(40), wall = grid_mesh(40);
  for (Vec3& p : wall.positions) p = Vec3(p.x, 0.5f, p.y);
  const std::vector<ClusterLod> parts = bake_levels(scene_of_parts({floor, wall}));
  const auto floor_line = [](const ClusterLod& lod, const std::vector<uint32_t>& cut) {
    std::set<LatticePoint> points;
    for (const uint32_t number : cut)
      for (uint32_t i = 0; i < lod.clusters[number].range.triangle_count; ++i)
        for (int corner = 0; corner < 3; ++corner)
          points.insert(lod.positions[lod.vertices[lod.triangles[lod.clusters[number].range.first_triangle + i][corner]]
                                          .position]);
    return points;
  };
  const std::set<LatticePoint> of_floor = floor_line(parts[0], cut_clusters(parts[0], 0.0)),
                               of_wall = floor_line(parts[1], cut_clusters(parts[1], 0.0));
  std::vector<LatticePoint> common;
  std::ranges::set_intersection(of_floor, of_wall, std::back_inserter(common));
  ASSERT_EQ(common.size(), 41u);
  for (const ClusterLod& part : parts) {
    const std::set<LatticePoint> coarsest = floor_line(part, cut_clusters(part, 1e300));
    EXPECT_TRUE(std::ranges::includes(coarsest, common));
    EXPECT_LT(coarsest.size(), 400u);
  }
}

TEST(SharedBorders, GeometriesWithoutLevelsOfTheirOwnKeepTheirNeighboursBorder) {
  std::vector<Mesh> meshes = split_mesh(torus_mesh(96, 64), [](Vec3 p) { return p.x < 1.2f ? 0u : 1u; });
  BakeConfig config = lod_config();
  config.lod_min_triangles = static_cast<uint32_t>(meshes[1].triangles.size()) + 1;
  const BakedFile file = BakedFile::from_bytes(bake(scene_of_parts(meshes), config).bytes);
  ASSERT_GT(file.lod(0).levels.size(), 3u);
  ASSERT_TRUE(file.lod(1).levels.empty());
  const ClusterLod large = read_lod(file, 0);
  Chain whole;
  add_boundary(whole, large, cut_clusters(large, 0.0));
  ASSERT_GT(whole.size(), 60u);
  for (const double threshold : some_thresholds(large, 40)) {
    Chain chain;
    add_boundary(chain, large, cut_clusters(large, threshold));
    EXPECT_TRUE(chain == whole) << "at " << threshold;
  }
}

/// Coincident layers have all positions in common but no border.
TEST(SharedBorders, ClosedShellsInOnePlaceAreSimplified) {
  Mesh inner = torus_mesh(96, 64);
  for (Triangle& t : inner.triangles) std::swap(t.y, t.z);
  const std::vector<ClusterLod> parts = bake_levels(scene_of_parts({torus_mesh(96, 64), inner}));
  ASSERT_EQ(parts.size(), 2u);
  for (const ClusterLod& part : parts) EXPECT_LE(level_triangles(part, part.level_count - 1), 128u);
}

QuantizedGeometry on_grid(const Mesh& mesh, const PositionGrid& grid) {
  const Scene scene = scene_of(mesh);
  const ScenePlan plan = plan_scene(scene);
  LengthHistogram edges;
  GeometryMeasure measure;
  measure.bounds = measure_geometry(scene, plan.geometries[0], edges);
  const BakeConfig config;
  return quantize_geometry(scene, plan.geometries[0], analyse_requirements(scene, plan, plan.geometries[0], config),
                           config, GeometryGrid{grid, {}}, measure);
}

std::vector<std::vector<uint8_t>> locks_of(const std::vector<QuantizedGeometry>& geometries) {
  SharedBorderFinder finder(geometries.size());
  for (size_t i = 0; i < geometries.size(); ++i) finder.add(i, geometries[i]);
  const SharedBorders borders = finder.finish();
  std::vector<std::vector<uint8_t>> locks;
  for (const QuantizedGeometry& geometry : geometries) locks.push_back(borders.locks(geometry));
  return locks;
}

/// Positions on the coarser lattice are also on the finer one.
TEST(SharedBorders, AreFoundBetweenGridsOfDifferentSteps) {
  Mesh left = grid_mesh(16), right = left;
  for (Vec3& p : right.positions) p.x += 1.0f;
  for (const int32_t finer : {0, 1, 7, 20}) {
    const std::vector<QuantizedGeometry> geometries = {on_grid(left, {8, -8}), on_grid(right, {8, -8 - finer})};
    const auto locks = locks_of(geometries);
    for (size_t i = 0; i < 2; ++i) {
      ASSERT_EQ(locks[i].size(), geometries[i].positions.size());
      EXPECT_EQ(std::ranges::count(locks[i], 1), 17) << finer;
      const int64_t seam = int64_t{32} << (i == 1 ? finer : 0); // x = 1, in steps of 1/32 and finer
      for (size_t p = 0; p < locks[i].size(); ++p) EXPECT_EQ(locks[i][p] != 0, geometries[i].positions[p][0] == seam);
    }
  }
  // With another mantissa, positions coincide only at multiples: 9 steps of 8 are 8 steps of 9.
  const auto locks = locks_of({on_grid(left, {8, -8}), on_grid(right, {9, -8})});
  for (const auto& of_one : locks) EXPECT_LT(std::ranges::count(of_one, 1), 17);
}

TEST(SharedBorders, NegativeCoordinatesAndZeroAreComparedAlike) {
  Mesh left = grid_mesh(8), right = left;
  for (Vec3& p : left.positions) p = p - Vec3(1.0f, 0.5f, 0.0f);
  for (Vec3& p : right.positions) p.y -= 0.5f;
  for (const auto& of_one : locks_of({on_grid(left, {8, -8}), on_grid(right, {8, -11})}))
    EXPECT_EQ(std::ranges::count(of_one, 1), 9);
}

TEST(SharedBorders, AGeometryAloneHasNone) {
  const auto locks = locks_of({on_grid(grid_mesh(16), {8, -8})});
  EXPECT_TRUE(locks[0].empty());
}

TEST(SharedBorders, SheetsOfTwoLayersHaveABorder) {
  const QuantizedGeometry sheet = on_grid(twice(grid_mesh(16), true), {8, -8});
  EXPECT_EQ(std::ranges::count(border_positions(sheet), 1), 289); // each edge has four triangles
  Mesh folded;                                                    // two coincident triangles that form a closed surface
  folded.positions = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)};
  folded.triangles = {Triangle(0, 1, 2), Triangle(0, 2, 1)};
  EXPECT_EQ(std::ranges::count(border_positions(on_grid(folded, {8, -8})), 1), 3);
  EXPECT_EQ(std::ranges::count(border_positions(on_grid(torus_mesh(24, 16), {8, -8})), 1), 0);
  EXPECT_EQ(std::ranges::count(border_positions(on_grid(grid_mesh(16), {8, -8})), 1), 64);
}

TEST(SharedBorders, SameBytesForAnyThreadCount) {
  const auto bytes = [](size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return bake(scene_of_parts(torus_parts()), lod_config()).bytes;
  };
  EXPECT_TRUE(bytes(1) == bytes(4));
}

/// The locks of a geometry depend on its neighbours.
TEST(SharedBorders, LevelsOfAnInterruptedBakeAreNotTakenForOtherNeighbours) {
  const SceneFolder folder;
  const std::vector<Mesh> parts = torus_parts();
  BakeConfig config = lod_config();
  config.precision_kind = PrecisionKind::kAbsolute; // the same grid in any scene
  config.precision = 0.001;
  const std::vector<std::byte> alone = bake(scene_of_parts({parts[0]}), config).bytes;
  config.resume = folder.path() / "levels";
  EXPECT_EQ(bake(scene_of_parts(parts), config).report.resumed_geometries, 0u);
  const BakedScene after = bake(scene_of_parts({parts[0]}), config);
  EXPECT_EQ(after.report.resumed_geometries, 0u);
  EXPECT_TRUE(after.bytes == alone);
  EXPECT_EQ(bake(scene_of_parts(parts), config).report.resumed_geometries, 3u);
}

} // namespace
} // namespace packtrace::test
