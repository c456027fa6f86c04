#include "runtime/trace/source/lod_source.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "pbrt_import/base/error.h"
#include "runtime/camera/lod_view.h"
#include "runtime/camera/primary_visibility.h"
#include "runtime/trace/make_tracer.h"
#include "runtime/trace/packed/scene/packed_tracer.h"
#include "tests/runtime/lod/own_cuts.h"
#include "tests/runtime/trace/packed_scenes.h"
#include "tests/runtime/trace/test_scenes.h"
#include "tests/sanitized.h"

namespace packtrace {
namespace {

constexpr ImageSize kSize{96, 64};

/// A floor, a sphere in world space, and instances of a bumpy sphere: near and far, mirrored, squeezed, and one out of
/// sight.
Scene scene_of_spheres() {
  Scene scene;
  test::add_shape(scene, test::quad({-40, -1, -40}, {0, 0, 80}, {80, 0, 0}));
  test::add_shape(scene, test::sphere({3, 1, 0}, 1, 40));
  Mesh bumpy = test::sphere({0, 0, 0}, 1, 40);
  for (Vec3& p : bumpy.positions)
    p *= 1.0f + 0.05f * std::sin(9.0f * p.x) * std::sin(8.0f * p.y) * std::sin(7.0f * p.z);
  test::add_object(scene, bumpy);
  for (const DVec3 scale : {DVec3(1), DVec3(-1, 0.7, 1), DVec3(0.5, 1.5, 0.5)})
    for (const double z : {-4.0, 3.0, 30.0})
      scene.instances.push_back({0, Affine(test::placed({-2.5 * scale.y + 0.1 * z, 1, z}, scale, 25))});
  scene.instances.push_back({0, Affine(test::placed({0, 1, -60}))}); // behind the camera
  return scene;
}

Camera front() { return test::camera_at({1, 3, -10}, {0, 1, 0}); }

/// A scene at the level of detail of a view.
struct Detailed {
  Detailed(const test::BakedScene& baked, const PrimaryCamera& camera, double error_px, SharingConfig config)
      : geometries(lod_geometries(baked.file)), instances(lod_instances(baked.source)),
        sharing(geometries, instances, config),
        plan(sharing.plan(detail_view(camera, baked.file.world_bounds(), error_px))),
        source(baked.file, baked.source, sharing, plan) {}

