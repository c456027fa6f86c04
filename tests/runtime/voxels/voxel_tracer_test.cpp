#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "compress/format/voxels/occupancy_stream.h"
#include "runtime/voxels/voxel_tracer.h"
#include "tests/sanitized.h"

namespace packtrace {
namespace {

/// Loose voxels, a slab and a hollow ball.
VoxelSet some_voxels(VoxelIndex size, uint32_t seed) {
  VoxelSet set(size);
  std::mt19937 random(seed);
  for (int i = 0; i < 60; ++i)
    set.set({static_cast<uint32_t>(random() % size[0]), static_cast<uint32_t>(random() % size[1]),
             static_cast<uint32_t>(random() % size[2])});
  for (uint32_t z = 0; z < size[2]; ++z)
    for (uint32_t y = 0; y < size[1]; ++y)
      for (uint32_t x = 0; x < size[0]; ++x) {
        const double d = glm::distance(glm::dvec3(x, y, z), 0.5 * glm::dvec3(size[0], size[1], size[2]));
        if (std::abs(d - 0.3 * size[0]) < 0.7 || (z == 1 && x > size[0] / 2)) set.set({x, y, z});
      }
  return set;
}

bool in_grid(const VoxelSet& set, const std::array<int64_t, 3>& v) {
  for (size_t a = 0; a < 3; ++a)
    if (v[a] < 0 || v[a] >= int64_t{set.size()[a]}) return false;
  return true;
}

/// Crosses the planes of the dense grid one after another, in the order of (t, axis).
/// @param counts whether voxels before the first empty one can be hit
template <class Real>
std::optional<VoxelHit<Real>> dense_walk(const VoxelSet& set, glm::vec<3, Real> o, glm::vec<3, Real> d, Real t_min,
                                         Real t_max, bool counts = true) {
  const glm::vec<3, Real> inverse = Real(1) / d;
  struct Crossing {
    Real t;
    int axis, step;
  };
  std::vector<Crossing> crossings;
  std::array<int64_t, 3> v;
  for (int a = 0; a < 3; ++a) {
    const auto count = static_cast<int64_t>(set.size()[static_cast<size_t>(a)]);
    v[static_cast<size_t>(a)] = d[a] > 0 ? -1 : d[a] < 0 ? count : static_cast<int64_t>(std::floor(o[a]));
    if (d[a] == 0) continue;
    for (int64_t p = 0; p <= count; ++p) crossings.push_back({(Real(p) - o[a]) * inverse[a], a, d[a] > 0 ? 1 : -1});
  }
  std::stable_sort(crossings.begin(), crossings.end(),
                   [](const Crossing& a, const Crossing& b) { return a.t < b.t || (a.t == b.t && a.axis < b.axis); });
  Real t = t_min;
  int axis = -1;
  for (size_t i = 0; i <= crossings.size(); ++i) {
    // The ray is in v from t to the next crossing.
    const Real next = i < crossings.size() ? crossings[i].t : std::numeric_limits<Real>::infinity();
    const bool later = next > t_min; // the voxel is left behind t_min
    if (later && t < t_max && in_grid(set, v)) {
      const bool occupied = set.contains(v[0], v[1], v[2]);
      if (occupied && counts) return VoxelHit<Real>{t, {uint32_t(v[0]), uint32_t(v[1]), uint32_t(v[2])}, axis};
      counts |= !occupied;
    }
    if (i == crossings.size()) break;
    v[static_cast<size_t>(crossings[i].axis)] += crossings[i].step;
    if (next > t_min) t = next, axis = crossings[i].axis;
  }
  return std::nullopt;
}

struct TestRay {
  glm::dvec3 o, d;
};

/// Random rays; rays along axes and diagonals on planes, edges and corners of voxels; rays that start inside.
std::vector<TestRay> test_rays(VoxelIndex size, size_t count) {
  std::mt19937 random(9);
  const glm::dvec3 extent(size[0], size[1], size[2]);
  const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
  std::vector<TestRay> rays;
  for (size_t i = 0; i < count; ++i) {
    TestRay ray{extent * (3.0 * glm::dvec3(uniform(), uniform(), uniform()) - 1.0),
                glm::dvec3(uniform(), uniform(), uniform()) * 2.0 - 1.0};
    if (i % 3 == 0) ray.o = glm::floor(ray.o);
    if (i % 5 == 0)
      ray.d = glm::dvec3(double(random() % 5) - 2.0, double(random() % 5) - 2.0, double(random() % 3) - 1.0);
    if (i % 7 == 0) ray.d = extent * glm::dvec3(uniform(), uniform(), uniform()) - ray.o;
    if (ray.d == glm::dvec3(0.0)) ray.d.x = 1.0;
    rays.push_back(ray);
  }
  return rays;
}

template <class Real>
void compare_with_dense(const OccupancyOptions& options) {
  for (const VoxelIndex size : {VoxelIndex{20, 20, 20}, VoxelIndex{33, 7, 50}, VoxelIndex{1, 1, 1}}) {
    const VoxelSet set = some_voxels(size, size[0]);
    const OccupancyStream stream = encode_occupancy(set, options);
    const VoxelTracer tracer(stream);
    uint64_t hits = 0;
    for (const TestRay& ray : test_rays(size, 20000)) {
      const glm::vec<3, Real> o(ray.o), d(ray.d);
      for (const Real t_min : {Real(0), Real(0.7)}) {
        const Real t_max = t_min == 0 ? std::numeric_limits<Real>::infinity() : Real(4);
        const auto expected = dense_walk<Real>(set, o, d, t_min, t_max);
        const auto got = tracer.first_hit(o, d, t_min, t_max);
        ASSERT_EQ(got.has_value(), expected.has_value())
            << ray.o.x << ' ' << ray.o.y << ' ' << ray.o.z << "  " << ray.d.x << ' ' << ray.d.y << ' ' << ray.d.z
            << " from " << t_min;
        if (!got) continue;
        ++hits;
        ASSERT_EQ(got->voxel, expected->voxel);
        ASSERT_EQ(got->t, expected->t);
        ASSERT_EQ(got->axis, expected->axis);
      }
    }
    EXPECT_GT(hits, 1000u);
  }
}

TEST(VoxelTracer, FindsTheVoxelOfADenseWalkForEveryRay) {
  for (const uint32_t levels : {0u, 2u, 5u, 9u}) {
    if (test::sanitized() && levels != 2) continue;
    OccupancyOptions options;
    options.levels = levels;
    compare_with_dense<double>(options);
    options.full = true;
    compare_with_dense<double>(options);
    compare_with_dense<float>(options);
  }
}

TEST(VoxelTracer, VoxelsBeforeTheFirstEmptyOneMayNotCount) {
  const VoxelIndex size = {20, 20, 20};
  const VoxelSet set = some_voxels(size, 4);
  for (const bool full : {false, true}) {
    OccupancyOptions options;
    options.full = full;
    const OccupancyStream stream = encode_occupancy(set, options);
    const VoxelTracer tracer(stream);
    constexpr double kFar = std::numeric_limits<double>::infinity();
    uint64_t hits = 0, later = 0; // later: behind the hit of first_hit()
    for (const TestRay& ray : test_rays(size, 20000)) {
      const auto expected = dense_walk<double>(set, ray.o, ray.d, 0.0, kFar, false);
      const auto got = tracer.first_hit_from_empty(ray.o, ray.d, 0.0, kFar);
      ASSERT_EQ(got.has_value(), expected.has_value());
      if (!got) continue;
      ++hits;
      ASSERT_EQ(got->voxel, expected->voxel);
      ASSERT_EQ(got->t, expected->t);
      later += got->t > tracer.first_hit(ray.o, ray.d, 0.0, kFar)->t ? 1 : 0;
    }
    EXPECT_GT(hits, 500u);
    EXPECT_GT(later, 50u);
  }
}

TEST(VoxelTracer, TheHitIsTheNearestOfAllVoxels) {
  const VoxelIndex size = {20, 20, 20};
  const VoxelSet set = some_voxels(size, 4);
  const OccupancyStream stream = encode_occupancy(set, {});
  std::mt19937 random(2);
  const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
  for (int i = 0; i < 3000; ++i) {
    const glm::dvec3 o = 20.0 * (3.0 * glm::dvec3(uniform(), uniform(), uniform()) - 1.0),
                     d = 2.0 * glm::dvec3(uniform(), uniform(), uniform()) - 1.0;
    double nearest = std::numeric_limits<double>::infinity();
    set.for_each([&](VoxelIndex v) {
      const glm::dvec3 a = (glm::dvec3(v[0], v[1], v[2]) - o) / d, b = (glm::dvec3(v[0], v[1], v[2]) + 1.0 - o) / d;
      const glm::dvec3 low = glm::min(a, b), high = glm::max(a, b);
      const double enter = std::max({low.x, low.y, low.z, 0.0}), leave = std::min({high.x, high.y, high.z});
      if (enter <= leave) nearest = std::min(nearest, enter);
    });
    const auto hit = VoxelTracer(stream).first_hit(o, d, 0.0, std::numeric_limits<double>::infinity());
    ASSERT_EQ(hit.has_value(), std::isfinite(nearest));
    if (hit.has_value()) {
      ASSERT_NEAR(hit->t, nearest, 1e-9 * (1.0 + nearest));
    }
  }
}

} // namespace
} // namespace packtrace
