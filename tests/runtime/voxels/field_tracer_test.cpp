#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "compress/format/voxels/distance_field.h"
#include "runtime/ao/hemisphere.h"
#include "runtime/voxels/field_tracer.h"

namespace packtrace {
namespace {

constexpr uint32_t kSize = 64;

template <class Distance>
DistanceField field_of(const Distance& distance) {
  std::vector<float> distances;
  for (uint32_t z = 0; z < kSize; ++z)
    for (uint32_t y = 0; y < kSize; ++y)
      for (uint32_t x = 0; x < kSize; ++x) distances.push_back(distance(glm::vec3(x, y, z)));
  return encode_field({kSize, kSize, kSize}, distances, 16);
}

/// A ball on a floor, both thick.
float ball_on_floor(glm::vec3 p) { return std::min(glm::length(p - glm::vec3(32, 26, 32)) - 14.0f, p.y - 10.0f); }

TEST(FieldTracer, RaysMeetABallWhereItIs) {
  const DistanceField field = field_of([](glm::vec3 p) { return glm::length(p - 32.0f) - 20.0f; });
  const FieldTracer tracer(field, true);
  std::mt19937 random(4);
  const auto uniform = [&] { return static_cast<float>(random() >> 8) * 0x1p-24f; };
  uint64_t hits = 0, wrong = 0;
  for (int i = 0; i < 5000; ++i) {
    const glm::vec3 eye =
        32.0f + 80.0f * glm::normalize(2.0f * glm::vec3(uniform(), uniform(), uniform()) - 1.0f + 1e-5f);
    const glm::vec3 way = glm::normalize(64.0f * glm::vec3(uniform(), uniform(), uniform()) - eye);
    const float b = glm::dot(32.0f - eye, way), miss = glm::length(32.0f - eye - b * way);
    const auto hit = tracer.first_hit(eye, way, 0.0f, 1e9f);
    if (std::abs(miss - 20.0f) < 0.3f) continue; // grazes
    wrong += hit.has_value() != (miss < 20.0f);
    if (!hit || miss >= 20.0f) continue;
    ++hits;
    const float t = b - std::sqrt(400.0f - miss * miss);
    if (miss < 19.0f) {
      ASSERT_NEAR(hit->t, t, 0.3f);
      ASSERT_GT(glm::dot(hit->normal, (eye + t * way - 32.0f) / 20.0f), 0.99f);
    }
  }
  EXPECT_EQ(wrong, 0u);
  EXPECT_GT(hits, 1000u);
}

/// Normals that point inside make spots of full occlusion.
TEST(FieldTracer, NormalsOfGrazingRaysPointOutside) {
  const auto distance = [](glm::vec3 p) { return glm::length(p - 32.0f) - 20.0f; };
  const std::array<DistanceField, 2> fields = {field_of(distance),
                                               field_of([&](glm::vec3 p) { return std::abs(distance(p)); })};
  std::mt19937 random(8);
  const auto uniform = [&] { return static_cast<double>(random() >> 8) * 0x1p-24; };
  for (const bool has_sign : {true, false}) {
    const FieldTracer tracer(fields[has_sign ? 0 : 1], has_sign);
    uint64_t hits = 0;
    for (int i = 0; i < 20000; ++i) {
      const auto direction = [&] { return glm::normalize(glm::dvec3(uniform(), uniform(), uniform()) - 0.5); };
      const glm::dvec3 way = direction(), side = glm::normalize(glm::cross(way, direction()));
      const glm::dvec3 eye = 32.0 + (20.0 + uniform() * (has_sign ? 0.1 : 0.7)) * side - 50.0 * way;
      const auto hit = tracer.first_hit(eye, way, 0.0, 1e9);
      if (!hit) continue;
      ++hits;
      ASSERT_GT(glm::dot(glm::dvec3(hit->normal), eye + hit->t * way - 32.0), 0.0) << i;
      ASSERT_LT(glm::dot(glm::dvec3(hit->normal), way), 1e-3);
    }
    EXPECT_GT(hits, 2000u);
  }
}

TEST(FieldTracer, OcclusionByTapsAndConesIsNearThatOfRays) {
  const DistanceField field = field_of(ball_on_floor);
  const FieldTracer tracer(field, true);
  constexpr float kRadius = 12.0f;
  std::mt19937 random(6);
  const auto uniform = [&] { return static_cast<float>(random() >> 8) * 0x1p-24f; };
  double tap_error = 0.0, cone_error = 0.0, plain_error = 0.0;
  int count = 0;
  for (float x = 18.0f; x < 47.0f; x += 2.0f)
    for (float z = 18.0f; z < 47.0f; z += 2.0f) {
      const glm::vec3 p(x, 10.2f, z), up(0, 1, 0);
      if (ball_on_floor(p) < 0.15f) continue;
      int open = 0;
      constexpr int kRays = 256;
      for (int r = 0; r < kRays; ++r)
        open +=
            !tracer.first_hit(p + 0.3f * up, turned_to(up, cosine_direction({uniform(), uniform()})), 0.0f, kRadius);
      const double truth = static_cast<double>(open) / kRays;
      tap_error += std::abs(tracer.tap_visibility(p, up, kRadius) - truth);
      cone_error += std::abs(tracer.cone_visibility(p, up, kRadius) - truth);
      plain_error += 1.0 - truth;
      ++count;
    }
  tap_error /= count, cone_error /= count, plain_error /= count;
  std::printf("mean error against rays: taps %.3f, cones %.3f, no occlusion %.3f\n", tap_error, cone_error,
              plain_error);
  EXPECT_LT(cone_error, 0.12);
  EXPECT_LT(tap_error, 0.25);
  EXPECT_LT(cone_error, plain_error);
}

TEST(FieldTracer, SurfacesWithoutSignsStopRays) {
  const glm::vec3 up = glm::normalize(glm::vec3(0.3f, 1.0f, 0.2f));
  const DistanceField field = field_of([&](glm::vec3 p) { return std::abs(glm::dot(p - 32.0f, up)); });
  const FieldTracer tracer(field, false);
  for (float x = 20.0f; x < 44.0f; x += 0.37f) {
    const auto hit = tracer.first_hit({x, 60.0f, 31.3f}, {0, -1, 0}, 0.0f, 100.0f);
    ASSERT_TRUE(hit.has_value());
    ASSERT_NEAR(hit->t, 28.0f + (0.3f * (x - 32.0f) + 0.2f * -0.7f), 1.0f);
    ASSERT_GT(glm::dot(hit->normal, up), 0.95f);
  }
}

TEST(FieldTracer, AnOpenFloorIsNotOccluded) {
  const DistanceField field = field_of([](glm::vec3 p) { return p.y - 10.0f; });
  const FieldTracer tracer(field, true);
  EXPECT_GT(tracer.tap_visibility({32, 10.1f, 32}, {0, 1, 0}, 12.0f), 0.9f);
  EXPECT_GT(tracer.cone_visibility({32, 10.1f, 32}, {0, 1, 0}, 12.0f), 0.9f);
}

} // namespace
} // namespace packtrace
