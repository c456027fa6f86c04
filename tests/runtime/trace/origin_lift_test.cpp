#include "runtime/camera/origin_lift.h"

#include <algorithm>
#include <numeric>

#include <gtest/gtest.h>

#include "runtime/camera/lod_view.h"
#include "runtime/camera/primary_visibility.h"
#include "runtime/trace/source/float_source.h"
#include "tests/runtime/trace/test_scenes.h"

namespace packtrace {
namespace {

constexpr ImageSize kLiftImage{40, 24};
constexpr float kHalf = 50.0f; // half the side of the floors: far more than the camera sees

Mesh floor_at(float y, bool turned_over) {
  return turned_over ? test::quad({-kHalf, y, -kHalf}, {2 * kHalf, 0, 0}, {0, 0, 2 * kHalf})
                     : test::quad({-kHalf, y, -kHalf}, {0, 0, 2 * kHalf}, {2 * kHalf, 0, 0});
}

/// A scene of two floors, instances 0 and 1.
Scene two_floors(const Mesh& first, const Mesh& second) {
  Scene scene;
  test::add_shape(scene, first);
  test::add_shape(scene, second);
  return scene;
}

class OriginLiftTest : public testing::TestWithParam<double> {
protected:
  /// World-space height of a number of pixels, positive towards the camera.
  float height(double px) const { return static_cast<float>(GetParam() * px * pixel_width(camera_, DVec3(0))); }

  GBuffer seen() const {
    const Scene scene = two_floors(floor_at(0, false), far_away());
    const FloatSource source(scene);
    Progress progress;
    GBuffer g;
    trace_primary(source, EmbreeTracer(source, {}), camera_, camera_, g, progress);
    EXPECT_EQ(std::ranges::count(g.instance, 0u), std::ptrdiff_t(kLiftImage.pixels()));
    return g;
  }
  /// Mean AO of the visible floor with occlusion rays traced against the coarse scene.
  double ao_in(const Scene& coarse, bool lift) const {
    const FloatSource source(coarse);
    const EmbreeTracer tracer(source, {});
    GBuffer g = seen();
    Progress progress;
    if (lift) lift_origins(tracer, camera_, 1.0, g, progress);
    AoConfig config;
    config.radius = 20.0f;
    config.falloff = false;
    AoFrame ao;
    trace_ao(source, tracer, g, config, 0, ao, progress);
    return std::accumulate(ao.ao.begin(), ao.ao.end(), 0.0) / static_cast<double>(ao.ao.size());
  }
  static Mesh far_away() { return test::quad({900, 0, 900}, {0, 0, 1}, {1, 0, 0}); }

  const PrimaryCamera camera_{test::camera_at({0, 10 * GetParam(), 0.01}, {0, 0, 0}), kLiftImage};
};

constexpr double kOpen = 1.0;
constexpr double kClosed = 0.01; // Rays that graze the surface above travel farther than the AO radius.

TEST_P(OriginLiftTest, RaysStartAboveTheCoarseSurface) {
  const Scene coarse = two_floors(floor_at(height(0.3), false), far_away());
  EXPECT_LT(ao_in(coarse, false), kClosed);
  EXPECT_EQ(ao_in(coarse, true), kOpen);
}

TEST_P(OriginLiftTest, APointAboveTheCoarseSurfaceStaysWhereItIs) {
  EXPECT_EQ(ao_in(two_floors(floor_at(height(-0.3), false), far_away()), true), kOpen);
}

TEST_P(OriginLiftTest, WhatIsFartherThanTheErrorOccludes) {
  EXPECT_LT(ao_in(two_floors(floor_at(height(0.9), false), far_away()), true), kClosed);
}

TEST_P(OriginLiftTest, WhatFacesThePointOccludes) {
  EXPECT_LT(ao_in(two_floors(floor_at(height(0.3), true), far_away()), true), kClosed);
}

TEST_P(OriginLiftTest, OtherInstancesOcclude) {
  EXPECT_LT(ao_in(two_floors(floor_at(0, false), floor_at(height(0.3), false)), true), kClosed);
}

INSTANTIATE_TEST_SUITE_P(FromAboveAndBelow, OriginLiftTest, testing::Values(1.0, -1.0));

TEST(LodView, InstancesThatNoPixelShows) {
  GBuffer g;
  g.resize({2, 1});
  g.instance = {2, kNoInstance};
  EXPECT_EQ(not_in_image(g, 4), (std::vector<uint8_t>{1, 1, 0, 1}));
}

} // namespace
} // namespace packtrace
