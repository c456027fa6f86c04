#include <algorithm>
#include <cstdio>

#include <gtest/gtest.h>

#include "pbrt_import/base/error.h"
#include "runtime/camera/primary_visibility.h"
#include "runtime/trace/embree/embree_tracer.h"
#include "tests/runtime/trace/moving_scenes.h"

namespace packtrace {
namespace {

using test::BakedScene;
using test::camera_at;
using test::movers_from;
using test::placed;
using test::transforms_of;

constexpr ImageSize kVectorImage{160, 120};
constexpr uint32_t kFloorOnly = 1; ///< number of instances in world space

Scene dancers(uint32_t count) {
  Scene scene;
  test::add_shape(scene, test::quad({-20, 0, -20}, {0, 0, 40}, {40, 0, 0}));
  test::add_object(scene, test::sphere({0, 0, 0}, 1, 16));
  test::add_object(scene, test::box({-1, -0.5f, -0.7f}, {1, 0.5f, 0.7f}));
  for (uint32_t i = 0; i < count; ++i) scene.instances.push_back({i % 2, Affine(placed({0, 2.0 * i, 0}))});
  return scene;
}

double between(std::mt19937& random, double lo, double hi) {
  return std::uniform_real_distribution<double>(lo, hi)(random);
}

/// Places and turns of the instances at one time; neighbouring times differ by about a tenth of an object's size.
std::vector<Affine> dance(uint32_t count, double time) {
  std::vector<Affine> result{Affine(1.0f)};
  for (uint32_t i = 0; i < count; ++i) {
    const double phase = 1.7 * i + time;
    const DVec3 place(6 * std::sin(phase), 1.5 + std::cos(2.3 * phase), 6 * std::cos(0.7 * phase + i));
    result.push_back(
        Affine(placed(place, {1 + 0.2 * std::sin(phase), 1, i % 3 == 0 ? -1.0 : 1.0}, 40 * phase, {1, phase, 2})));
  }
  return result;
}

/// Object-space triangles of a source, decoded.
struct DecodedSource {
  explicit DecodedSource(const SceneSource& source)
      : positions(source.geometry_count()), triangles(source.geometry_count()) {
    for (uint32_t g = 0; g < source.geometry_count(); ++g) {
      positions[g].resize(source.counts(g).vertices), triangles[g].resize(source.counts(g).triangles);
      source.decode(g, positions[g], triangles[g]);
    }
  }

  std::array<DVec3, 3> placed_corners(uint32_t geometry, uint32_t triangle, const Affine& world_from_object) const {
    const Triangle t = triangles[geometry][triangle];
    const auto corner = [&](uint32_t v) {
      return transform_point(DAffine(world_from_object), DVec3(positions[geometry][v]));
    };
    return {corner(t.x), corner(t.y), corner(t.z)};
  }

  std::vector<std::vector<Vec3>> positions;
  std::vector<std::vector<Triangle>> triangles;
};

/// Weights of the corners at the point of a triangle's plane nearest to a point, from areas.
DVec3 weights_at(const std::array<DVec3, 3>& v, DVec3 p) {
  const DVec3 normal = glm::cross(v[1] - v[0], v[2] - v[0]);
  const double area = glm::dot(normal, normal);
  const double b = glm::dot(glm::cross(v[2] - p, v[0] - p), normal) / area;
  const double c = glm::dot(glm::cross(v[0] - p, v[1] - p), normal) / area;
  return {1.0 - b - c, b, c};
}

struct Errors {
  std::vector<double> motion_px, depth; ///< absolute; relative

