#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <gtest/gtest.h>

#include "tests/runtime/trace/embree_cluster_tracer.h"
#include "tests/runtime/trace/packed_scenes.h"
#include "tests/runtime/trace/test_scenes.h"
#include "tests/sanitized.h"

namespace packtrace {
namespace {

using test::any;
using test::BakedScene;
using test::closest;

constexpr size_t kManyRays = 1'000'000, kRaysPerPrecision = 100'000;

/// One ray of so many is traced: they are slow under sanitizers, and builds without them find rare leaks.
const size_t kRayShare = test::sanitized() ? 50 : 1;

/// Rays from inside a closed mesh to its vertices, to points on its edges and elsewhere, and along the axes. All must
/// hit.
std::vector<Ray> rays_from_inside(const SceneSource& source, const UnitSpace& space, DVec3 inside, size_t count,
                                  uint32_t seed) {
  const PlacedGeometry& instance = source.instances()[0];
  const GeometryCounts counts = source.counts(instance.geometry);
  std::vector<Vec3> positions(counts.vertices);
  std::vector<Triangle> triangles(counts.triangles);
  source.decode(instance.geometry, positions, triangles);
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::vector<Ray> rays(count);
  for (size_t i = 0; i < count; ++i) {
    const Triangle t = triangles[generator() % triangles.size()];
    const auto corner = [&](int k) {
      return space.to_unit(transform_point(DAffine(instance.world_from_object), DVec3(positions[t[k]])));
    };
    const double u = unit(generator), v = unit(generator);
    DVec3 target = corner(0);
    if (i % 4 == 1) target += (corner(1) - corner(0)) * u;
    if (i % 4 == 2) target += (corner(2) - corner(0)) * 0.5;
    Ray& ray = rays[i];
    const DVec3 size = (corner(1) - corner(0)) * 0.01;
    ray.origin = Vec3(space.to_unit(inside) + (i % 8 < 4 ? DVec3(0.0) : size * v));
    ray.direction = Vec3(target - DVec3(ray.origin));
    if (i % 4 == 3) { // parallel to a coordinate plane
      ray.direction[static_cast<int>(i / 4 % 3)] = 0.0f;
      if (ray.direction == Vec3(0)) ray.direction.x = 1.0f;
    }
    if (i % 48 == 47) ray.direction = Vec3(0, i % 96 < 48 ? 1 : -1, 0);
  }
  return rays;
}

/// Returns the rays with the same origin as the first, sorted by major axis, so that most groups form beams of one
/// major axis.
std::vector<Ray> beams(std::span<const Ray> rays) {
  std::vector<Ray> result;
  for (const Ray& ray : rays)
    if (ray.origin == rays[0].origin) result.push_back(ray);
  const auto axis = [](const Ray& ray) {
    const Vec3 size = glm::abs(ray.direction);
    return size.z >= size.x && size.z >= size.y ? 2 : size.y >= size.x ? 1 : 0;
  };
  std::stable_sort(result.begin(), result.end(), [&](const Ray& a, const Ray& b) { return axis(a) < axis(b); });
  return result;
}

template <typename Tracer = PackedTracer>
size_t leaks(const Scene& scene, DVec3 inside, size_t count, PackedIsa isa, const BakeConfig& config = {}) {
  constexpr size_t kAtOnce = 1000000;
  count /= kRayShare;
  const BakedScene baked(scene, config);
  const Tracer tracer(baked.file, baked.source, isa);
  size_t missed = 0;
  for (uint32_t seed = 2; count > 0; ++seed) {
    const size_t now = std::min(count, kAtOnce);
    const std::vector<Ray> rays = rays_from_inside(baked.source, tracer.space(), inside, now, seed);
    for (const uint8_t hit : any(tracer, rays)) missed += hit == 0;
    for (const RayHit& hit : closest(tracer, rays)) missed += !hit.valid();
    for (const RayHit& hit : closest(tracer, beams(rays))) missed += !hit.valid();
    count -= now;
  }
  return missed;
}

/// Number of rays of a long run, from the environment: PACKTRACE_LEAK_RAYS=100000000. 0 if not set.
size_t long_run() {
  const char* count = std::getenv("PACKTRACE_LEAK_RAYS");
  return count == nullptr ? 0 : std::strtoull(count, nullptr, 10);
}

TEST(PackedLeaks, NoneInALongRun) {
  if (long_run() == 0) GTEST_SKIP() << "PACKTRACE_LEAK_RAYS is not set";
  Scene scene;
  test::add_shape(scene, test::sphere({0, 0, 0}, 1, 200));
  EXPECT_EQ(leaks(scene, {0.1, 0.2, -0.05}, long_run(), chosen_isa()), 0u);
}

TEST(PackedLeaks, NoRayLeavesAClosedMesh) {
  Scene scene;
  test::add_shape(scene, test::sphere({0, 0, 0}, 1, 50));
  for (const PackedIsa isa : test::isas())
    EXPECT_EQ(leaks(scene, {0.1, 0.2, -0.05}, isa == PackedIsa::kScalar ? kManyRays / 5 : kManyRays, isa), 0u);
}

TEST(PackedLeaks, NoneFromTheMiddleWhereEdgesAlign) {
  Scene scene; // Rays along the axis of the sphere hit the poles, where dozens of edges meet.
  test::add_shape(scene, test::sphere({0, 0, 0}, 1, 24));
  for (const PackedIsa isa : test::isas()) EXPECT_EQ(leaks(scene, {0, 0, 0}, 100000, isa), 0u);
}

/// A closed cube around the origin; each side has cells x cells quads.
Mesh cube(float half, int cells) {
  Mesh mesh;
  const auto corner = [&](int side, int i, int j) {
    Vec3 p(half);
    p[side / 2] = side % 2 == 0 ? -half : half;
    p[(side / 2 + 1) % 3] = half * static_cast<float>(2 * i - cells) / static_cast<float>(cells);
    p[(side / 2 + 2) % 3] = half * static_cast<float>(2 * j - cells) / static_cast<float>(cells);
    mesh.positions.push_back(p);
    return static_cast<uint32_t>(mesh.positions.size() - 1);
  };
  for (int side = 0; side < 6; ++side)
    for (int i = 0; i < cells; ++i)
      for (int j = 0; j < cells; ++j) {
        const uint32_t a = corner(side, i, j), b = corner(side, i + 1, j), c = corner(side, i + 1, j + 1),
                       d = corner(side, i, j + 1);
        mesh.triangles.emplace_back(a, b, c), mesh.triangles.emplace_back(a, c, d);
      }
  return mesh;
}

/// Rays that start a few ulp inside a side of a cube, many in a row from the same side. They run along it, into it or
/// away from it, to points, vertices and edges of other sides. All must hit.
std::vector<Ray> rays_from_sides(const UnitSpace& space, const DAffine& world_from_cube, double half, int cells,
                                 double ulps, size_t count) {
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const auto in_unit = [&](DVec3 p) { return space.to_unit(transform_point(world_from_cube, p)); };
  std::vector<Ray> rays(count);
  for (size_t i = 0; i < count; ++i) {
    const int axis = static_cast<int>(i / 256 % 3), other = (axis + 1 + static_cast<int>(i % 2)) % 3;
    const double inwards = i / 768 % 2 == 0 ? 1.0 : -1.0;
    DVec3 from(unit(generator), unit(generator), unit(generator)),
        to(unit(generator), unit(generator), unit(generator));
    from *= 0.9;
    from[axis] = -inwards * (1.0 - ulps * 0x1p-23);
    if (i % 4 < 2) to[other] = unit(generator) < 0.0 ? -1.0 : 1.0;
    if (i % 4 >= 2) to[axis] = inwards;
    if (i % 8 == 0) to[axis] = from[axis]; // along the side
    if (i % 8 == 4) to[axis] = from[axis] + inwards * 1e-6;
    if (i % 8 == 6) to[axis] = -1.1 * inwards; // into the side
    for (int k = 0; k < 3 && i % 16 > 10; ++k) // edges and vertices
      if (k != axis && (i % 16 > 13 || k == other)) to[k] = std::round(to[k] * cells / 2) * 2 / cells;
    rays[i].origin = Vec3(in_unit(from * half));
    rays[i].direction = Vec3(in_unit(to * half) - DVec3(rays[i].origin));
    if (i % 3 == 0) rays[i].tfar = 1.0f + 1e-4f;
  }
  return rays;
}

TEST(PackedLeaks, NoneFromBesideTheSidesOfACube) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  const size_t kRays = 50000 / kRayShare;
  constexpr int kCells = 8;
  const Mesh mesh = cube(1, kCells);
  for (const bool instanced : {false, true})
    for (const DVec3 at : {DVec3(0), DVec3(-1, 1, -1), DVec3(3, -5, 4)}) {
      Scene scene;
      const DAffine world_from_cube =
          instanced ? test::placed(at, {2, 1, 0.5}, 33, {1, 2, 3}) : test::placed(at, DVec3(1));
      if (instanced) {
        test::add_object(scene, mesh);
        scene.instances.push_back({0, Affine(world_from_cube)});
        test::add_shape(scene, test::quad({-9, -9, -9}, {18, 0, 0}, {0, 18, 0}));
      } else {
        test::add_shape(scene, mesh, 0, world_from_cube);
      }
      const BakedScene baked(scene);
      const double ulps = instanced ? 400 : 3 * (1 + std::max({std::abs(at.x), std::abs(at.y), std::abs(at.z)}));
      for (const PackedIsa isa : test::isas()) {
        const PackedTracer tracer(baked.file, baked.source, isa);
        const std::vector<Ray> rays = rays_from_sides(tracer.space(), world_from_cube, 1, kCells, ulps, kRays);
        EXPECT_EQ(std::ranges::count(any(tracer, rays), 0), 0) << at.x;
        size_t missed = 0;
        for (const RayHit& hit : closest(tracer, rays)) missed += !hit.valid();
        EXPECT_EQ(missed, 0u) << at.x;
      }
    }
}

TEST(PackedLeaks, NoneFarFromTheOrigin) {
  Scene scene;
  test::add_shape(scene, test::sphere({1000, 2000, -500}, 1, 40));
  for (const PackedIsa isa : test::isas()) EXPECT_EQ(leaks(scene, {1000.1, 2000.2, -500}, 100000, isa), 0u);
}

TEST(PackedLeaks, NoneBesideAHugeTriangle) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  Scene scene; // The triangle is so large that pads of rays would be larger than leaf nodes.
  test::add_shape(scene, test::sphere({0.3, -0.2, 0.1}, 1, 50));
  Mesh huge;
  huge.positions = {{1e6f, 10, 10}, {1e6f, 2e4f, 10}, {-1e6f, 1e6f, 2e4f}};
  huge.triangles = {{0, 1, 2}};
  test::add_shape(scene, huge);
  for (const PackedIsa isa : test::isas())
    EXPECT_EQ(leaks(scene, {0.4, 0, 0.05}, isa == PackedIsa::kScalar ? kManyRays / 5 : kManyRays, isa), 0u);
}

