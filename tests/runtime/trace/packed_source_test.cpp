#include "runtime/trace/source/packed_source.h"

#include <cmath>

#include <gtest/gtest.h>

#include "compress/bake/bake_scene.h"
#include "compress/format/file/baked_file.h"
#include "runtime/camera/primary_visibility.h"
#include "runtime/trace/source/float_source.h"
#include "tests/runtime/trace/test_scenes.h"

namespace packtrace {
namespace {

using test::add_object;
using test::add_shape;

BakedFile bake(const Scene& scene, BakeConfig config = {}) {
  Diagnostics diagnostics;
  Progress progress;
  return BakedFile::from_bytes(bake_to_bytes(scene, config, diagnostics, progress).bytes);
}

/// A floor, a masked screen, a glass sphere and three instances of a smooth sphere, one of them mirrored.
Scene cubes_scene() {
  Scene scene;
  add_shape(scene, test::quad({-8, 0, -8}, {0, 0, 16}, {16, 0, 0}));
  add_shape(scene, test::quad({-4, 0, 4}, {8, 0, 0}, {0, 5, 0}), kAlphaMask);
  scene.masks.push_back({64, 1, WrapMode::kRepeat, Vec2(4, 1), Vec2(0), {0u, ~0u}});
  scene.materials[1].alpha_mask = 0;
  add_shape(scene, test::sphere({3, 1, 0}, 1, 24), kTransmissive);
  add_object(scene, test::sphere({0, 0, 0}, 1, 32));
  scene.materials[3].albedo = Vec3(0.9f, 0.5f, 0.1f);
  for (const DVec3 scale : {DVec3(1), DVec3(-1, 0.7, 1), DVec3(0.5, 1.5, 0.5)})
    scene.instances.push_back({0, Affine(test::placed({-2.5 * scale.y, 1, 4 * scale.x - 4}, scale, 25))});
  return scene;
}

struct Image {
  GBuffer gbuffer;
  AoFrame ao;
};

Image render(const SceneSource& source) {
  const EmbreeTracer embree(source, {});
  const PrimaryCamera camera(test::camera_at({2, 5, -10}, {0, 1, 0}), {160, 90});
  AoConfig config;
  config.radius = 4;
  config.spp = 16;
  Progress progress;
  Image image;
  trace_primary(source, embree, camera, camera, image.gbuffer, progress);
  trace_ao(source, embree, image.gbuffer, config, 0, image.ao, progress);
  return image;
}

TEST(PackedSource, LooksUpManyPlacesAsItDoesOne) {
  const Scene scene = cubes_scene();
  const BakedFile file = bake(scene);
  const PackedSource packed(file);
  const FloatSource floats(scene);
  for (const SceneSource* source :
       {static_cast<const SceneSource*>(&packed), static_cast<const SceneSource*>(&floats)}) {
    std::vector<SurfaceQuery> places; // alternates between clusters and instances
    for (uint32_t n = 0; n < 5000; ++n) {
      const auto instance = n / 3 * 7 % static_cast<uint32_t>(source->instances().size());
      const uint32_t triangles = source->counts(source->instances()[instance].geometry).triangles;
      places.push_back({instance, n * 37 % triangles, Vec2(0.2f, 0.01f * static_cast<float>(n % 60))});
    }
    std::vector<SurfaceAttributes> found(places.size());
    source->look_up(places, found);
    uint32_t with_normal = 0;
    for (size_t i = 0; i < places.size(); ++i) {
      const SurfaceQuery& place = places[i];
      const uint32_t geometry = source->instances()[place.instance].geometry;
      ASSERT_EQ(found[i].material, source->material_of(place.instance, place.triangle)) << i;
      const auto normal = source->shading_normal(geometry, place.triangle, place.barycentrics);
      ASSERT_EQ(found[i].has_normal, normal.has_value()) << i;
      if (normal) {
        ++with_normal;
        ASSERT_EQ(found[i].normal, *normal) << i;
      }
    }
    EXPECT_GT(with_normal, 1000u);
    EXPECT_LT(with_normal, 4500u);
  }
}

TEST(PackedSource, NormalsOfTrianglesInterpolateToThoseOfPlaces) {
  const Scene scene = cubes_scene();
  const BakedFile file = bake(scene);
  const PackedSource source(file);
  std::vector<SurfaceQuery> places; // alternates between clusters and instances
  for (uint32_t n = 0; n < 5000; ++n) {
    const auto instance = n / 3 * 7 % static_cast<uint32_t>(source.instances().size());
    const uint32_t triangles = source.counts(source.instances()[instance].geometry).triangles;
    places.push_back({instance, n * 37 % triangles, Vec2(0.2f, 0.01f * static_cast<float>(n % 60))});
  }
  std::vector<SurfaceAttributes> found(places.size());
  std::vector<TriangleAttributes> triangles(places.size());
  source.look_up(places, found);
  ASSERT_TRUE(source.look_up_triangles(places, triangles));
  for (size_t i = 0; i < places.size(); ++i) {
    const std::array<Vec3, 3>& corners = triangles[i].normals;
    ASSERT_EQ(triangles[i].material, found[i].material) << i;
    const Vec3 n =
        interpolated_normal(corners[0], corners[1], corners[2], places[i].barycentrics.x, places[i].barycentrics.y);
    ASSERT_EQ(glm::length(n) > 0.0f, found[i].has_normal) << i;
    if (!found[i].has_normal) continue;
    ASSERT_EQ(n / glm::length(n), found[i].normal) << i;
  }
}

TEST(PackedSource, FloatsDoNotInterpolateNormalsOfTriangles) {
  const Scene scene = cubes_scene();
  const FloatSource floats(scene);
  std::vector<TriangleAttributes> out(1);
  EXPECT_FALSE(floats.look_up_triangles(std::vector<SurfaceQuery>(1), out));
}

TEST(PackedSource, RendersTheImageOfTheFloats) {
  const Scene scene = cubes_scene();
  const BakedFile file = bake(scene);
  const PackedSource packed(file);
  const FloatSource floats(scene);
  ASSERT_EQ(packed.instances().size(), floats.instances().size());
  const Image a = render(packed), b = render(floats);
  uint32_t different = 0, hits = 0;
  std::vector<float> differences;
  double sum = 0.0;
  for (size_t i = 0; i < a.ao.ao.size(); ++i) {
    if (a.gbuffer.instance[i] != b.gbuffer.instance[i]) {
      ++different;
      continue;
    }
    if (a.gbuffer.instance[i] == kNoInstance) continue;
    ++hits;
    EXPECT_EQ(a.gbuffer.albedo[i], b.gbuffer.albedo[i]);
    EXPECT_NEAR(a.gbuffer.view_z[i], b.gbuffer.view_z[i], 0.05f);
    differences.push_back(std::abs(a.ao.ao[i] - b.ao.ao[i]));
    sum += double{differences.back()};
  }
  EXPECT_GT(hits, 5000u);
  EXPECT_LT(different, 100u); // silhouettes
  EXPECT_LT(sum / hits, 0.005);
  const auto p99 = differences.begin() + static_cast<ptrdiff_t>(differences.size() * 99 / 100);
  std::ranges::nth_element(differences, p99);
  EXPECT_LE(*p99, 0.05f);
}

TEST(PackedSource, InstancesOfOneGeometryHaveMaterialsAndMasksOfTheirOwn) {
  Scene scene;
  add_shape(scene, test::quad({-8, 0, -8}, {0, 0, 16}, {16, 0, 0}));
  scene.masks.push_back({64, 1, WrapMode::kRepeat, Vec2(4, 1), Vec2(0), {0u, ~0u}});
  scene.masks.push_back({32, 4, WrapMode::kRepeat, Vec2(1, 3), Vec2(0), {~0u, 0u, ~0u, 0u}});
  const auto mesh = static_cast<uint32_t>(scene.meshes.size());
  scene.meshes.push_back(test::sphere({0, 0, 0}, 1, 24));
  for (uint32_t i = 0; i < 4; ++i) { // two without masks, two with different masks
    Material material;
    material.albedo = Vec3(0.2f * static_cast<float>(i), 0.5f, 0.1f);
    if (i > 1) material.flags = kAlphaMask, material.alpha_mask = i - 2;
    scene.materials.push_back(material);
    scene.shapes.emplace_back(mesh, i + 1, false, test::placed({2.5 * i - 4, 1, 0}));
  }
  const BakedFile file = bake(scene);
  ASSERT_EQ(file.geometries().size(), 3u); // floor, sphere without texture coordinates, sphere with them
  const Image a = render(PackedSource(file)), b = render(FloatSource(scene));
  uint32_t different = 0;
  std::array<uint32_t, 5> seen{};
  for (size_t i = 0; i < a.ao.ao.size(); ++i) {
    if (a.gbuffer.instance[i] != b.gbuffer.instance[i]) {
      ++different;
      continue;
    }
    if (a.gbuffer.instance[i] == kNoInstance) continue;
    ++seen[a.gbuffer.instance[i]];
    EXPECT_EQ(a.gbuffer.albedo[i], b.gbuffer.albedo[i]);
    EXPECT_EQ(a.gbuffer.material[i], b.gbuffer.material[i]);
  }
  for (const uint32_t pixels : seen) EXPECT_GT(pixels, 100u);
  EXPECT_LT(different, 150u); // silhouettes, including those of the masks
}

TEST(PackedSource, LevelsOfDetailAreNotTraced) {
  BakeConfig config;
  config.lod = LodUse::kAll;
  const BakedFile without = bake(cubes_scene()), with = bake(cubes_scene(), config);
  ASSERT_GT(with.geometries().size(), without.geometries().size());
  EXPECT_EQ(PackedSource(with).geometry_count(), PackedSource(without).geometry_count());
  EXPECT_EQ(render(PackedSource(with)).ao.ao, render(PackedSource(without)).ao.ao);
}

TEST(PackedSource, DecodedTrianglesMatchRandomAccess) {
  const BakedFile file = bake(cubes_scene());
  const PackedSource source(file);
  for (uint32_t i = 0; i < source.instances().size(); ++i) {
    const uint32_t g = source.instances()[i].geometry;
    const GeometryCounts counts = source.counts(g);
    std::vector<Vec3> positions(counts.vertices);
    std::vector<Triangle> triangles(counts.triangles);
    source.decode(g, positions, triangles);
    for (uint32_t t = 0; t < counts.triangles; ++t) {
      const uint32_t c = file.cluster_of_triangle(g, t);
      const ClusterView cluster = file.cluster(g, c);
      const Triangle local = cluster.triangle(t - cluster.record().first_triangle);
      for (int k = 0; k < 3; ++k) ASSERT_EQ(positions[triangles[t][k]], cluster.position(local[k]));
      ASSERT_EQ(source.material_of(i, t), file.instance_materials(i)[cluster.material_slot()]);
    }
  }
}

TEST(PackedSource, PositionErrorBoundsTheDecodedSurface) {
  Scene scene;
  add_shape(scene, test::sphere({0, 0, 0}, 1, 48));
  BakeConfig config;
  config.precision_kind = PrecisionKind::kPositionBits;
  config.precision = 10;
  const BakedFile file = bake(scene, config);
  const PackedSource source(file);
  const GeometryCounts counts = source.counts(0);
  std::vector<Vec3> positions(counts.vertices);
  std::vector<Triangle> triangles(counts.triangles);
  source.decode(0, positions, triangles);
  const double bound = source.position_error(0);
  EXPECT_GT(bound, 1e-4);
  EXPECT_LT(bound, 2e-3);
  for (const Vec3 p : positions) EXPECT_LE(std::abs(glm::length(DVec3(p)) - 1.0), bound * std::sqrt(3.0) + 1e-6);
}

} // namespace
} // namespace packtrace