  static double quantile(std::vector<double>& values, double q) {
    std::ranges::sort(values);
    return values[std::min(values.size() - 1, static_cast<size_t>(q * static_cast<double>(values.size())))];
  }
  void print(const char* name) {
    std::printf("%s: %zu points, motion error in pixels 50 %% %.2g, 99 %% %.2g, 99.9 %% %.2g, max %.2g; "
                "relative depth error 99.9 %% %.2g, max %.2g\n",
                name, motion_px.size(), quantile(motion_px, 0.5), quantile(motion_px, 0.99), quantile(motion_px, 0.999),
                quantile(motion_px, 1.0), quantile(depth, 0.999), quantile(depth, 1.0));
  }
};

/// Adds the difference of moved points between the G-buffer and the decoded triangles.
void add_errors(const SceneSource& source, const DecodedSource& decoded, const GBuffer& g, std::span<const Affine> now,
                std::span<const Affine> before, const PrimaryCamera& camera_before, Errors& errors) {
  for (size_t pixel = 0; pixel < g.size.pixels(); ++pixel) {
    const uint32_t i = g.instance[pixel];
    if (i == kNoInstance) continue;
    const uint32_t geometry = source.instances()[i].geometry;
    const DVec3 w = weights_at(decoded.placed_corners(geometry, g.triangle[pixel], now[i]), DVec3(g.position[pixel]));
    const std::array<DVec3, 3> then = decoded.placed_corners(geometry, g.triangle[pixel], before[i]);
    const auto projected = camera_before.project(then[0] * w.x + then[1] * w.y + then[2] * w.z);
    ASSERT_TRUE(projected.has_value());
    const glm::dvec2 centre(0.5 + static_cast<double>(pixel % g.size.width),
                            0.5 + static_cast<double>(pixel / g.size.width));
    errors.motion_px.push_back(glm::length(centre - projected->pixel - glm::dvec2(g.motion_px[pixel])));
    errors.depth.push_back(std::abs(double{g.previous_z[pixel]} / projected->view_z - 1.0));
  }
}

/// Follows the motion of every seventh pixel back: the ray through that place of the previous image must hit the same
/// point of the same triangle, unless another surface was in front of it or the place lies at an edge.
void expect_found_in_previous_frame(const GBuffer& g, const RayTracer& before, const Camera& camera_before,
                                    size_t& found, size_t& other) {
  for (size_t pixel = 0; pixel < g.size.pixels(); pixel += 7) {
    if (g.instance[pixel] == kNoInstance) continue;
    const glm::dvec2 centre(0.5 + static_cast<double>(pixel % g.size.width),
                            0.5 + static_cast<double>(pixel / g.size.width));
    const glm::dvec2 shift = centre - glm::dvec2(g.motion_px[pixel]) - 0.5;
    const PrimaryCamera aimed(camera_before, g.size, shift);
    const CameraRay ray = aimed.ray(0, 0);
    const Ray traced{Vec3(before.space().to_unit(ray.origin)), 0.0f, Vec3(ray.direction)};
    const std::vector<RayHit> hits = test::closest(before, {&traced, 1});
    if (!hits[0].valid()) {
      ++other;
      continue;
    }
    const HitSurface hit = before.resolve(hits[0]);
    const DVec3 place = ray.origin + ray.direction * (double{hits[0].t} * before.space().inverse_scale());
    const bool same = hit.placement->instance == g.instance[pixel] &&
                      std::abs(aimed.view_z(place) / double{g.previous_z[pixel]} - 1.0) < 1e-3;
    ++(same ? found : other);
  }
}

/// Frames of random cameras and moving instances.
template <typename Make>
void check_motion(const char* name, const SceneSource& source, uint32_t count, const Make& make) {
  const std::unique_ptr<RayTracer> tracer = make(), behind = make();
  const DecodedSource decoded(source);
  const Movers movers = movers_from(kFloorOnly, source, {});
  std::mt19937 random(17);
  Errors errors;
  size_t found = 0, other = 0;
  std::vector<Affine> before = dance(count, 0.0);
  for (uint32_t frame = 1; frame <= 8; ++frame) {
    const std::vector<Affine> now = dance(count, 0.06 * frame);
    tracer->place_instances(movers.instances, std::span(now).subspan(kFloorOnly));
    behind->place_instances(movers.instances, std::span(before).subspan(kFloorOnly));
    const DVec3 eye(between(random, -4, 4), between(random, 3, 7), -12);
    const Camera then = camera_at(eye, {0, 1, 0});
    const Camera here =
        camera_at(eye + DVec3(between(random, -0.3, 0.3), 0.1, between(random, -0.5, 0.5)), {0.1, 1, 0});
    const PrimaryCamera camera(here, kVectorImage), camera_before(then, kVectorImage);
    GBuffer g;
    Progress progress;
    trace_primary(source, *tracer, camera, PreviousFrame{camera_before, before}, g, progress);
    add_errors(source, decoded, g, now, before, camera_before, errors);
    expect_found_in_previous_frame(g, *behind, then, found, other);
    before = now;
  }
  errors.print(name);
  EXPECT_GT(errors.motion_px.size(), 80000u);
  EXPECT_LE(Errors::quantile(errors.motion_px, 0.999), 0.05);
  EXPECT_LE(Errors::quantile(errors.depth, 0.999), 1e-4);
  EXPECT_GT(found, 10000u);
  EXPECT_LT(other, found / 10) << "hidden in the previous frame";
}

TEST(MotionVectors, LeadToWherePointsOfMovingInstancesWere) {
  constexpr uint32_t kCount = 14;
  const BakedScene baked(dancers(kCount));
  const Movers movers = movers_from(kFloorOnly, baked.source, {{-9, -2, -9}, {9, 5, 9}});
  check_motion("packed", baked.source, kCount,
               [&] { return std::make_unique<PackedTracer>(baked.file, baked.source, chosen_isa(), movers); });
  check_motion("embree", baked.source, kCount,
               [&] { return std::make_unique<EmbreeTracer>(baked.source, EmbreeConfig{}, movers); });
}

struct Stage {
  Stage() { tracer.place_instances(movers.instances, std::span(now).subspan(kFloorOnly)); }