TEST(PackedLeaks, NoneThroughInstances) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  for (const DVec3 scale : {DVec3(1, 1, 1), DVec3(-3, 0.02, 1), DVec3(1e-6, 1e-6, 2e-6)}) {
    Scene scene;
    test::add_object(scene, test::sphere({0, 0, 0}, 1, 40));
    scene.instances.push_back({0, Affine(test::placed({5, 6, 7}, scale, 33, {1, 2, 3}))});
    for (const PackedIsa isa : test::isas()) EXPECT_EQ(leaks(scene, {5, 6, 7}, 50000, isa), 0u) << scale.x;
  }
}

TEST(PackedLeaks, NoneAtAnyScale) {
  for (const double scale : {1e-30, 1e-15, 1e-3, 1e10, 1e30}) {
    Scene scene;
    test::add_shape(scene, test::sphere({0, 0, 0}, 1, 30), 0, test::placed({0, 0, 0}, DVec3(scale)));
    for (const PackedIsa isa : test::isas())
      EXPECT_EQ(leaks(scene, DVec3(0.1, 0.2, 0.3) * scale, 20000, isa), 0u) << scale;
  }
}

TEST(EmbreeClusterLeaks, NoRayLeavesAClosedMesh) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  Scene scene;
  test::add_shape(scene, test::sphere({0, 0, 0}, 1, 50));
  EXPECT_EQ(leaks<EmbreeClusterTracer>(scene, {0.1, 0.2, -0.05}, kManyRays, chosen_isa()), 0u);
}

