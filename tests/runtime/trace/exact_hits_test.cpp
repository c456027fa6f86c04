#include "tests/benchmarks/trace_benchmark_exact.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/runtime/trace/packed_scenes.h"
#include "tests/sanitized.h"

namespace packtrace {
namespace {

/// A ray along +z that crosses planes of constant z.
const Ray kUp{{0.25f, 0.25f, -1.0f}, 0.0f, {0.0f, 0.0f, 1.0f}, 100.0f};

ExactTriangle at_height(double z, double x = 0.0) {
  return {DVec3(x, 0.0, z), DVec3(x + 1.0, 0.0, z), DVec3(x, 1.0, z)};
}

/// The nearest triangle, one behind it, and one beside the nearest.
std::vector<ExactHit> candidates(const Ray& ray = kUp) {
  return {exact_hit(ray, at_height(1.0)), exact_hit(ray, at_height(3.0)), exact_hit(ray, at_height(1.0, 2.0))};
}

HitVerdicts verdict(std::optional<NamedHit> answer, const std::vector<ExactHit>& named = candidates(),
                    const Ray& ray = kUp) {
  HitVerdicts out;
  judge_closest(ray, named, answer, out);
  return out;
}

TEST(ExactHit, MeetsPlanesWhereTheyAre) {
  const ExactHit straight = exact_hit(kUp, at_height(1.0));
  EXPECT_TRUE(straight.hit);
  EXPECT_EQ(straight.t, 2.0);
  EXPECT_EQ(straight.height, 1.0);
  EXPECT_EQ(straight.aside, 0.0);
  const ExactHit turned = exact_hit(kUp, {DVec3(0, 0, 1), DVec3(0, 1, 1), DVec3(1, 0, 1)});
  EXPECT_TRUE(turned.hit);
  EXPECT_EQ(turned.t, 2.0);
  const ExactHit beside = exact_hit(kUp, at_height(1.0, 2.0));
  EXPECT_FALSE(beside.hit);
  EXPECT_EQ(beside.t, 2.0);
  EXPECT_EQ(beside.aside, 1.75); // distance from the edge x = 2
  // The ray is parallel to the plane.
  EXPECT_FALSE(exact_hit(kUp, {DVec3(0, 0, 0), DVec3(1, 1, 0), DVec3(1, 1, 1)}).hit);
  EXPECT_FALSE(exact_hit(kUp, {DVec3(0, 0, 1), DVec3(1, 1, 1), DVec3(1, 1, 1)}).hit); // The triangle has no area.
}

/// The ray has a slope of 2^-20 to the plane, so a height of 2^-30 is a t of 2^-10.
TEST(ExactHit, KeepsDigitsAtGrazingAngles) {
  const Ray grazing{{0.25f, 0.25f, 0x1p-30f}, 0.0f, {1.0f, 0.0f, -0x1p-20f}, 100.0f};
  const ExactHit hit = exact_hit(grazing, at_height(0.0));
  EXPECT_TRUE(hit.hit);
  EXPECT_EQ(hit.t, 0x1p-10);
  EXPECT_EQ(hit.height, 0x1p-20);
}

/// Doubles would round the edge functions to zero.
TEST(ExactHit, DecidesSidesOfEdges) {
  const float step = 0x1p-24f; // ulp of floats just below 1
  const ExactTriangle triangle{DVec3(0, 0, 1), DVec3(1 - step, 1, 1), DVec3(0, 1, 1)};
  const auto through = [&](float x, float y) {
    return exact_hit({{x, y, 0.0f}, 0.0f, {0.0f, 0.0f, 1.0f}, 100.0f}, triangle).hit;
  };
  EXPECT_TRUE(through(0.5f - 0.5f * step, 0.5f)); // exactly on the edge
  EXPECT_FALSE(through(0.5f, 0.5f));
  EXPECT_FALSE(through(0.5f - 0.25f * step, 0.5f));
  EXPECT_TRUE(through(0.5f - 0.5f * step, 0.5f + 0.5f * step));
}

TEST(HitVerdicts, RightHitsAreNotWrong) {
  EXPECT_EQ(verdict(NamedHit{0, 2.0}).all(), 0u);
  EXPECT_EQ(verdict(NamedHit{0, 2.0001}).all(), 0u);
  EXPECT_EQ(verdict(std::nullopt, {}).all(), 0u);
  EXPECT_EQ(verdict(std::nullopt, {candidates()[2]}).all(), 0u);
}

TEST(HitVerdicts, SortWhatIsWrong) {
  const HitVerdicts missed = verdict(std::nullopt);
  EXPECT_EQ(missed.missed, 1u);
  const HitVerdicts wrong = verdict(NamedHit{2, 2.0});
  EXPECT_EQ(wrong.wrong, 1u);
  const HitVerdicts unfounded = verdict(NamedHit{0, 2.0}, {candidates()[2]});
  EXPECT_EQ(unfounded.wrong, 1u);
  const HitVerdicts farther = verdict(NamedHit{1, 4.0});
  EXPECT_EQ(farther.farther, 1u);
  const HitVerdicts beside =
      verdict(NamedHit{1, 2.0}, {candidates()[0], exact_hit(kUp, at_height(1.0, 0.25 + 0x1p-22))});
  EXPECT_EQ(beside.beside, 1u);
  const HitVerdicts far_aside =
      verdict(NamedHit{1, 2.0}, {candidates()[0], exact_hit(kUp, at_height(1.0, 0.25 + 0x1p-20))});
  EXPECT_EQ(far_aside.wrong, 1u);
  const HitVerdicts off = verdict(NamedHit{0, 2.01});
  EXPECT_EQ(off.t_off, 1u);
  EXPECT_NEAR(off.worst_t, 0.005, 1e-9);
  EXPECT_NEAR(off.worst_ulps, 0.01 / 0x1p-23, 1e-3);
  EXPECT_EQ(verdict(NamedHit{0, std::numeric_limits<double>::quiet_NaN()}).t_off, 1u);
  for (const HitVerdicts& one : {missed, wrong, unfounded, farther, beside, far_aside, off}) EXPECT_EQ(one.all(), 1u);
}

TEST(HitVerdicts, EndsOfRaysMayRound) {
  Ray ray = kUp;
  ray.tfar = 2.0f;
  EXPECT_EQ(verdict(std::nullopt, candidates(ray), ray).all(), 0u);
  EXPECT_EQ(verdict(NamedHit{0, 2.0}, candidates(ray), ray).all(), 0u);
  ray.tfar = 2.01f;
  EXPECT_EQ(verdict(std::nullopt, candidates(ray), ray).missed, 1u);
  ray.tnear = 2.0f, ray.tfar = 100.0f;
  EXPECT_EQ(verdict(NamedHit{1, 4.0}, candidates(ray), ray).all(), 0u);
}

TEST(HitVerdicts, AnyHits) {
  HitVerdicts out;
  judge_any(kUp, candidates(), true, out);
  judge_any(kUp, {}, false, out);
  EXPECT_EQ(out.all(), 0u);
  judge_any(kUp, candidates(), false, out);
  EXPECT_EQ(out.missed, 1u);
  judge_any(kUp, {}, true, out);
  EXPECT_EQ(out.wrong, 1u);
}

/// Changes two hits of a tracer and expects judge() to report exactly those.
TEST(HitVerdicts, FindWhatIsWrongWithASystem) {
  Scene scene;
  test::add_shape(scene, test::sphere({0, 0, 0}, 1, 24));
  test::add_object(scene, test::sphere({0, 0, 0}, 1, 12));
  scene.instances.push_back({0, Affine(test::placed({3, 0, 0}, {1, 0.5, 2}, 30))});
  const test::BakedScene baked(scene);
  const PackedTracer tracer(baked.file, baked.source);
  const std::vector<Ray> rays = test::random_rays(2000, baked.file.world_bounds(), tracer.space());
  const std::vector<RayHit> right = test::closest(tracer, rays);
  std::vector<RayHit> wrong = right;
  uint32_t hits = 0;
  for (RayHit& hit : wrong) {
    if (!hit.valid()) continue;
    if (hits == 0) hit = {};
    if (hits == 1) hit.t *= 1.01f;
    ++hits;
  }
  ASSERT_GT(hits, 100u);
  const ExactTriangles triangles(baked.file, tracer.space());
  const std::vector<SystemHits> systems{{&tracer, right, {}}, {&tracer, wrong, {}}};
  const std::vector<HitVerdicts> verdicts = judge(rays, triangles, systems);
  ASSERT_EQ(verdicts.size(), 2u);
  EXPECT_EQ(verdicts[0].all(), 0u);
  EXPECT_GT(verdicts[0].worst_ulps, 0.0);
  EXPECT_LT(verdicts[0].worst_ulps, 20.0);
  EXPECT_EQ(verdicts[1].missed, 1u);
  EXPECT_EQ(verdicts[1].t_off, 1u);
  EXPECT_EQ(verdicts[1].all(), 2u);
}

/// A hilly floor whose triangles are small compared with their coordinates.
Mesh hills() {
  constexpr int kCells = 120;
  Mesh mesh;
  for (int z = 0; z <= kCells; ++z)
    for (int x = 0; x <= kCells; ++x)
      mesh.positions.emplace_back(1.3 * x - 30.0, 0.4 * std::sin(0.7 * x) * std::cos(0.9 * z), 1.1 * z + 50.0);
  for (uint32_t z = 0; z < kCells; ++z)
    for (uint32_t x = 0; x < kCells; ++x) {
      const uint32_t a = z * (kCells + 1) + x, b = a + kCells + 1;
      mesh.triangles.insert(mesh.triangles.end(), {{a, b, a + 1}, {b, b + 1, a + 1}});
    }
  return mesh;
}

/// Rays that start a few ulp of their origin's coordinates above a triangle and reach its plane within half an edge.
std::vector<Ray> grazing_rays(const SceneSource& source, const ExactTriangles& triangles, size_t count) {
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::vector<Ray> rays;
  while (rays.size() < count) {
    const auto instance = static_cast<uint32_t>(generator() % source.instances().size());
    const uint64_t all = source.counts(source.instances()[instance].geometry).triangles;
    const ExactTriangle t = triangles(instance, static_cast<uint32_t>(generator() % all));
    const DVec3 a = t[0], e = t[1] - a, f = t[2] - a, n = glm::normalize(glm::cross(e, f));
    const DVec3 start = a + 0.3 * unit(generator) * e + 0.3 * unit(generator) * f;
    const DVec3 stop = a + 0.5 * unit(generator) * e + 0.5 * unit(generator) * f;
    Ray ray;
    ray.origin = Vec3(start);
    const double height = (2.0 + 6.0 * unit(generator)) * origin_ulp(ray);
    ray.origin = Vec3(start + n * height);
    ray.direction = Vec3(stop - DVec3(ray.origin));
    rays.push_back(ray);
  }
  return rays;
}

/// Largest distance of a hit from its triangle's plane, over hits of the right triangle, in units of 2^-24 of the sum
/// of the distance travelled and the triangle's size.
double worst_height(const PackedTracer& tracer, const ExactTriangles& triangles, std::span<const Ray> rays) {
  const std::vector<RayHit> hits = test::closest(tracer, rays);
  double worst = 0.0;
  size_t right = 0;
  for (size_t i = 0; i < rays.size(); ++i) {
    if (!hits[i].valid()) continue;
    const HitSurface surface = tracer.resolve(hits[i]);
    const ExactTriangle t = triangles(surface.placement->instance, surface.triangle);
    const ExactHit exact = exact_hit(rays[i], t);
    if (!exact.hit) continue;
    ++right;
    const double way = std::abs(exact.t) * glm::length(DVec3(rays[i].direction));
    const double size = way + glm::distance(t[0], t[1]) + glm::distance(t[0], t[2]);
    worst = std::max(worst, std::abs(double{hits[i].t} - exact.t) * exact.height / (0x1p-24 * size));
  }
  EXPECT_GT(right, rays.size() / 2);
  return worst;
}

/// The origin's rounding error in a tree's grid is an ulp of its coordinates, far more than the error that is allowed
/// here.
TEST(NearestHits, AreOnTheirPlanesWhereRaysGraze) {
  for (const bool instanced : {false, true}) {
    Scene scene;
    if (instanced) {
      test::add_object(scene, hills());
      scene.instances.push_back({0, Affine(test::placed({5, 6, 7}, {1, 1.3, -0.8}, 33, {1, 2, 3}))});
      scene.instances.push_back({0, Affine(test::placed({-300, 6, 7}, DVec3(1), 80))});
    } else {
      test::add_shape(scene, hills());
    }
    const test::BakedScene baked(scene);
    for (const PackedIsa isa : test::isas()) {
      const PackedTracer tracer(baked.file, baked.source, isa);
      const ExactTriangles triangles(baked.file, tracer.space());
      const std::vector<Ray> rays = grazing_rays(baked.source, triangles, test::fewer(20000u));
      EXPECT_LT(worst_height(tracer, triangles, rays), 2.0) << tracer.isa() << ", instanced " << instanced;
    }
  }
}

} // namespace
} // namespace packtrace
