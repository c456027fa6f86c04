#include "runtime/ao/half_resolution.h"

#include <functional>
#include <optional>

#include <gtest/gtest.h>

namespace packtrace {
namespace {

/// A point on a surface, seen by an orthographic camera: pixel (x, y) looks along +z from (x, y, 0).
struct Seen {
  double z;
  Vec3 normal{0, 0, -1};
  float ao = 0.0f; ///< its occlusion
};
using View = std::function<std::optional<Seen>(double x, double y)>;

struct Picture {
  GBuffer surfaces;
  std::vector<float> ao;
};

Picture picture_of(ImageSize size, const View& view, double scale = 1.0) {
  Picture picture;
  GBuffer& g = picture.surfaces;
  g.resize(size);
  picture.ao.assign(size.pixels(), kInvalidAo);
  for (uint32_t y = 0; y < size.height; ++y)
    for (uint32_t x = 0; x < size.width; ++x) {
      const std::optional<Seen> seen = view(x, y);
      if (!seen) continue;
      const size_t i = size_t{y} * size.width + x;
      g.instance[i] = 0, g.view_z[i] = static_cast<float>(seen->z * scale);
      g.position[i] = Vec3(DVec3(x, y, seen->z) * scale);
      g.normal[i] = g.geometric_normal[i] = glm::normalize(seen->normal);
      picture.ao[i] = seen->ao;
    }
  return picture;
}

/// The picture's ambient occlusion, sampled at quarter resolution and upsampled again.
std::vector<float> at_quarter_resolution(const Picture& picture) {
  const HalfGBuffer half = halve(picture.surfaces);
  std::vector<float> ao;
  for (const uint32_t pixel : half.pixel) ao.push_back(picture.ao[pixel]);
  return upsample_ao<1>(picture.surfaces, half, {ao})[0];
}

/// Largest difference from the full picture.
float largest_error(ImageSize size, const View& view, double scale = 1.0) {
  const Picture picture = picture_of(size, view, scale);
  const std::vector<float> quarter = at_quarter_resolution(picture);
  EXPECT_EQ(quarter.size(), picture.ao.size());
  float largest = 0.0f;
  for (size_t i = 0; i < quarter.size(); ++i) largest = std::max(largest, std::abs(quarter[i] - picture.ao[i]));
  return largest;
}

constexpr float kLeak = 0.01f;

TEST(HalfResolution, HasOnePixelOfEachBlockAndTheRemainderOfOddSizes) {
  for (const ImageSize size : {ImageSize{1, 1}, {1, 5}, {6, 1}, {7, 4}, {8, 6}}) {
    const Picture picture = picture_of(size, [](double, double) { return Seen{1.0}; });
    const HalfGBuffer half = halve(picture.surfaces);
    EXPECT_EQ(half.gbuffer.size.width, (size.width + 1) / 2);
    EXPECT_EQ(half.gbuffer.size.height, (size.height + 1) / 2);
    for (size_t i = 0; i < half.pixel.size(); ++i) {
      EXPECT_EQ(half.pixel[i] % size.width / 2, i % half.gbuffer.size.width);
      EXPECT_EQ(half.pixel[i] / size.width / 2, i / half.gbuffer.size.width);
      EXPECT_EQ(half.gbuffer.position[i], picture.surfaces.position[half.pixel[i]]);
    }
  }
}

TEST(HalfResolution, ConstantsStayAndMissesStayMisses) {
  const View with_holes = [](double x, double y) -> std::optional<Seen> {
    if (static_cast<int>(x * 7 + y * 3) % 5 == 0) return std::nullopt;
    return Seen{10.0 + 0.5 * x + (static_cast<int>(y) % 4 == 0 ? 5.0 : 0.0), Vec3(-0.5f, 0, -1), 0.625f};
  };
  for (const ImageSize size : {ImageSize{1, 1}, {2, 1}, {1, 7}, {33, 17}, {40, 24}})
    EXPECT_EQ(largest_error(size, with_holes), 0.0f) << size.width;
}

TEST(HalfResolution, RampsOnSteepPlanesStay) {
  for (const double slope : {0.0, 0.2, 30.0}) {
    const auto plane = [&](double x, double y) {
      return Seen{100.0 + slope * (x + y), Vec3(static_cast<float>(slope), static_cast<float>(slope), -1),
                  static_cast<float>(0.1 + 0.01 * x + 0.02 * y)};
    };
    const ImageSize size{32, 20};
    const Picture picture = picture_of(size, plane);
    const std::vector<float> quarter = at_quarter_resolution(picture);
    for (uint32_t y = 0; y + 1 < size.height; ++y) // the last row and column have samples on one side only
      for (uint32_t x = 0; x + 1 < size.width; ++x)
        EXPECT_NEAR(quarter[y * size.width + x], picture.ao[y * size.width + x], 1e-5) << x << " " << y << " " << slope;
  }
}

TEST(HalfResolution, NothingLeaksAcrossStepsInDepth) {
  for (const double edge : {9.0, 10.0}) // within and between blocks
    for (const double step : {1.5, 10.0, 1000.0})
      EXPECT_LE(largest_error({21, 16},
                              [&](double x, double) {
                                return x < edge ? Seen{20.0, {0, 0, -1}, 0.0f} : Seen{20.0 + step, {0, 0, -1}, 1.0f};
                              }),
                kLeak)
          << edge << " " << step;
}

TEST(HalfResolution, NothingLeaksAcrossCreases) {
  for (const double edge : {9.0, 10.0})
    for (const double fold : {-1.0, 1.0}) // convex and concave
      EXPECT_LE(largest_error({21, 16},
                              [&](double x, double) {
                                const double d = x + 0.5 - edge;
                                return Seen{50.0 + fold * std::abs(d), Vec3(d < 0 ? -fold : fold, 0, -1),
                                            d < 0 ? 0.0f : 1.0f};
                              }),
                kLeak)
          << edge << " " << fold;
}

TEST(HalfResolution, SurfacesOnePixelWideHaveTheirOwnOcclusion) {
  const auto against_wall = [](const std::function<bool(int, int)>& front) {
    return [=](double x, double y) {
      return front(static_cast<int>(x), static_cast<int>(y)) ? Seen{5.0, {0, 0, -1}, 1.0f}
                                                             : Seen{50.0, {0, 0, -1}, 0.0f};
    };
  };
  const ImageSize size{40, 30};
  for (const int at : {10, 11}) {
    EXPECT_LE(largest_error(size, against_wall([=](int x, int) { return x == at; })), kLeak) << "column " << at;
    EXPECT_LE(largest_error(size, against_wall([=](int, int y) { return y == at; })), kLeak) << "row " << at;
    EXPECT_LE(largest_error(size, against_wall([=](int x, int y) { return x == y + at; })), kLeak) << "diagonal " << at;
    EXPECT_LE(largest_error(size, against_wall([=](int x, int y) { return x == at && y == at; })), kLeak)
        << "dot " << at;
  }
  EXPECT_LE(largest_error(size, against_wall([](int x, int) { return x % 8 == 3; })), kLeak) << "fence";
}

TEST(HalfResolution, PixelsUnlikeAllOthersGetValuesOfTheOthers) {
  const ImageSize size{16, 16};
  const Picture picture = picture_of(size, [](double x, double y) {
    const auto hash = static_cast<int>(x * 37 + y * 101) % 17;
    return Seen{10.0 + 100.0 * hash, Vec3(0.2f * static_cast<float>(hash % 5), 0, -1),
                0.25f + 0.5f * static_cast<float>(hash) / 16};
  });
  for (const float ao : at_quarter_resolution(picture)) {
    EXPECT_GE(ao, 0.25f);
    EXPECT_LE(ao, 0.75f);
  }
}

TEST(HalfResolution, DoesNotDependOnTheScale) {
  const View stairs = [](double x, double y) {
    return Seen{40.0 + 3.0 * (static_cast<int>(x) / 5) + 0.3 * y, Vec3(0, 0.3f, -1), static_cast<float>(x * 0.02)};
  };
  const std::vector<float> expected = at_quarter_resolution(picture_of({30, 20}, stairs));
  for (const double scale : {0x1p-100, 0x1p100})
    EXPECT_EQ(at_quarter_resolution(picture_of({30, 20}, stairs, scale)), expected);
}

} // namespace
} // namespace packtrace
