#include "runtime/trace/packed/scene/deformed_tree.h"

#include <algorithm>
#include <cstring>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "runtime/trace/embree/embree_tracer.h"
#include "tests/runtime/trace/moved_scenes.h"
#include "tests/sanitized.h"

namespace packtrace {
namespace {

using test::any;
using test::BakedScene;
using test::closest;
using test::DeformedSource;
using test::isas;
using test::kMovingSphere;
using test::Motion;
using test::MovedVertices;
using test::moving_scene;
using test::random_rays;
using test::range_of;
using test::wave;

const Bounds kNear{{-5, -2, -5}, {16, 4, 6}};

std::vector<Motion> waves(int count) {
  std::vector<Motion> frames;
  for (int i = 0; i < count; ++i) frames.push_back(wave(0.5 * i));
  return frames;
}

/// Compares with Embree over the decoded vertices of the frame.
void expect_embree_agrees(const BakedScene& scene, const PackedTracer& tracer, const MovedVertices& frame,
                          uint32_t seed) {
  const DeformedSource source(scene, {nullptr, &frame});
  const EmbreeTracer embree(source, {});
  const std::vector<Ray> rays = random_rays(test::fewer(20000u), kNear, tracer.space(), seed);
  const std::vector<Ray> same = random_rays(test::fewer(20000u), kNear, embree.space(), seed);
  const std::vector<RayHit> hits = closest(tracer, rays), expected = closest(embree, same);
  const std::vector<uint8_t> occluded = any(tracer, rays);
  size_t found = 0, different = 0;
  for (size_t i = 0; i < rays.size(); ++i) {
    ASSERT_EQ(occluded[i] != 0, hits[i].valid()) << i;
    found += expected[i].valid();
    different += hits[i].valid() != expected[i].valid() ||
                 (hits[i].valid() && std::abs(hits[i].t - expected[i].t) > 1e-4f * expected[i].t + 5e-6f);
  }
  EXPECT_GT(found, test::fewer(2000u));
  EXPECT_LE(different, 3u); // rays so close to an edge that rounding decides
}

TEST(DeformedTree, EachFrameIsHitWhereEmbreeHitsItsDecodedVertices) {
  for (const uint32_t instances : {1u, 4u, 20u}) {
    const BakedScene scene(moving_scene(instances));
    const std::vector<Motion> frames = waves(test::sanitized() ? 2 : 6);
    const DeformingGeometry moving = range_of(scene.file, kMovingSphere, frames);
    for (const PackedIsa isa : isas()) {
      PackedTracer tracer(scene.file, scene.source, {&moving, 1}, {}, isa);
      expect_embree_agrees(scene, tracer, MovedVertices(scene.file, moving, [](DVec3 p) { return p; }), 1);
      for (size_t i = 0; i < frames.size(); ++i) {
        const MovedVertices frame(scene.file, moving, frames[i]);
        EXPECT_FALSE(tracer.deform(kMovingSphere, frame).rebuilt);
        expect_embree_agrees(scene, tracer, frame, static_cast<uint32_t>(i));
      }
    }
  }
}

TEST(DeformedTree, AllInstructionSetsFindTheSame) {
  const BakedScene scene(moving_scene(12));
  const std::vector<Motion> frames = waves(3);
  const DeformingGeometry moving = range_of(scene.file, kMovingSphere, frames);
  std::vector<RayHit> expected;
  for (const PackedIsa isa : isas()) {
    PackedTracer tracer(scene.file, scene.source, {&moving, 1}, {}, isa);
    const std::vector<Ray> rays = random_rays(test::fewer(20000u), kNear, tracer.space(), 3);
    for (const Motion& frame : frames) tracer.deform(kMovingSphere, MovedVertices(scene.file, moving, frame));
    const std::vector<RayHit> hits = closest(tracer, rays);
    if (expected.empty()) expected = hits;
    EXPECT_EQ(std::memcmp(hits.data(), expected.data(), hits.size() * sizeof(RayHit)), 0) << tracer.isa();
  }
}

DeformedTree tree_of(const BakedScene& scene, const DeformingGeometry& moving, const TracedTrees& traced,
                     const DeformConfig& config = {}) {
  const uint32_t number = traced.tree_of[moving.geometry];
  const baked::TreeRecord& record = traced.records[number];
  const baked::GeometryRecord& geometry = scene.file.geometries()[moving.geometry];
  return {scene.file,
          moving,
          record,
          traced.nodes.subspan(static_cast<size_t>(record.first_node), record.node_count),
          traced.clusters().subspan(static_cast<size_t>(geometry.first_cluster), geometry.cluster_count),
          config};
}

TEST(DeformedTree, BoxesDoNotDependOnTheFramesBefore) {
  const BakedScene scene(moving_scene());
  const std::vector<Motion> frames = waves(5);
  const DeformingGeometry moving = range_of(scene.file, kMovingSphere, frames);
  const TracedTrees traced = whole_trees(scene.file);
  const DeformConfig never{.max_growth = 4.0};
  DeformedTree all = tree_of(scene, moving, traced, never), last = tree_of(scene, moving, traced, never);
  for (const Motion& frame : frames) ASSERT_FALSE(all.update(MovedVertices(scene.file, moving, frame)).rebuilt);
  last.update(MovedVertices(scene.file, moving, frames.back()));
  ASSERT_EQ(all.nodes().size(), last.nodes().size());
  EXPECT_EQ(std::memcmp(all.nodes().data(), last.nodes().data(), all.nodes().size_bytes()), 0);
  EXPECT_EQ(all.area(), last.area());
}

TEST(DeformedTree, InTheFilesPoseNodesAreThoseOfTheFile) {
  const BakedScene scene(moving_scene());
  const TracedTrees traced = whole_trees(scene.file);
  const DeformingGeometry moving = range_of(scene.file, kMovingSphere, {});
  const DeformedTree tree = tree_of(scene, moving, traced);
  const baked::TreeRecord& record = traced.records[traced.tree_of[kMovingSphere]];
  ASSERT_EQ(tree.record().origin, record.origin);
  ASSERT_EQ(tree.nodes().size(), record.node_count);
  EXPECT_EQ(std::memcmp(tree.nodes().data(), traced.nodes.data() + record.first_node, tree.nodes().size_bytes()), 0);
}

/// Sends each vertex somewhere else: neighbours end far apart, and clusters need wider fields than the file's.
DVec3 scattered(DVec3 p) {
  const auto part = [](double x) { return x - std::floor(x); };
  return {4.0 * part(917.3 * p.x + 31.7 * p.y + 3.1 * p.z) - 2.0, 4.0 * part(513.1 * p.y + 77.9 * p.z) - 2.0,
          4.0 * part(331.9 * p.z + 91.3 * p.x) - 2.0};
}

TEST(DeformedTree, IsRebuiltOnceItsAreaHasGrownTooMuch) {
  const BakedScene scene(moving_scene());
  const std::vector<Motion> frames{[](DVec3 p) { return DVec3(p.x + 0.5 * p.y, p.y, p.z); },
                                   [](DVec3 p) { return 1.5 * p; }, [](DVec3 p) { return p + 0.08 * scattered(p); }};
  const DeformingGeometry moving = range_of(scene.file, kMovingSphere, frames);
  const TracedTrees traced = whole_trees(scene.file);
  DeformedTree tree = tree_of(scene, moving, traced), stubborn = tree_of(scene, moving, traced, {.max_growth = 4.0});
  EXPECT_FALSE(tree.update(MovedVertices(scene.file, moving, frames[0])).rebuilt);
  EXPECT_NEAR(tree.update(MovedVertices(scene.file, moving, frames[1])).growth, 1.0, 0.01); // only the size differs
  const MovedVertices apart(scene.file, moving, frames[2]);
  const DeformStep step = tree.update(apart);
  EXPECT_TRUE(step.rebuilt);
  EXPECT_GT(step.growth, 1.5);
  EXPECT_LT(step.growth, 4.0);
  EXPECT_FALSE(stubborn.update(apart).rebuilt);
  EXPECT_LT(tree.area(), stubborn.area());
  const DeformStep again = tree.update(apart); // compared with the rebuilt tree now
  EXPECT_FALSE(again.rebuilt);
  EXPECT_EQ(again.growth, 1.0);
}

TEST(DeformedTree, FramesAreHitAfterARebuildAndInWiderFields) {
  const BakedScene scene(moving_scene(10));
  const std::vector<Motion> frames{scattered, wave(1.0), scattered};
  const DeformingGeometry moving = range_of(scene.file, kMovingSphere, frames);
  PackedTracer tracer(scene.file, scene.source, {&moving, 1});
  size_t rebuilt = 0;
  for (const Motion& motion : frames) {
    const MovedVertices frame(scene.file, moving, motion);
    rebuilt += tracer.deform(kMovingSphere, frame).rebuilt;
    expect_embree_agrees(scene, tracer, frame, 5);
  }
  EXPECT_GE(rebuilt, 1u);
}

TEST(DeformedTree, AFrameIsHitLikeAFileBakedFromItsPositions) {
  Scene living = moving_scene(0);
  living.shapes.clear(); // the ground would lie on another grid in the second file
  living.instances.push_back({0, Affine(test::placed({1, 1, 0}))});
  const BakedScene scene(living);
  const std::vector<Motion> frames{wave(2.0)};
  const DeformingGeometry moving = range_of(scene.file, 0, frames);
  const MovedVertices frame(scene.file, moving, frames[0]);
  PackedTracer tracer(scene.file, scene.source, {&moving, 1});
  tracer.deform(0, frame);

  Scene frozen = living;
  const DeformedSource source(scene, {&frame});
  Mesh mesh;
  mesh.positions.resize(source.counts(0).vertices);
  mesh.triangles.resize(source.counts(0).triangles);
  source.decode(0, mesh.positions, mesh.triangles);
  frozen.meshes[frozen.objects[0].shapes[0].mesh] = mesh;
  BakeConfig config; // the same grid: its step is at most the one asked for
  const baked::GeometryRecord& record = scene.file.geometries()[0];
  const PositionGrid grid{record.step_mantissa, record.step_exponent};
  config.precision_kind = PrecisionKind::kAbsolute, config.precision = grid.step();
  const BakedScene again(frozen, config);
  ASSERT_EQ(again.file.geometries()[0].step_exponent, record.step_exponent);
  ASSERT_EQ(again.file.geometries()[0].step_mantissa, record.step_mantissa);
  const PackedTracer fresh(again.file, again.source);
  const std::vector<RayHit> hits = closest(tracer, random_rays(20000, kNear, tracer.space(), 2)),
                            expected = closest(fresh, random_rays(20000, kNear, fresh.space(), 2));
  size_t found = 0, different = 0;
  for (size_t i = 0; i < hits.size(); ++i) {
    found += hits[i].valid();
    different += hits[i].valid() != expected[i].valid() ||
                 (hits[i].valid() && std::abs(hits[i].t - expected[i].t) > 1e-5f * expected[i].t);
  }
  EXPECT_GT(found, 500u);
  EXPECT_LE(different, 2u);
}

TEST(DeformedTree, PreviousVerticesAreThoseOfTheFrameBefore) {
  const BakedScene scene(moving_scene());
  const std::vector<Motion> frames = waves(4);
  const DeformingGeometry moving = range_of(scene.file, kMovingSphere, frames);
  PackedTracer tracer(scene.file, scene.source, {&moving, 1});
  const MovedVertices before(scene.file, moving, frames[2]), now(scene.file, moving, frames[3]);
  tracer.deform(kMovingSphere, before);
  tracer.deform(kMovingSphere, now);
  const DeformedSource old_source(scene, {nullptr, &before});
  std::vector<Vec3> positions(old_source.counts(kMovingSphere).vertices);
  std::vector<Triangle> triangles(old_source.counts(kMovingSphere).triangles);
  old_source.decode(kMovingSphere, positions, triangles);
  const baked::GeometryRecord& record = scene.file.geometries()[kMovingSphere];
  const double step = PositionGrid{record.step_mantissa, record.step_exponent}.step();
  size_t moved = 0, still = 0;
  for (const RayHit& hit : closest(tracer, random_rays(20000, kNear, tracer.space(), 4))) {
    if (!hit.valid()) continue;
    const HitSurface surface = tracer.resolve(hit);
    Vec3 vertices[3];
    tracer.previous_vertices(hit, vertices);
    for (int corner = 0; corner < 3; ++corner) {
      if (surface.geometry != kMovingSphere) {
        EXPECT_EQ(vertices[corner], surface.vertices[corner]);
        ++still;
        continue;
      }
      const Vec3 expected = positions[triangles[surface.triangle][corner]];
      EXPECT_LT(glm::distance(DVec3(vertices[corner]) * step, DVec3(expected)), 1e-6); // the tree's origin is 0
      moved += vertices[corner] != surface.vertices[corner];
    }
  }
  EXPECT_GT(moved, 1000u);
  EXPECT_GT(still, 100u);
}

TEST(DeformedTree, NoRayLeavesAClosedSurfaceThatMoves) {
  if (test::sanitized()) GTEST_SKIP() << test::kOthersRunItsCode;
  Scene closed;
  test::add_object(closed, test::sphere({0, 0, 0}, 1, 48));
  closed.instances.push_back({0, Affine(1.0f)});
  const BakedScene scene(closed);
  const std::vector<Motion> frames = waves(4);
  const DeformingGeometry moving = range_of(scene.file, 0, frames);
  for (const PackedIsa isa : isas()) {
    PackedTracer tracer(scene.file, scene.source, {&moving, 1}, {}, isa);
    for (const Motion& motion : frames) {
      const MovedVertices frame(scene.file, moving, motion);
      tracer.deform(0, frame);
      std::vector<Ray> rays;
      const DVec3 centre = tracer.space().to_unit(motion(DVec3(0.0)));
      for (uint32_t c = 0; c < scene.file.clusters(0).size(); ++c)
        for (uint32_t v = 0; v < scene.file.clusters(0)[c].vertex_count; ++v) { // at vertices and between two
          const DVec3 a(frame.position(c, v)), b(frame.position(c, v > 0 ? v - 1 : v));
          for (const DVec3& target : {a, 0.5 * (a + b)})
            rays.push_back({Vec3(centre), 0.0f, Vec3(tracer.space().to_unit(target) - centre)});
        }
      for (const RayHit& hit : closest(tracer, rays)) ASSERT_TRUE(hit.valid()) << tracer.isa();
    }
  }
}

TEST(DeformedTree, RejectsWhatItCannotHold) {
  const BakedScene scene(moving_scene());
  const std::vector<Motion> frames = waves(2);
  const DeformingGeometry moving = range_of(scene.file, kMovingSphere, frames);
  PackedTracer tracer(scene.file, scene.source, {&moving, 1});
  const MovedVertices outside(scene.file, moving, [](DVec3 p) { return p + DVec3(10, 0, 0); });
  EXPECT_THROW(tracer.deform(kMovingSphere, outside), Error);
  EXPECT_THROW(tracer.deform(0, outside), Error); // the ground does not deform
  const auto refused = [&](std::vector<DeformingGeometry> geometries, const DeformConfig& config = {}) {
    EXPECT_THROW(PackedTracer(scene.file, scene.source, geometries, config), Error);
  };
  refused({moving, moving});
  refused({{7, moving.range}});
  refused({{0, moving.range}}); // in the world's tree
  refused({moving}, {.max_growth = 0.9});
  refused({moving}, {.max_growth = 4.1});
  DeformingGeometry small = moving, huge = moving;
  small.range.hi[1] = small.range.lo[1] + 1; // the file's vertices lie outside
  huge.range.hi[2] = huge.range.lo[2] + kMaxFrameExtent + 1;
  refused({small});
  refused({huge});
}

} // namespace
} // namespace packtrace