  GBuffer trace(const PrimaryCamera& camera, const PreviousFrame& previous) const {
    GBuffer g;
    Progress progress;
    trace_primary(baked.source, tracer, camera, previous, g, progress);
    return g;
  }

  const BakedScene baked{dancers(6)};
  const Movers movers = movers_from(kFloorOnly, baked.source, {{-9, -2, -9}, {9, 5, 9}});
  PackedTracer tracer{baked.file, baked.source, chosen_isa(), movers};
  const std::vector<Affine> now = dance(6, 1.0), before = dance(6, 0.9);
  const Camera view = camera_at({0, 5, -12}, {0, 1, 0});
};

TEST(MotionVectors, AreZeroWhereNothingMoves) {
  const Stage stage;
  const PrimaryCamera camera(stage.view, kVectorImage);
  const GBuffer still = stage.trace(camera, {camera});
  EXPECT_TRUE(still.previous_z.empty());
  EXPECT_TRUE(std::ranges::all_of(still.motion_px, [](Vec2 m) { return m == Vec2(0); }));
  const GBuffer g = stage.trace(camera, {camera, stage.before});
  size_t moved = 0;
  for (size_t i = 0; i < kVectorImage.pixels(); ++i) {
    if (g.instance[i] == 0 || g.instance[i] == kNoInstance) {
      EXPECT_EQ(g.motion_px[i], Vec2(0));
      EXPECT_EQ(g.previous_z[i], g.view_z[i]);
    } else {
      moved += g.motion_px[i] != Vec2(0);
    }
  }
  EXPECT_GT(moved, 500u);
  const GBuffer unmoved = stage.trace(camera, {camera, stage.now});
  EXPECT_TRUE(std::ranges::all_of(unmoved.motion_px, [](Vec2 m) { return m == Vec2(0); }));
  EXPECT_EQ(unmoved.previous_z, unmoved.view_z);
}

/// Vertices that all were higher by one in the previous frame.
class Fallen final : public SurfaceHistory {
public:
  Fallen(const SceneSource& source, uint32_t instance) : decoded_(source), source_(source), instance_(instance) {}

  std::optional<DVec3> previous_position(uint32_t instance, uint32_t triangle, glm::dvec2 barycentrics) const override {
    if (instance != instance_) return std::nullopt;
    const auto v = decoded_.placed_corners(source_.instances()[instance].geometry, triangle, Affine(1.0f));
    return v[0] + (v[1] - v[0]) * barycentrics.x + (v[2] - v[0]) * barycentrics.y + DVec3(0, 1, 0);
  }

private:
  const DecodedSource decoded_;
  const SceneSource& source_;
  const uint32_t instance_;
};

TEST(MotionVectors, FollowDeformingSurfaces) {
  const Stage stage;
  const PrimaryCamera camera(stage.view, kVectorImage);
  const Fallen fallen(stage.baked.source, 0); // the floor
  const GBuffer g = stage.trace(camera, {camera, {}, &fallen});
  size_t floor = 0;
  for (size_t i = 0; i < kVectorImage.pixels(); ++i) {
    if (g.instance[i] != 0) {
      EXPECT_EQ(g.motion_px[i], Vec2(0));
      continue;
    }
    ++floor;
    const auto then = camera.project(DVec3(g.position[i]) + DVec3(0, 1, 0));
    const auto here = camera.project(DVec3(g.position[i]));
    EXPECT_NEAR(glm::length(here->pixel - then->pixel - glm::dvec2(g.motion_px[i])), 0.0, 1e-3);
    EXPECT_NEAR(g.previous_z[i] / then->view_z, 1.0, 1e-5);
  }
  EXPECT_GT(floor, 5000u);
}

TEST(MotionVectors, NeedTransformsOfAllInstances) {
  const Stage stage;
  const PrimaryCamera camera(stage.view, kVectorImage);
  EXPECT_THROW(stage.trace(camera, {camera, std::span(stage.before).first(3)}), Error);
}

} // namespace
} // namespace packtrace
