#include "tests/benchmarks/trace_benchmark_exact.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/runtime/trace/packed_scenes.h"

namespace packtrace {
namespace {

/// From below the origin of x and y through planes of constant z.
const Ray kUp{{0.25f, 0.25f, -1.0f}, 0.0f, {0.0f, 0.0f, 1.0f}, 100.0f};

ExactTriangle at_height(double z, double x = 0.0) {
  return {DVec3(x, 0.0, z), DVec3(x + 1.0, 0.0, z), DVec3(x, 1.0, z)};
}

/// The near triangle, one farther away, and one beside the near one.
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
  EXPECT_EQ(beside.aside, 1.75);                                                      // of the edge x = 2
  EXPECT_FALSE(exact_hit(kUp, {DVec3(0, 0, 0), DVec3(1, 1, 0), DVec3(1, 1, 1)}).hit); // runs along it
  EXPECT_FALSE(exact_hit(kUp, {DVec3(0, 0, 1), DVec3(1, 1, 1), DVec3(1, 1, 1)}).hit); // no area
}

/// A ray at 2^-20 of the plane: a height of 2^-30 is a t of 2^-10.
TEST(ExactHit, KeepsDigitsAtGrazingAngles) {
  const Ray grazing{{0.25f, 0.25f, 0x1p-30f}, 0.0f, {1.0f, 0.0f, -0x1p-20f}, 100.0f};
  const ExactHit hit = exact_hit(grazing, at_height(0.0));
  EXPECT_TRUE(hit.hit);
  EXPECT_EQ(hit.t, 0x1p-10);
  EXPECT_EQ(hit.height, 0x1p-20);
}

/// Doubles would round the edge functions to zero.
TEST(ExactHit, DecidesSidesOfEdges) {
  const float step = 0x1p-24f; // of a float below 1
  const ExactTriangle triangle{DVec3(0, 0, 1), DVec3(1 - step, 1, 1), DVec3(0, 1, 1)};
  const auto through = [&](float x, float y) {
    return exact_hit({{x, y, 0.0f}, 0.0f, {0.0f, 0.0f, 1.0f}, 100.0f}, triangle).hit;
  };
  EXPECT_TRUE(through(0.5f - 0.5f * step, 0.5f)); // on the edge
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

/// A tracer whose hits a test may change.
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

} // namespace
} // namespace packtrace