TEST(EmbreeClusterLeaks, NoneFarAwayOrThroughInstancesOfAnyScale) {
  Scene far;
  test::add_shape(far, test::sphere({1000, 2000, -500}, 1, 40));
  EXPECT_EQ(leaks<EmbreeClusterTracer>(far, {1000.1, 2000.2, -500}, 100000, chosen_isa()), 0u);
  for (const DVec3 scale : {DVec3(-3, 0.02, 1), DVec3(1e-6, 1e-6, 2e-6), DVec3(1e30)}) {
    Scene scene;
    test::add_object(scene, test::sphere({0, 0, 0}, 1, 40));
    scene.instances.push_back({0, Affine(test::placed({5, 6, 7}, scale, 33, {1, 2, 3}))});
    EXPECT_EQ(leaks<EmbreeClusterTracer>(scene, {5, 6, 7}, 50000, chosen_isa()), 0u) << scale.x;
  }
}

TEST(PackedLeaks, NoneBesideDegenerateTriangles) {
  Scene scene;
  Mesh mesh = test::sphere({0, 0, 0}, 1, 30); // Cells at its poles have a collapsed edge already.
  const auto count = static_cast<uint32_t>(mesh.positions.size());
  for (uint32_t i = 0; i + 7 < count; i += 7) mesh.triangles.emplace_back(i, i + 3, i);
  test::add_shape(scene, mesh);
  for (const PackedIsa isa : test::isas()) EXPECT_EQ(leaks(scene, {0.1, 0, 0.1}, 100000, isa), 0u);
}

