#include "runtime/lod/lod_metric.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "tests/runtime/lod/lod_records.h"

namespace packtrace {
namespace {

DVec3 random_direction(test::Random& random) {
  for (;;) {
    const DVec3 v(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    if (glm::length(v) > 0.1) return glm::normalize(v);
  }
}

/// Largest |M v| over random directions v, each improved by power iteration.
double stretch_found(const DAffine& m, test::Random& random) {
  const glm::dmat3 linear(m);
  double largest = 0.0;
  for (int i = 0; i < 2; ++i) {
    DVec3 v = random_direction(random);
    for (int k = 0; k < 3000; ++k) v = glm::normalize(glm::transpose(linear) * (linear * v));
    largest = std::max(largest, glm::length(linear * v));
  }
  return largest;
}

TEST(LodMetric, StretchIsTheLargestSingularValue) {
  test::Random random(1);
  for (int i = 0; i < 1000; ++i) {
    const DAffine m = test::random_affine(random, 10.0);
    const double found = stretch_found(m, random), stated = largest_stretch(m);
    EXPECT_GE(stated, found);
    EXPECT_LE(stated, found * (1.0 + 1e-4));
  }
}

TEST(LodMetric, StretchOfEqualAndVanishingScales) {
  const auto scale = [](double x, double y, double z) {
    return DAffine(DVec3(x, 0, 0), DVec3(0, y, 0), DVec3(0, 0, z), DVec3(1, 2, 3));
  };
  const auto expect = [](const DAffine& m, double s) {
    EXPECT_GE(largest_stretch(m), s);
    EXPECT_LE(largest_stretch(m), s * (1.0 + 1e-6));
  };
  expect(scale(3, 3, 3), 3);
  expect(scale(-3, 3, 0.1), 3); // the two largest singular values are equal
  expect(scale(0, 0, 1e-20), 1e-20);
  expect(scale(1e90, 1, 1), 1e90);
  EXPECT_GT(largest_stretch(scale(0, 0, 0)), 0.0);
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e101})
    EXPECT_THROW(largest_stretch(scale(1, bad, 1)), Error);
}

/// An error of error_px pixels, seen face on in the middle of the image, is just allowed.
TEST(LodMetric, ThresholdIsARadiusInPixels) {
  const double fov = 1.0, height = 1080.0, distance = 7.0;
  const DetailView view = make_detail_view(DVec3(0.0), 0.01, fov, height, 2.5);
  const double world_per_pixel = 2.0 * distance * std::tan(0.5 * fov) / height;
  EXPECT_NEAR(view.error_per_distance * distance, 2.5 * world_per_pixel, 1e-12);
  const DVec3 eye(0.0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(make_detail_view(DVec3(nan), 0.1, 1, 1, 1), Error);
  EXPECT_THROW(make_detail_view(eye, 0.0, 1, 1, 1), Error);
  EXPECT_THROW(make_detail_view(eye, 0.1, 3.1416, 1, 1), Error);
  EXPECT_THROW(make_detail_view(eye, 0.1, 1, 0, 1), Error);
  EXPECT_THROW(make_detail_view(eye, 0.1, 1, 1, -1), Error);
  EXPECT_THROW(make_detail_view(eye, 0.1, 1, 1, nan), Error);
}

TEST(LodMetric, InsideABallAndNearerThanTheNearPlaneTheNearPlaneCounts) {
  const DetailView view = make_detail_view(DVec3(0.5, 0, 0), 0.25, 1.0, 1000.0, 1.0);
  const InstanceMetric metric(view, DAffine(1.0), largest_stretch(DAffine(1.0)), 2.0);
  EXPECT_EQ(metric.distance(0, 0, 0, 1.0, 0), 0.25);   // the eye is inside
  EXPECT_EQ(metric.distance(0.6, 0, 0, 0.0, 0), 0.25); // at distance 0.1
  EXPECT_NEAR(metric.distance(3.5, 0, 0, 1.0, 0), 2.0, 1e-6);
}

/// No point of a sphere is nearer than the distance, under any transform.
TEST(LodMetric, DistanceIsALowerBoundUnderAnyTransform) {
  test::Random random(2);
  for (int i = 0; i < 3000; ++i) {
    const DAffine m = test::random_affine(random, 20.0);
    const DetailView view = make_detail_view(20.0 * random_direction(random), 1e-6, 1.0, 1000.0, 1.0);
    const DVec3 center(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    const double radius = random.uniform(0.0f, 1.0f);
    const InstanceMetric metric(view, m, largest_stretch(m), 4.0);
    const double d = metric.distance(center.x, center.y, center.z, radius, 0);
    for (int k = 0; k < 20; ++k) {
      const DVec3 p = transform_point(m, center + radius * random_direction(random));
      EXPECT_LE(d, std::max(view.near, glm::length(p - view.eye)));
    }
  }
}

/// Nested spheres that touch, with equal errors: the upper group passes only if the lower does, in floating point too.
TEST(LodMetric, PassesNeverWithoutWhatIsBelow) {
  test::Random random(3);
  size_t upper_passes = 0, close = 0;
  for (int i = 0; i < 20000; ++i) {
    test::LodRecords records;
    // Every second geometry is tiny and far from its origin, so that rounding errors are large relative to its size.
    const bool tiny = i % 2 != 0;
    const float size = tiny ? 1e-7f : 1.0f;
    const DVec3 low = tiny ? DVec3(3000.0f, size * random.uniform(-1, 1), 0.0) : random_direction(random);
    const DVec3 off = (tiny ? DVec3(0, 1, 0) : random_direction(random)) * double(size * random.uniform(0, 1));
    const float radius = size * random.uniform(0.0f, 0.2f), error = random.uniform(0.001f, 0.002f);
    baked::LodGroupRecord below{{float(low.x), float(low.y), float(low.z)}, radius, error, 0}, above = below;
    above.level = 1;
    above.center = {float(low.x + off.x), float(low.y + off.y), float(low.z + off.z)}; // the radius is enlarged to fit
    records.groups = {below, above};
    records.links = {{0, baked::kNoLodGroup}, {1, 0}};
    records.cluster_triangles = {128, 64};
    const LodGeometry geometry = records.geometry();
    DAffine m = test::random_affine(random, i % 3 == 0 ? 1e6 : 10.0);
    if (tiny) { // rotated and scaled only, so that the bound by the largest stretch is tight
      m[0] = glm::normalize(m[0]);
      m[1] = glm::normalize(m[1] - glm::dot(m[0], m[1]) * m[0]);
      m[2] = glm::cross(m[0], m[1]);
    }
    const double s = largest_stretch(m);
    // The eye is on the line through both centres, on the side where the spheres touch: distances differ by rounding
    // only.
    const DVec3 touching = transform_point(m, low - off * (5.0 * random.uniform(0, 1)));
    DetailView view = make_detail_view(touching, 1e-30, 1.0, 1000.0, 1.0);
    const InstanceMetric probe(view, m, s, geometry.reach());
    const uint32_t upper = geometry.rank_of_group(1), lower = geometry.rank_of_group(0);
    const LodRanks& r = geometry.ranks();
    const double d =
        probe.distance(r.center_x[upper], r.center_y[upper], r.center_z[upper], r.radius[upper], r.level[upper]);
    for (int k = -2; k <= 2; ++k) { // the threshold at which it just passes, and adjacent doubles
      double t = r.error[upper] * s / d;
      for (int n = 0; n < std::abs(k); ++n) t = std::nextafter(t, k < 0 ? 0.0 : 1e300);
      view.error_per_distance = t;
      const InstanceMetric metric(view, m, s, geometry.reach());
      upper_passes += metric.passes(r, upper);
      close += !metric.passes(r, upper);
      EXPECT_TRUE(!metric.passes(r, upper) || metric.passes(r, lower));
    }
  }
  EXPECT_GT(upper_passes, 20000u);
  EXPECT_GT(close, 20000u);
}

} // namespace
} // namespace packtrace