  const std::vector<LodGeometry> geometries;
  const std::vector<LodInstance> instances;
  LodSharing sharing;
  const LodPlan plan;
  const LodSource source;
};

SharingConfig scheme(SharingScheme which) {
  SharingConfig config;
  config.scheme = which;
  return config;
}

BakeConfig with_levels() {
  BakeConfig config;
  config.lod = LodUse::kAll;
  return config;
}

GBuffer primary(const SceneSource& source, const RayTracer& tracer, const PrimaryCamera& camera) {
  GBuffer g;
  Progress progress;
  trace_primary(source, tracer, camera, camera, g, progress);
  return g;
}

class LodSourceTest : public testing::Test {
protected:
  const test::BakedScene baked_{scene_of_spheres(), with_levels()};
  const PrimaryCamera camera_{front(), kSize};
};

void expect_same_image(const GBuffer& a, const GBuffer& b) {
  EXPECT_EQ(a.instance, b.instance);
  EXPECT_EQ(a.triangle, b.triangle);
  EXPECT_EQ(a.view_z, b.view_z);
  EXPECT_EQ(a.position, b.position);
  EXPECT_EQ(a.normal, b.normal);
  EXPECT_EQ(a.material, b.material);
  EXPECT_EQ(a.offset, b.offset);
}

TEST_F(LodSourceTest, OfLevel0IsTheSceneItself) {
  const Detailed detailed(baked_, camera_, 1.0, scheme(SharingScheme::kOff));
  for (const LodGeometry& geometry : detailed.geometries)
    ASSERT_EQ(geometry.ranks_up_to(0.0), 0u) << "something coarser is exact, and then it may be used";
  const GBuffer expected = primary(baked_.source, EmbreeTracer(baked_.source, {}), camera_);
  ASSERT_GT(std::ranges::count_if(expected.instance, [](uint32_t i) { return i != kNoInstance; }), 2000);
  expect_same_image(primary(detailed.source, EmbreeTracer(detailed.source, {}), camera_), expected);
  expect_same_image(primary(detailed.source, PackedTracer(baked_.file, detailed.source), camera_),
                    primary(baked_.source, PackedTracer(baked_.file, baked_.source), camera_));
}

TEST_F(LodSourceTest, NumbersTrianglesAsItDecodesThem) {
  const Detailed detailed(baked_, camera_, 0.1, test::own_cuts());
  ASSERT_GT(detailed.source.geometry_count(), detailed.geometries.size());
  uint32_t coarse = 0;
  for (uint32_t b = 0; b < detailed.source.geometry_count(); ++b) {
    const GeometryCounts counts = detailed.source.counts(b);
    EXPECT_EQ(counts.triangles, detailed.plan.blas[b].triangles);
    EXPECT_EQ(detailed.source.clusters(b).size(), detailed.plan.blas[b].clusters);
    std::vector<Vec3> positions(counts.vertices);
    std::vector<Triangle> triangles(counts.triangles);
    detailed.source.decode(b, positions, triangles);
    for (const BlasCluster& c : detailed.source.clusters(b)) {
      const ClusterView view = baked_.file.cluster(c.geometry, c.cluster);
      const auto number = static_cast<uint32_t>(baked_.file.geometries()[c.geometry].first_cluster + c.cluster);
      coarse += c.level > 0;
      EXPECT_EQ(c.level == 0, c.error == 0.0f);
      for (uint32_t t = 0; t < view.triangle_count(); ++t) {
        ASSERT_EQ(detailed.source.triangle_number(b, number, t), c.first_triangle + t);
        const Triangle v = view.triangle(t), decoded = triangles[c.first_triangle + t];
        for (int corner = 0; corner < 3; ++corner) ASSERT_EQ(positions[decoded[corner]], view.position(v[corner]));
      }
    }
  }
  EXPECT_GT(coarse, 10u);
}

TEST_F(LodSourceTest, LooksUpManyPlacesAsItDoesOne) {
  const Detailed detailed(baked_, camera_, 0.1, {});
  const LodSource& source = detailed.source;
  std::vector<SurfaceQuery> places; // alternates between clusters and instances
  for (uint32_t n = 0; n < 3000; ++n) {
    const auto instance = n / 3 * 7 % static_cast<uint32_t>(source.instances().size());
    const uint32_t triangles = source.counts(source.instances()[instance].geometry).triangles;
    places.push_back({instance, n * 37 % triangles, Vec2(0.2f, 0.01f * static_cast<float>(n % 60))});
  }
  std::vector<SurfaceAttributes> found(places.size());
  source.look_up(places, found);
  uint32_t with_normal = 0;
  for (size_t i = 0; i < places.size(); ++i) {
    const SurfaceQuery& place = places[i];
    const uint32_t blas = source.instances()[place.instance].geometry;
    ASSERT_EQ(found[i].material, source.material_of(place.instance, place.triangle));
    // Each geometry has a single material here.
    ASSERT_EQ(found[i].material, baked_.source.material_of(place.instance, 0));
    const std::optional<Vec3> normal = source.shading_normal(blas, place.triangle, place.barycentrics);
    ASSERT_EQ(found[i].has_normal, normal.has_value());
    with_normal += found[i].has_normal;
    if (normal) {
      ASSERT_EQ(found[i].normal, *normal);
    }
  }
  EXPECT_GT(with_normal, 1000u);
}

TEST_F(LodSourceTest, IsTheSameForAllTracersAndAnyNumberOfThreads) {
  for (const SharingConfig& config : {test::own_cuts(), scheme(SharingScheme::kOneProvider), SharingConfig{}}) {
    const Detailed detailed(baked_, camera_, 0.1, config);
    ASSERT_GE(detailed.plan.builds, 2u);
    const PackedTracer packed(baked_.file, detailed.source);
    const GBuffer expected = primary(detailed.source, packed, camera_);
    const GBuffer embree = primary(detailed.source, EmbreeTracer(detailed.source, {}), camera_);
    size_t different = 0, hits = 0;
    for (size_t i = 0; i < kSize.pixels(); ++i) {
      hits += expected.instance[i] != kNoInstance;
      different += expected.instance[i] != embree.instance[i] ||
                   std::abs(expected.view_z[i] - embree.view_z[i]) > 1e-3f * embree.view_z[i];
    }
    EXPECT_GT(hits, 2000u);
    EXPECT_LE(different, 3u); // at silhouettes
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const Detailed again(baked_, camera_, 0.1, config);
    const PackedTracer alone(baked_.file, again.source);
    expect_same_image(primary(again.source, alone, camera_), expected);
    ASSERT_EQ(alone.lod_trees().trees.size(), packed.lod_trees().trees.size());
    for (size_t i = 0; i < alone.lod_trees().trees.size(); ++i) {
      EXPECT_EQ(alone.lod_trees().trees[i].built, packed.lod_trees().trees[i].built);
      EXPECT_LE(alone.lod_trees().trees[i].built, alone.lod_trees().trees[i].worst_case);
    }
  }
}

TEST_F(LodSourceTest, TracersTellWhatTheirTreesTake) {
  const Detailed detailed(baked_, camera_, 0.1, {});
  TracerConfig config;
  for (const Backend backend : {Backend::kEmbree, Backend::kPacked}) {
    config.backend = backend;
    const auto tracer = make_tracer(detailed.source, baked_.file, config);
    const std::vector<TreeBytes> trees = tracer->tree_bytes();
    EXPECT_EQ(std::ranges::count(trees, kNoGeometry, &TreeBytes::geometry), 1);
    EXPECT_GT(trees.size(), 2u);
    for (const TreeBytes& tree : trees) {
      EXPECT_TRUE(tree.geometry == kNoGeometry || tree.geometry < detailed.source.geometry_count());
      EXPECT_GT(tree.built, 0u);
      EXPECT_GE(tree.worst_case, tree.built);
    }
  }
}

double distance_to_triangle(DVec3 p, DVec3 a, DVec3 b, DVec3 c) {
  const auto to_segment = [&](DVec3 from, DVec3 to) {
    const DVec3 along = to - from;
    const double length2 = glm::dot(along, along);
    const double t = length2 > 0.0 ? std::clamp(glm::dot(p - from, along) / length2, 0.0, 1.0) : 0.0;
    return glm::length(p - from - t * along);
  };
  double nearest = std::min({to_segment(a, b), to_segment(b, c), to_segment(c, a)});
  const DVec3 n = glm::cross(b - a, c - a);
  const double n2 = glm::dot(n, n);
  if (!(n2 > 0.0)) return nearest;
  const double u = glm::dot(glm::cross(b - p, c - p), n) / n2, v = glm::dot(glm::cross(c - p, a - p), n) / n2;
  if (u >= 0.0 && v >= 0.0 && u + v <= 1.0) nearest = std::min(nearest, std::abs(glm::dot(p - a, n)) / std::sqrt(n2));
  return nearest;
}

/// World-space corners of an instance's triangles, three per triangle.
std::vector<DVec3> corners_of(const SceneSource& source, uint32_t instance) {
  const PlacedGeometry& placed = source.instances()[instance];
  const GeometryCounts counts = source.counts(placed.geometry);
  std::vector<Vec3> positions(counts.vertices);
  std::vector<Triangle> triangles(counts.triangles);
  source.decode(placed.geometry, positions, triangles);
  std::vector<DVec3> corners;
  for (const Triangle& t : triangles)
    for (int corner = 0; corner < 3; ++corner)
      corners.push_back(transform_point(DAffine(placed.world_from_object), DVec3(positions[t[corner]])));
  return corners;
}

/// Largest distance of visible points from the other source's surface of the same instance, in pixels at the point. The
/// bound holds at silhouettes, too, because it compares surfaces, not two images at a pixel.
double largest_distance_px(const GBuffer& seen, const SceneSource& other, const PrimaryCamera& camera) {
  std::vector<std::vector<DVec3>> corners(other.instances().size());
  double largest = 0.0;
  for (size_t i = 0; i < seen.instance.size(); i += 3) {
    if (seen.instance[i] == kNoInstance) continue;
    std::vector<DVec3>& own = corners[seen.instance[i]];
    if (own.empty()) own = corners_of(other, seen.instance[i]);
    const DVec3 p(seen.position[i]);
    double nearest = std::numeric_limits<double>::infinity();
    for (size_t c = 0; c < own.size(); c += 3)
      nearest = std::min(nearest, distance_to_triangle(p, own[c], own[c + 1], own[c + 2]));
    largest = std::max(largest, error_in_pixels(camera, p, nearest));
  }
  return largest;
}

TEST_F(LodSourceTest, SurfacesStayWithinTheErrorInPixels) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  constexpr double kRounding = 1e-3; // in pixels: positions are floats
  const GBuffer whole = primary(baked_.source, PackedTracer(baked_.file, baked_.source), camera_);
  for (const double error_px : {0.05, 0.2, 2.0})
    for (const SharingConfig& config : {test::own_cuts(), SharingConfig{}}) {
      const Detailed detailed(baked_, camera_, error_px, config);
      const GBuffer seen = primary(detailed.source, PackedTracer(baked_.file, detailed.source), camera_);
      const double there = largest_distance_px(seen, baked_.source, camera_);
      EXPECT_LE(there, error_px + kRounding);
      EXPECT_GT(there, 0.02 * error_px); // Some surface is simplified.
      EXPECT_LE(largest_distance_px(whole, detailed.source, camera_), error_px + kRounding);
      for (size_t i = 0; i < seen.instance.size(); ++i) {
        if (seen.instance[i] == kNoInstance) continue;
        const SurfaceDetail detail = detailed.source.detail_of(seen.instance[i], seen.triangle[i]);
        EXPECT_LE(error_in_pixels(camera_, DVec3(seen.position[i]), static_cast<double>(detail.error_world)),
                  error_px * 1.001);
      }
    }
}

TEST_F(LodSourceTest, InstancesOutsideTheViewAreSeenByNoCameraRay) {
  const Detailed detailed(baked_, camera_, 1.0, {});
  const std::vector<uint8_t> outside = outside_view(camera_, detailed.geometries, detailed.instances);
  const GBuffer seen = primary(baked_.source, PackedTracer(baked_.file, baked_.source), camera_);
  for (const uint32_t instance : seen.instance)
    if (instance != kNoInstance) {
      EXPECT_EQ(outside[instance], 0) << instance;
    }
  EXPECT_EQ(outside.back(), 1); // behind the camera
  EXPECT_EQ(std::ranges::count(outside, 1), 1);
}

TEST(LodView, APixelIsAsWideAsNeighbouringRaysAreApart) {
  Camera camera = front();
  camera.world_from_camera =
      compose(camera.world_from_camera, DAffine(DVec3(2, 0, 0), DVec3(0, 2, 0), DVec3(0, 0, 2), DVec3(0)));
  for (const Projection projection : {Projection::kPerspective, Projection::kOrthographic, Projection::kEnvironment}) {
    camera.projection = projection;
    const PrimaryCamera view(camera, {200, 100});
    const CameraRay a = view.ray(99, 49), b = view.ray(99, 50);
    const double apart = projection == Projection::kOrthographic ? glm::length(a.origin - b.origin)
                                                                 : glm::length(a.direction - b.direction);
    EXPECT_NEAR(view.pixel_spread(), apart, 1e-3 * apart);
    const DetailView from = detail_view(view, Bounds{DVec3(-9), DVec3(9)}, 1.0);
    const double distance = std::max(from.near, glm::length(a.origin - view.eye()) + 5.0);
    const double allowed = from.error_per_distance * distance;
    EXPECT_NEAR(error_in_pixels(view, a.origin + 5.0 * a.direction, allowed), 1.0, 0.02);
  }
}

} // namespace
} // namespace packtrace
