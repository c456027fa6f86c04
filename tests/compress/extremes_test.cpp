#include <algorithm>
#include <array>
#include <cfloat>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <tbb/global_control.h>
#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

#include "compress/format/cluster/position_grid.h"
#include "pbrt_import/base/error.h"
#include "tests/compress/extremes_check.h"
#include "tests/compress/test_scenes.h"
#include "tests/pbrt_import/scene_folder.h"
#include "tests/sanitized.h"

namespace packtrace {
namespace {

using test::bake;
using test::Decoded;
using test::expect_holds;
using test::scene_of;
using test::Source;
using test::source_of;

BakeConfig precision(PrecisionKind kind, double value) {
  BakeConfig config;
  config.precision_kind = kind;
  config.precision = value;
  return config;
}

void expect_survives(const Mesh& mesh, const DAffine& transform = DAffine(1.0), const BakeConfig& config = {}) {
  const BakedScene baked = bake(scene_of(mesh, transform), config);
  expect_holds(BakedFile::from_bytes(baked.bytes), 0, source_of(mesh, transform));
}

/// While it exists, this thread reads and writes subnormal floats as 0.
class FlushToZero {
public:
#if defined(__SSE2__)
  FlushToZero() : before_(_mm_getcsr()) { _mm_setcsr(before_ | 0x8040u); } // FTZ and DAZ
  ~FlushToZero() { _mm_setcsr(before_); }
  static constexpr bool kAvailable = true;

private:
  unsigned before_;
#else
  static constexpr bool kAvailable = false;
#endif
};

TEST(Extremes, EveryScaleThatFloatsHold) {
  for (int exponent = -38; exponent <= 37; exponent += test::sanitized() ? 15 : 1) {
    SCOPED_TRACE("scale 1e" + std::to_string(exponent));
    const DAffine scale = test::scaling(DVec3(std::pow(10.0, exponent)));
    expect_survives(test::sphere_mesh(9), scale);
    expect_survives(test::sphere_mesh(9), scale, precision(PrecisionKind::kPositionBits, 24.0));
    expect_survives(test::sphere_mesh(9), scale, precision(PrecisionKind::kDiagonalFraction, 1e-6));
  }
}

void expect_refused(const Scene& scene, const BakeConfig& config, const std::string& message) {
  try {
    (void)bake(scene, config);
    FAIL() << "was baked";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kLimitExceeded) << error.what();
    EXPECT_NE(std::string(error.what()).find(message), std::string::npos) << error.what();
  }
}

TEST(Extremes, TheLargestFloats) {
  for (const float radius : {1e38f, 3e38f, FLT_MAX}) {
    SCOPED_TRACE(radius);
    expect_survives(test::sphere_mesh(9, radius));
  }
  // With steps of 2^126 the nearest lattice point is 2^128, which exceeds the float range.
  expect_refused(scene_of(test::sphere_mesh(9, FLT_MAX)), precision(PrecisionKind::kPositionBits, 3.0),
                 "sphere: coordinates up to 3.4e+38 round to more than the largest float at a step of 9.57e+37");
}

TEST(Extremes, ScalesThatNoGridHoldsAreRefused) {
  Scene scene = scene_of(test::sphere_mesh(20), test::scaling(DVec3(1e-30)));
  test::add_shape(scene, test::sphere_mesh(4), test::scaling(DVec3(1e30)));
  expect_refused(scene, {}, "exceed the lattice limit");
}

TEST(Extremes, PlacesFarFromTheOrigin) {
  for (const double distance : {1e3, 1e5, 1e7, -1e7, 1e9, 1e12})
    for (const double scale : {1e-20, 1.0, 1e20}) {
      SCOPED_TRACE("at " + std::to_string(distance) + " extents, scale " + std::to_string(scale));
      const DVec3 place(distance * scale, 0.0, -distance * scale);
      expect_survives(test::sphere_mesh(9), compose(test::translation(place), test::scaling(DVec3(scale))));
    }
}

TEST(Extremes, AxesWithoutExtent) {
  for (uint32_t axes = 0; axes < 8; ++axes)
    for (const double place : {0.0, 1.0, -1e10, 1e-35}) {
      SCOPED_TRACE("axes " + std::to_string(axes) + " at " + std::to_string(place));
      const auto size = [&](uint32_t axis) { return (axes & axis) != 0 ? 1.0 : 0.0; };
      expect_survives(test::sphere_mesh(7),
                      compose(test::translation(DVec3(place)), test::scaling({size(1), size(2), size(4)})));
    }
}

TEST(Extremes, SubnormalPositions) {
  for (const double scale : {1e-38, 1e-40, 1e-42, 1e-44, 1e-45, 1e-50}) {
    SCOPED_TRACE(scale);
    expect_survives(test::sphere_mesh(9), test::scaling(DVec3(scale)));
    Mesh mesh = test::sphere_mesh(9); // scaled in the source's floats
    for (Vec3& p : mesh.positions) p = Vec3(DVec3(p) * scale);
    expect_survives(mesh);
  }
}

TEST(Extremes, FlushingSubnormalsChangesNothingElse) {
  if (!FlushToZero::kAvailable) GTEST_SKIP() << "no such mode on this processor";
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  for (const double scale : {1e-30, 1.0, 1e30}) {
    SCOPED_TRACE(scale);
    const Mesh mesh = test::grid_mesh(30, 0.2f, true);
    const Scene scene = scene_of(mesh, compose(test::translation(DVec3(scale)), test::scaling(DVec3(scale))));
    const std::vector<std::byte> expected = bake(scene).bytes;
    const Decoded plain = test::decode(BakedFile::from_bytes(expected), 0);
    const FlushToZero flush;
    EXPECT_TRUE(bake(scene).bytes == expected);
    const Decoded flushed = test::decode(BakedFile::from_bytes(expected), 0);
    EXPECT_EQ(flushed.positions, plain.positions);
    EXPECT_EQ(flushed.normals, plain.normals);
    EXPECT_EQ(flushed.triangles, plain.triangles);
  }
}

TEST(Extremes, SubnormalPositionsMoveByNoMoreThanTheirSizeWhenFlushed) {
  if (!FlushToZero::kAvailable) GTEST_SKIP() << "no such mode on this processor";
  for (const double scale : {1e-36, 1e-38, 1e-40, 1e-44}) {
    SCOPED_TRACE(scale);
    const Mesh mesh = test::sphere_mesh(9);
    const DAffine transform = test::scaling(DVec3(scale));
    const Source source = source_of(mesh, transform);
    const BakedFile file = BakedFile::from_bytes(bake(scene_of(mesh, transform)).bytes);
    const FlushToZero flush;
    expect_holds(file, 0, source, double{FLT_MIN});
  }
}

TEST(Extremes, OneVertexAndOneTriangle) {
  Mesh point;
  point.positions = {Vec3(3.0f, -4.0f, 5.0f)};
  expect_survives(point); // no triangle, so nothing is stored
  for (const Vec3 second : {Vec3(1, 0, 0), Vec3(1e-30f, 0, 0), Vec3(1e30f, 0, 0)}) {
    Mesh triangle;
    triangle.positions = {Vec3(0.0f), second, Vec3(0, second.x, 0)};
    triangle.triangles = {{0, 1, 2}};
    expect_survives(triangle);
  }
  Mesh collapsed; // three vertices at the same position
  collapsed.positions.assign(3, Vec3(1e6f, 2.0f, -3.0f));
  collapsed.triangles = {{0, 1, 2}};
  const BakedScene baked = bake(scene_of(collapsed));
  EXPECT_EQ(BakedFile::from_bytes(baked.bytes).geometries()[0].triangle_count, 0u);
  EXPECT_EQ(baked.report.collapsed_triangles, 1u);
}

TEST(Extremes, IndicesBeyond16Bits) {
  const Mesh mesh = test::grid_mesh(256, 0.1f);
  ASSERT_GT(mesh.positions.size(), 65'536u);
  expect_survives(mesh);
}

TEST(Extremes, PositionsThatAreNotFiniteAreDroppedCountedAndLocated) {
  const SceneFolder folder;
  const Imported imported = import_text(folder, R"(WorldBegin
Shape "trianglemesh" "integer indices" [0 1 2  0 2 3  0 3 4  0 4 5  1 2 3]
  "point P" [0 0 0  1 0 0  1 1 0  0 1 0  nan 1 0  0 -inf 1]
WorldEnd
)");
  EXPECT_EQ(imported.scene.dropped_triangles, 2u);
  EXPECT_TRUE(imported.reported("scene.pbrt:2:1: warning: trianglemesh: 2 triangles")) << imported.text();
  EXPECT_TRUE(imported.reported("vertex position not finite")) << imported.text();
  const BakedScene baked = bake(imported.scene);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  EXPECT_EQ(file.summary().dropped_triangles, 2u);
  ASSERT_EQ(file.geometries().size(), 1u);
  expect_holds(file, 0, source_of(imported.scene.meshes[0]));
  EXPECT_EQ(file.geometries()[0].triangle_count, 3u);
}

/// Checks every geometry of a file against the shapes that it was made from.
void expect_scene_holds(const Scene& scene, const BakeConfig& config) {
  const BakedScene baked = bake(scene, config);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  ASSERT_EQ(file.instances().size(), scene.shapes.size() + scene.instances.size());
  std::vector<bool> seen(file.geometries().size());
  for (uint32_t i = 0; i < file.instances().size(); ++i) {
    const uint32_t g = file.instances()[i].geometry;
    if (seen[g]) continue;
    seen[g] = true;
    SCOPED_TRACE("geometry " + std::string(file.text(file.geometries()[g].name)));
    Source source;
    if (i < scene.shapes.size()) {
      const Shape& shape = scene.shapes[i];
      const bool in_world = (file.geometries()[g].flags & baked::kWorldSpace) != 0;
      source.add(scene.meshes[shape.mesh], in_world ? shape.parent_from_mesh : DAffine(1.0));
    } else {
      for (const Shape& shape : scene.objects[scene.instances[i - scene.shapes.size()].object].shapes)
        source.add(scene.meshes[shape.mesh], shape.parent_from_mesh);
    }
    expect_holds(file, g, source);
  }
  EXPECT_EQ(std::count(seen.begin(), seen.end(), false), 0);
}

TEST(Extremes, ScalesSideBySideInOneScene) {
  Diagnostics diagnostics;
  Progress progress;
  const Scene scene =
      import_scene(PACKTRACE_SOURCE_DIR "/assets/extreme/extreme.pbrt", {}, diagnostics, progress).scene;
  ASSERT_GT(scene.instances.size(), 0u);
  expect_scene_holds(scene, {});
  expect_scene_holds(scene, precision(PrecisionKind::kDiagonalFraction, 1e-7));
}

TEST(Extremes, WorldShapesOfEveryScaleShareOneLattice) {
  Scene scene;
  scene.materials.push_back({});
  uint32_t rings = 8; // different meshes, because equal ones would share a geometry with its own grid
  for (const double scale : {1e-6, 1e-3, 1.0, 1e3, 1e6})
    test::add_shape(scene, test::sphere_mesh(rings++),
                    compose(test::translation({2.5 * scale, 0, 0}), test::scaling(DVec3(scale))));
  const BakedScene baked = bake(scene);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  for (const baked::GeometryRecord& geometry : file.geometries()) {
    EXPECT_NE(geometry.flags & baked::kWorldSpace, 0u);
    EXPECT_EQ(geometry.step_mantissa, file.summary().world_step_mantissa); // steps differ by powers of two
    EXPECT_LE(geometry.step_exponent, file.summary().world_step_exponent);
  }
  expect_scene_holds(scene, {});
  expect_scene_holds(scene, precision(PrecisionKind::kAbsolute, 1e-8));
}

double step_of(const baked::GeometryRecord& g) { return PositionGrid{g.step_mantissa, g.step_exponent}.step(); }

/// A mountain of 20,000 triangles, 1e6 units wide.
Scene mountain_scene() { return scene_of(test::grid_mesh(100, 0.3f), test::scaling(DVec3(1e6))); }

TEST(Extremes, CrumbsBeforeAMountainKeepTheirShape) {
  Scene scene = mountain_scene();
  const DAffine small = compose(test::translation({-1e-5, 0, 0}), test::scaling(DVec3(1e-6)));
  test::add_shape(scene, test::sphere_mesh(9), small);
  test::add_shape(scene, test::grid_mesh(5, 0.1f), // as fine as floats are at this place
                  compose(test::translation({2e6, 0, 0}), test::scaling(DVec3(100))));
  const BakedScene baked = bake(scene);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  EXPECT_EQ(baked.report.nested_geometries, 2u);
  EXPECT_EQ(baked.report.collapsed_triangles, 0u);
  EXPECT_TRUE(baked.report.warnings.empty()) << baked.report.warnings.front();
  const double world = baked.report.world_step;
  EXPECT_EQ(step_of(file.geometries()[0]), world);
  for (const uint32_t g : {1u, 2u}) {
    EXPECT_NE(file.geometries()[g].flags & baked::kWorldSpace, 0u);
    EXPECT_EQ(file.geometries()[g].step_mantissa, file.geometries()[0].step_mantissa);
  }
  EXPECT_LT(step_of(file.geometries()[1]), 1e-6 / 128);
  EXPECT_GT(step_of(file.geometries()[1]), 1e-6 / 128 / 20);
  EXPECT_GE(step_of(file.geometries()[2]), 2e6 * 0x1p-23);
  EXPECT_LE(step_of(file.geometries()[2]), 2e6 * 0x1p-22);
  expect_scene_holds(scene, {});
  // An absolute or scene-relative error is used as requested, without nested grids.
  for (const BakeConfig& config :
       {precision(PrecisionKind::kAbsolute, 10.0), precision(PrecisionKind::kPositionBits, 14.0),
        precision(PrecisionKind::kDiagonalFraction, 1e-5)})
    EXPECT_EQ(bake(scene, config).report.nested_geometries, 0u);
}

/// Sorted distinct decoded positions of a geometry.
std::vector<std::array<float, 3>> positions_of(const BakedFile& file, uint32_t g) {
  std::vector<std::array<float, 3>> all;
  for (const Vec3 p : test::decode(file, g).positions) all.push_back({p.x, p.y, p.z});
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

size_t common_positions(const BakedFile& file, uint32_t a, uint32_t b) {
  const auto first = positions_of(file, a), second = positions_of(file, b);
  std::vector<std::array<float, 3>> both;
  std::set_intersection(first.begin(), first.end(), second.begin(), second.end(), std::back_inserter(both));
  return both.size();
}

TEST(Extremes, SmallThingsThatTouchStayClosed) {
  // Two small patches of different fineness with a common border, and one attached to a vertex of the mountain.
  Scene scene = mountain_scene();
  const DVec3 place(-1e3, 0, 0);
  Mesh left = test::grid_mesh(8, 0.1f), right = test::grid_mesh(16, 0.1f);
  for (Vec3& p : right.positions) p.x += 1.0f, p.z = 0.0f;
  for (Vec3& p : left.positions) p.z = 0.0f;
  test::add_shape(scene, left, test::translation(place));
  test::add_shape(scene, right, test::translation(place));
  const DVec3 peak = DVec3(scene.meshes[0].positions[5000]) * 1e6;
  test::add_shape(scene, test::grid_mesh(8), test::translation(DVec3(Vec3(peak))));
  const BakedScene baked = bake(scene);
  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  EXPECT_EQ(baked.report.nested_geometries, 3u);
  EXPECT_GT(step_of(file.geometries()[1]), step_of(file.geometries()[2])); // each has its own step
  EXPECT_LT(step_of(file.geometries()[1]), 1.0 / 8 / 128);
  const baked::GeometryRecord& hanging = file.geometries()[3]; // as fine as floats are at this place
  EXPECT_LT(step_of(hanging), std::max({std::abs(peak.x), std::abs(peak.y), std::abs(peak.z)}) * 0x1p-22);
  EXPECT_EQ(common_positions(file, 1, 2), 9u); // the border: every vertex of the coarser patch
  EXPECT_GE(common_positions(file, 0, 3), 1u); // the peak, on the mountain's lattice
  EXPECT_GE(hanging.position_error_bound, baked.report.world_step / 2);
}

uint64_t peak_rss_bytes() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<uint64_t>(usage.ru_maxrss) * 1024;
}

TEST(Extremes, TwentyMillionVerticesInBoundedMemory) {
  if (std::getenv("PACKTRACE_HUGE_MESHES") == nullptr) GTEST_SKIP() << "PACKTRACE_HUGE_MESHES is not set";
  constexpr uint32_t kSide = 4472;
  Mesh mesh = test::grid_mesh(kSide, 0.1f);
  mesh.uvs = {};
  const uint64_t triangles = mesh.triangles.size();
  ASSERT_GE(mesh.positions.size(), 20'000'000u);
  const Scene scene = scene_of(std::move(mesh));
  const uint64_t before = peak_rss_bytes();
  const BakedScene baked = bake(scene);
  const double per_triangle = static_cast<double>(peak_rss_bytes() - before) / static_cast<double>(triangles);
  RecordProperty("peak_rss_bytes", std::to_string(peak_rss_bytes()));
  RecordProperty("bake_bytes_per_triangle", std::to_string(per_triangle));
  EXPECT_LT(per_triangle, 100.0);

  const BakedFile file = BakedFile::from_bytes(baked.bytes);
  const baked::GeometryRecord& record = file.geometries()[0];
  ASSERT_EQ(record.triangle_count, triangles);
  EXPECT_LE(record.max_position_error, record.position_error_bound);
  std::vector<Vec3> positions;
  for (uint32_t c = 0; c < record.cluster_count; ++c) { // the source is a grid, so a position determines its vertex
    const ClusterView cluster = file.cluster(0, c);
    positions.resize(cluster.vertex_count());
    decode_positions(cluster, positions);
    for (const Vec3 p : positions) {
      const auto column = static_cast<uint32_t>(std::lround(p.x * kSide));
      const auto row = static_cast<uint32_t>(std::lround(p.y * kSide));
      const DVec3 off = glm::abs(DVec3(p) - DVec3(scene.meshes[0].positions[row * (kSide + 1) + column]));
      ASSERT_LE(std::max({off.x, off.y, off.z}), record.position_error_bound);
    }
  }
}

} // namespace
} // namespace packtrace