/// A closed sphere on a lattice of step 1/1024 in which many edges contain a third vertex: the triangle on one side has
/// the whole edge, and two triangles on the other side have half of it each. Slivers of zero area lie between them, or
/// are omitted.
Mesh sphere_of_split_edges(bool slivers) {
  constexpr float kSteps = 1024.0f;
  Mesh mesh = test::sphere({0, 0, 0}, 1, 24);
  mesh.normals.clear();
  // Multiples of two steps, so that midpoints of edges are on the lattice, too.
  for (Vec3& p : mesh.positions) p = 2.0f * glm::round(p * kSteps * 0.5f) / kSteps;
  const std::vector<Triangle> whole = mesh.triangles;
  mesh.triangles.clear();
  for (size_t i = 0; i < whole.size(); ++i) {
    const Triangle& t = whole[i];
    const Vec3 middle = 0.5f * (mesh.positions[t.x] + mesh.positions[t.z]);
    if (i % 3 != 0 || middle == mesh.positions[t.x]) {
      mesh.triangles.push_back(t);
      continue;
    }
    const auto m = static_cast<uint32_t>(mesh.positions.size());
    mesh.positions.push_back(middle);
    mesh.triangles.emplace_back(t.x, t.y, m), mesh.triangles.emplace_back(m, t.y, t.z);
    if (slivers) mesh.triangles.emplace_back(t.x, m, t.z);
  }
  return mesh;
}

TEST(PackedLeaks, NoneBesideSliversThatJoinALongEdgeToShortOnes) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  BakeConfig config;
  config.precision_kind = PrecisionKind::kAbsolute;
  config.precision = 1.0 / 1024.0;
  Scene with, without;
  test::add_shape(with, sphere_of_split_edges(true));
  test::add_shape(without, sphere_of_split_edges(false));
  for (const PackedIsa isa : test::isas()) {
    EXPECT_EQ(leaks(with, {0.1, 0.2, -0.05}, 200000, isa, config), 0u);
    // Without the slivers rays leak, so the test above is meaningful.
    EXPECT_GT(leaks(without, {0.1, 0.2, -0.05}, 200000, isa, config), 0u);
  }
}

TEST(PackedLeaks, NoneAtAnyNumberOfPositionBits) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  Scene scene;
  test::add_shape(scene, test::sphere({0, 0, 0}, 1, 50));
  for (const int bits : {3, 5, 6, 8, 10, 12, 22, 25, 28}) {
    BakeConfig config;
    config.precision_kind = PrecisionKind::kPositionBits;
    config.precision = bits;
    for (const PackedIsa isa : test::isas())
      EXPECT_EQ(leaks(scene, {0.1, 0.2, -0.05}, kRaysPerPrecision, isa, config), 0u) << bits;
  }
}

TEST(PackedLeaks, OneTriangleIsHitInsideAndOnItsEdges) {
  Scene scene;
  Mesh mesh;
  mesh.positions = {{-1, -1, 0}, {3, -1, 0}, {-1, 3, 0}};
  mesh.triangles = {{0, 1, 2}};
  test::add_shape(scene, mesh);
  const BakedScene baked(scene);
  for (const PackedIsa isa : test::isas()) {
    const PackedTracer tracer(baked.file, baked.source, isa);
    const auto hits = [&](double x, double y, float direction) {
      Ray ray; // perpendicular to the triangles, so only the decision about x and y matters
      ray.origin = Vec3(tracer.space().to_unit({x, y, -double{direction}}));
      ray.direction = Vec3(0, 0, direction);
      return any(tracer, {&ray, 1})[0] != 0;
    };
    for (const float direction : {1.0f, -1.0f}) { // both faces
      EXPECT_TRUE(hits(0, 0, direction));
      EXPECT_TRUE(hits(-1, 0, direction));
      EXPECT_TRUE(hits(1, 1, direction));
      EXPECT_TRUE(hits(-1, -1, direction));
      EXPECT_FALSE(hits(1.001, 1.001, direction));
      EXPECT_FALSE(hits(-1.001, 0, direction));
      EXPECT_FALSE(hits(0, -1.001, direction));
    }
  }
}

} // namespace
} // namespace packtrace
