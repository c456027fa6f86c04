#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <random>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "pbrt_import/base/error.h"
#include "runtime/trace/source/float_source.h"
#include "tests/runtime/trace/packed_scenes.h"
#include "tests/runtime/trace/test_scenes.h"

namespace packtrace {
namespace {

using test::add_object;
using test::add_shape;
using test::ao_at;
using test::camera_at;
using test::quad;
using test::render;
using test::Rendered;

AoConfig visibility_of(float radius, uint32_t spp = 16) {
  AoConfig config;
  config.radius = radius;
  config.spp = spp;
  config.falloff = false;
  return config;
}

/// A floor at y = 0 and a ceiling at y = 1 whose material has the given flags.
Scene roofed(MaterialFlags roof_flags) {
  Scene scene;
  add_shape(scene, quad({-1000, 0, -1000}, {0, 0, 2000}, {2000, 0, 0}));
  add_shape(scene, quad({-1000, 1, -1000}, {2000, 0, 0}, {0, 0, 2000}), roof_flags);
  return scene;
}

/// Single triangles of length 30 in all directions, each alone within the radius of the rays.
Scene loose_slivers(float width) {
  Scene scene;
  std::mt19937 random(11);
  const auto number = [&](float lo, float hi) {
    return lo + (hi - lo) * static_cast<float>(random()) / static_cast<float>(random.max());
  };
  Mesh mesh;
  for (uint32_t i = 0; i < 400; ++i) {
    const Vec3 along = glm::normalize(Vec3(number(-1, 1), number(-1, 1), number(-1, 1)));
    const Vec3 across = glm::normalize(glm::cross(along, Vec3(number(-1, 1), number(-1, 1), number(-1, 1))));
    const Vec3 middle(number(-20, 20), number(-20, 20), number(-20, 20));
    mesh.positions.insert(mesh.positions.end(),
                          {middle - 15.0f * along, middle + 15.0f * along, middle + width * across});
    mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  add_shape(scene, std::move(mesh));
  return scene;
}

TEST(AoVisibility, NothingOccludesLooseSlivers) {
  const auto occluded = [](float width, const EmbreeConfig& config) {
    const Rendered image =
        render(loose_slivers(width), camera_at({0, 0, -60}, {0, 0, 0}), {320, 180}, visibility_of(1e-3f), config);
    uint64_t hits = 0, occluded_pixels = 0;
    for (const float ao : image.ao.ao) hits += ao >= 0.0f, occluded_pixels += ao >= 0.0f && ao < 1.0f;
    EXPECT_GT(hits, 20u) << width;
    return occluded_pixels;
  };
  EmbreeConfig unchecked;
  unchecked.check_slivers = false;
  uint64_t without_check = 0;
  for (const float width : {0.3f, 0.03f, 0.003f}) {
    EXPECT_EQ(occluded(width, {}), 0u) << width;
    without_check += occluded(width, unchecked);
  }
  EXPECT_GT(without_check, 0u) << "the scene does not show what Embree alone does";
}

TEST(AoVisibility, OnlyOccludingMaterialsOcclude) {
  const auto ao = [](MaterialFlags flags) { return ao_at(roofed(flags), {0, 0, 0}, {0, 1, 0}, visibility_of(1e6f)); };
  EXPECT_LT(ao(0), 1e-4);
  EXPECT_LT(ao(kInvisible), 1e-4);
  EXPECT_LT(ao(kMirror | kEmissive), 1e-4);
  EXPECT_EQ(ao(kTransmissive), 1.0);
  EXPECT_EQ(ao(kNoShadow), 1.0);
  EXPECT_EQ(ao(kAbsent), 1.0);
}

TEST(AoVisibility, MixedMaterialsOfOneInstancedObjectKeepTheirClasses) {
  // One object whose roof is half glass and half opaque.
  Scene scene;
  const uint32_t object = add_object(scene, quad({-1000, 1, -1000}, {1000, 0, 0}, {0, 0, 2000}));
  add_object(scene, quad({0, 1, -1000}, {1000, 0, 0}, {0, 0, 2000}), kTransmissive);
  scene.objects[object].shapes.push_back(scene.objects[1].shapes[0]);
  scene.objects.pop_back();
  scene.instances.push_back({object, Affine(test::placed({0, 0, 0}, DVec3(1), 180))});
  EXPECT_NEAR(ao_at(scene, {0, 0, 0}, {0, 1, 0}, visibility_of(1e6f, 256)), 0.5, 1e-3);
}

/// Stripes of opaque and absent texels, half each, much narrower than the height of the roof.
AlphaMask stripes() { return {64, 1, WrapMode::kRepeat, Vec2(64000), Vec2(0), {0u, ~0u}}; }

TEST(AoVisibility, AlphaMasksOpenTheRoofForTheirRays) {
  // 1/2, except for the rims, which are opaque because of bilinear filtering.
  Scene scene = roofed(kAlphaMask);
  scene.masks.push_back(stripes());
  scene.materials[1].alpha_mask = 0;
  const double all_rays = ao_at(scene, {0, 0, 0}, {0, 1, 0}, visibility_of(1e6f, 256));
  EXPECT_NEAR(all_rays, 0.5, 0.05);
  scene.materials[1] = {"", kShadowAlphaMask, Vec3(0.5f), kNoMask, 0};
  EXPECT_EQ(ao_at(scene, {0, 0, 0}, {0, 1, 0}, visibility_of(1e6f, 256)), all_rays);
  AoConfig closest = visibility_of(1e6f, 256);
  closest.interreflection = 1e-6f; // selects the closest-hit path
  EXPECT_NEAR(ao_at(scene, {0, 0, 0}, {0, 1, 0}, closest), all_rays, 1e-5);
}

TEST(AoRobustness, ConvexBodiesDoNotShadowThemselves) {
  const Mesh mesh = test::sphere({0, 0, 0}, 1, 40);
  struct Place {
    DVec3 translation, scale;
  };
  for (const auto& [translation, scale] :
       {Place{{0, 0, 0}, DVec3(1)}, Place{{1000, 200, -3000}, DVec3(1)}, Place{{1e5, 0, 1e5}, DVec3(10)},
        Place{{0, 0, 0}, {0.1, 3, 1}}, Place{{20, 30, 10}, {-1, 5, 0.2}}})
    for (const bool instanced : {false, true}) {
      const DAffine place = test::placed(translation, scale, 37, {1, 3, 2});
      Scene scene;
      if (instanced) {
        add_object(scene, mesh);
        scene.instances.push_back({0, Affine(place)});
        // A second copy far away makes unit space larger than the object.
        scene.instances.push_back({0, Affine(test::placed(translation + DVec3(1000, 0, 0)))});
      } else {
        add_shape(scene, mesh, 0, place);
      }
      const double size = 3.0 * std::max({std::abs(scale.x), std::abs(scale.y), std::abs(scale.z)});
      const Rendered image = render(scene, camera_at(translation - DVec3(0, 0, size), translation), {96, 96},
                                    visibility_of(static_cast<float>(size)));
      uint64_t hits = 0;
      double occluded = 0.0;
      for (const float ao : image.ao.ao) {
        if (ao == kInvalidAo) continue;
        ++hits;
        occluded += 1.0 - ao;
      }
      EXPECT_GT(hits, 100u);
      EXPECT_LE(occluded / static_cast<double>(hits), 5e-4) << translation.x << " " << scale.y << " " << instanced;
    }
}

TEST(AoRobustness, InstancesGiveTheAoOfBakedGeometry) {
  const Mesh mesh = test::box({-1, -1, -1}, {1, 1, 1});
  for (const DVec3 scale : {DVec3(-1, 1, 1), DVec3(0.3, 2, 1)}) {
    Scene baked, instanced;
    add_shape(baked, quad({-50, -1, -50}, {0, 0, 100}, {100, 0, 0}));
    instanced = baked;
    const DAffine place = test::placed({0, 0.5, 0}, scale, 20, {0, 1, 0.2});
    add_shape(baked, mesh, 0, place);
    add_object(instanced, mesh);
    instanced.instances.push_back({0, Affine(place)});
    const Camera camera = camera_at({3, 4, -6}, {0, 0, 0});
    const Rendered a = render(baked, camera, {64, 64}, visibility_of(3)),
                   b = render(instanced, camera, {64, 64}, visibility_of(3));
    uint32_t different = 0;
    for (size_t i = 0; i < a.ao.ao.size(); ++i) different += std::abs(a.ao.ao[i] - b.ao.ao[i]) > 0.05f;
    EXPECT_LE(different, 4u);
  }
}

TEST(AoRobustness, AnyScaleGivesTheSameImage) {
  const auto at_scale = [](double scale) {
    Scene scene;
    const auto s = static_cast<float>(scale);
    add_shape(scene, quad({-9 * s, 0, -9 * s}, {0, 0, 18 * s}, {18 * s, 0, 0}));
    add_shape(scene, test::sphere({0, s, 0}, s, 24));
    add_object(scene, test::box({-s, -s, -s}, {s, s, s}));
    scene.instances.push_back({0, Affine(test::placed(DVec3(3, 1, 1) * scale, {1, 1, -1}, 30))});
    AoConfig config = visibility_of(4 * s);
    config.falloff = true;
    return render(scene, camera_at(DVec3(3, 4, -9) * scale, DVec3(0, 0, 0)), {64, 48}, config);
  };
  const Rendered one = at_scale(1.0);
  double sum = 0.0;
  for (const float ao : one.ao.ao) sum += ao;
  EXPECT_LT(sum / 3072, 0.99);
  for (const double scale : {0x1p-60, 0x1p60, 1e-20, 1e20, 1e-30, 1e30}) {
    const Rendered other = at_scale(scale);
    uint32_t different = 0;
    for (size_t i = 0; i < one.ao.ao.size(); ++i) different += std::abs(one.ao.ao[i] - other.ao.ao[i]) > 0.02f;
    EXPECT_LE(different, 3u) << scale;
    for (size_t i = 0; i < one.ao.ao.size(); ++i) {
      if (one.ao.ao[i] == kInvalidAo || other.ao.ao[i] == kInvalidAo) continue;
      ASSERT_NEAR(other.gbuffer.view_z[i] / scale, one.gbuffer.view_z[i], 1e-2 * one.gbuffer.view_z[i]);
    }
  }
}

TEST(AoFrames, FramesOfOneSampleAreOneFrameOfMany) {
  Scene scene = roofed(0);
  const FloatSource source(scene);
  const EmbreeTracer embree(source, {});
  const GBuffer gbuffer = test::point_gbuffer({0, 0, 0}, {0, 1, 0}, 1e-5f);
  Progress progress;
  AoFrame whole, part;
  trace_ao(source, embree, gbuffer, visibility_of(1.5f, 32), 3, whole, progress);
  std::vector<double> sum(gbuffer.size.pixels());
  for (uint32_t frame = 0; frame < 32; ++frame) {
    trace_ao(source, embree, gbuffer, visibility_of(1.5f, 1), 96 + frame, part, progress);
    for (size_t i = 0; i < sum.size(); ++i) sum[i] += part.ao[i];
  }
  for (size_t i = 0; i < sum.size(); ++i) EXPECT_FLOAT_EQ(whole.ao[i], static_cast<float>(sum[i] / 32));
}

/// Forwards to a tracer with a given preferred_rays_per_call(), and records the largest number of rays per call.
class CallSizeRecorder final : public RayTracer {
public:
  CallSizeRecorder(const RayTracer& tracer, uint32_t rays) : tracer_(tracer), rays_(rays) {}
  std::string_view name() const override { return tracer_.name(); }
  const UnitSpace& space() const override { return tracer_.space(); }
  uint32_t preferred_rays_per_call() const override { return rays_; }
  HitSurface resolve(const RayHit& hit) const override { return tracer_.resolve(hit); }
  std::vector<ResidentPart> resident() const override { return tracer_.resident(); }
  void closest_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder order,
                    std::span<RayHit> hits) const override {
    most_ = std::max(most_, rays.size());
    tracer_.closest_hits(rays, ray_class, order, hits);
  }
  void any_hits(std::span<const Ray> rays, uint32_t ray_class, RayOrder order,
                std::span<uint8_t> occluded) const override {
    most_ = std::max(most_, rays.size());
    tracer_.any_hits(rays, ray_class, order, occluded);
  }
  size_t most() const { return most_; }

private:
  const RayTracer& tracer_;
  const uint32_t rays_;
  mutable size_t most_ = 0;
};

TEST(AoFrames, SamplesThatAreTracedTogetherGiveTheSameBytes) {
  Scene scene = roofed(0);
  add_shape(scene, quad({0.5f, 0, -5}, {0, 0, 10}, {0, 0.8f, 0}));
  const FloatSource source(scene);
  const EmbreeTracer embree(source, {});
  const GBuffer gbuffer = test::point_gbuffer({0, 0, 0}, {0, 1, 0}, 1e-5f);
  Progress progress;
  for (const bool falloff : {false, true}) {
    AoConfig config = visibility_of(1.5f, 7); // 7 = 4 + 3
    config.falloff = falloff;
    AoFrame apart, together;
    const CallSizeRecorder few(embree, 1), many(embree, 1u << 20);
    trace_ao(source, few, gbuffer, config, 2, apart, progress);
    trace_ao(source, many, gbuffer, config, 2, together, progress);
    EXPECT_EQ(few.most(), gbuffer.size.pixels());
    EXPECT_EQ(many.most(), 4 * gbuffer.size.pixels());
    EXPECT_EQ(std::memcmp(apart.ao.data(), together.ao.data(), apart.ao.size() * sizeof(float)), 0);
    EXPECT_EQ(apart.hit_distance, together.hit_distance);
    EXPECT_GT(apart.ao[0], 0.0f);
    EXPECT_LT(apart.ao[0], 1.0f);
  }
}

TEST(AoFrames, SamplesThatThePackedTracerTakesTogetherGiveTheSameBytes) {
  const Scene scene = test::thicket_scene();
  const test::BakedScene baked(scene);
  const PackedTracer packed(baked.file, baked.source);
  const CallSizeRecorder one(packed, 1), all(packed, packed.preferred_rays_per_call());
  AoConfig config = visibility_of(1.5f, 5); // 5 = 4 + 1
  const GBuffer gbuffer = render(scene, camera_at({0, 6, -9}, {0, 1, 0}), {40, 40}, config).gbuffer;
  Progress progress;
  for (const bool falloff : {false, true}) {
    config.falloff = falloff;
    AoFrame apart, together;
    trace_ao(baked.source, one, gbuffer, config, 0, apart, progress);
    trace_ao(baked.source, all, gbuffer, config, 0, together, progress);
    EXPECT_LE(one.most(), 1024u);
    EXPECT_GT(all.most(), 2048u);
    EXPECT_EQ(std::memcmp(apart.ao.data(), together.ao.data(), apart.ao.size() * sizeof(float)), 0);
    EXPECT_EQ(apart.hit_distance, together.hit_distance);
    EXPECT_NE(std::ranges::min(apart.ao), std::ranges::max(apart.ao));
  }
}

TEST(AoFrames, MissesAreInvalidEvenOverOldContents) {
  const Scene scene = roofed(0);
  const FloatSource source(scene);
  const EmbreeTracer embree(source, {});
  GBuffer gbuffer;
  gbuffer.resize({9, 7});
  AoFrame frame;
  frame.resize({9, 7});
  frame.ao.assign(63, 0.5f);
  frame.hit_distance.assign(63, 3.0f);
  Progress progress;
  trace_ao(source, embree, gbuffer, visibility_of(1), 0, frame, progress);
  for (size_t i = 0; i < 63; ++i) {
    EXPECT_EQ(frame.ao[i], kInvalidAo);
    EXPECT_EQ(frame.hit_distance[i], 0.0f);
  }
}

/// Cancellation is process-wide and cannot be undone, so these tests run in separate processes.
TEST(AoFrames, CancellingStopsWithinATile) {
  struct Guard {
    static void run() {
      const Scene scene = roofed(0);
      const FloatSource source(scene);
      const EmbreeTracer embree(source, {});
      const GBuffer gbuffer = test::point_gbuffer({0, 0, 0}, {0, 1, 0}, 1e-5f);
      AoFrame frame;
      Progress progress;
      Progress::cancel();
      try {
        trace_ao(source, embree, gbuffer, visibility_of(1), 0, frame, progress);
      } catch (const Error& error) {
        const bool finished = std::any_of(frame.ao.begin(), frame.ao.end(), [](float ao) { return ao != kInvalidAo; });
        std::_Exit(finished ? 1 : error.exit_code());
      }
      std::_Exit(0);
    }
  };
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(Guard::run(), testing::ExitedWithCode(7), "");
}

TEST(EmbreeTracer, CancellingStopsTheBuild) {
  struct Guard {
    static void run() {
      const Scene scene = roofed(0);
      const FloatSource source(scene);
      Progress::cancel();
      try {
        const EmbreeTracer embree(source, {});
      } catch (const Error& error) {
        std::_Exit(error.exit_code());
      }
      std::_Exit(0);
    }
  };
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(Guard::run(), testing::ExitedWithCode(7), "");
}

TEST(AoFrames, SameBytesForAnyThreadCountAndBuild) {
  Scene scene = roofed(0);
  scene.shapes.pop_back();
  for (int i = 0; i < 12; ++i)
    add_shape(scene, test::sphere({float(i % 4), 0.5f, float(i / 4)}, 0.45f, 20), i % 3 == 0 ? kTransmissive : 0u);
  const Camera camera = camera_at({2, 3, -5}, {2, 0, 1});
  AoConfig config = visibility_of(2, 2);
  for (const bool falloff : {false, true}) {
    config.falloff = falloff;
    const Rendered reference = render(scene, camera, {150, 90}, config);
    for (const size_t threads : {size_t{1}, size_t{2}, size_t{4}}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      const Rendered again = render(scene, camera, {150, 90}, config);
      EXPECT_EQ(std::memcmp(reference.ao.ao.data(), again.ao.ao.data(), again.ao.ao.size() * sizeof(float)), 0);
      EXPECT_EQ(std::memcmp(reference.ao.hit_distance.data(), again.ao.hit_distance.data(),
                            again.ao.hit_distance.size() * sizeof(float)),
                0);
    }
  }
}

TEST(AoFrames, AllBvhVariantsAgree) {
  Scene scene = roofed(0);
  scene.shapes.pop_back();
  for (int i = 0; i < 9; ++i) add_shape(scene, test::sphere({float(i % 3), 0.5f, float(i / 3)}, 0.49f, 24));
  const Camera camera = camera_at({2, 3, -5}, {1, 0, 1});
  const Rendered reference = render(scene, camera, {96, 64}, visibility_of(2));
  for (const EmbreeConfig& config : {EmbreeConfig{BvhQuality::kHigh, false}, EmbreeConfig{BvhQuality::kMedium, true}}) {
    const Rendered other = render(scene, camera, {96, 64}, visibility_of(2), config);
    uint32_t different = 0;
    for (size_t i = 0; i < other.ao.ao.size(); ++i) different += reference.ao.ao[i] != other.ao.ao[i];
    EXPECT_LE(different, 20u);
  }
}

} // namespace
} // namespace packtrace
