#include "runtime/image/false_color.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <vector>

#include "runtime/image/painted.h"

namespace packtrace {

namespace {

/// painted() with colours clamped to [0,1].
template <class Function>
Image paint(ImageSize size, [[maybe_unused]] size_t values, const Function& color) {
  assert(values == size.pixels());
  return painted(size, [&](size_t i) { return glm::clamp(Vec3(color(i)), 0.0f, 1.0f); });
}

bool has_depth(float depth) { return depth > 0.0f && std::isfinite(depth); }

/// Linear sRGB of an OKLab colour given by lightness, chroma and hue in radians. Source: B. Ottosson, "A perceptual
/// color space for image processing", 2020.
Vec3 linear_rgb_from_oklch(float lightness, float chroma, float hue_rad) {
  const float a = chroma * std::cos(hue_rad), b = chroma * std::sin(hue_rad);
  const Vec3 root(lightness + 0.3963377774f * a + 0.2158037573f * b, lightness - 0.1055613458f * a - 0.0638541728f * b,
                  lightness - 0.0894841775f * a - 1.2914855480f * b);
  const Vec3 lms = root * root * root;
  return {4.0767416621f * lms.x - 3.3077115913f * lms.y + 0.2309699292f * lms.z,
          -1.2684380046f * lms.x + 2.6097574011f * lms.y - 0.3413193965f * lms.z,
          -0.0041960863f * lms.x - 0.7034186147f * lms.y + 1.7076147010f * lms.z};
}

} // namespace

Vec3 depth_color(float t) {
  // A helix around the grey axis with monotone lightness, so the picture stays readable in greyscale. Source: D. Green,
  // "A colour scheme for the display of astronomical intensity images", 2011, equation 2; start 0.5, -1.5 rotations,
  // hue 1, gamma 1.
  t = std::clamp(t, 0.0f, 1.0f);
  const float angle = 2.0f * std::numbers::pi_v<float> * (0.5f / 3.0f + 1.0f - 1.5f * t);
  const float amplitude = t * (1.0f - t) / 2.0f, c = std::cos(angle), s = std::sin(angle);
  return glm::clamp(Vec3(t + amplitude * (-0.14861f * c + 1.78277f * s), t + amplitude * (-0.29227f * c - 0.90649f * s),
                         t + amplitude * (1.97294f * c)),
                    0.0f, 1.0f);
}

Vec3 heat_color(float t) {
  const float level = t > 0.0f ? std::min(t, 1.0f) * 3.0f : 0.0f; // NaN maps to 0
  return glm::clamp(Vec3(level, level - 1.0f, level - 2.0f), 0.0f, 1.0f);
}

Vec3 level_color(uint32_t level) {
  constexpr Vec3 kLevelColors[] = {{0.72f, 0.72f, 0.72f}, {0.90f, 0.25f, 0.20f}, {0.95f, 0.55f, 0.15f},
                                   {0.95f, 0.85f, 0.25f}, {0.35f, 0.75f, 0.30f}, {0.15f, 0.70f, 0.65f},
                                   {0.25f, 0.45f, 0.90f}, {0.55f, 0.35f, 0.85f}, {0.90f, 0.45f, 0.75f}};
  return kLevelColors[std::min<size_t>(level, std::size(kLevelColors) - 1)];
}

Vec3 id_color(uint32_t id) {
  // Golden-ratio steps keep the hues of consecutive ids apart for any number of ids.
  const auto fraction = static_cast<float>(id * 0x9e3779b9u) * 0x1p-32f;
  // The hash decorrelates lightness from hue. Source: A. Appleby, MurmurHash3 finalizer, 2011.
  uint32_t mixed = id;
  mixed = (mixed ^ (mixed >> 16)) * 0x85ebca6bu;
  mixed = (mixed ^ (mixed >> 13)) * 0xc2b2ae35u;
  mixed ^= mixed >> 16;
  const float lightness = 0.60f + 0.12f * static_cast<float>(mixed % 3);
  const Vec3 linear = linear_rgb_from_oklch(lightness, 0.13f, 2.0f * std::numbers::pi_v<float> * fraction);
  Vec3 display;
  for (int k = 0; k < 3; ++k) display[k] = srgb_from_linear(std::clamp(linear[k], 0.0f, 1.0f));
  return display;
}

Image ao_preview(ImageSize size, std::span<const float> ao, Vec3 missing) {
  return paint(size, ao.size(),
               [&](size_t i) { return ao[i] >= 0.0f ? Vec3(srgb_from_linear(std::min(ao[i], 1.0f))) : missing; });
}

DepthRange depth_preview_range(std::span<const float> depth) {
  std::vector<float> sorted;
  std::copy_if(depth.begin(), depth.end(), std::back_inserter(sorted), has_depth);
  if (sorted.empty()) return {};
  const auto percentile = [&](size_t percent) {
    const auto nth = sorted.begin() + static_cast<ptrdiff_t>((sorted.size() - 1) * percent / 100);
    std::nth_element(sorted.begin(), nth, sorted.end());
    return *nth;
  };
  const float nearest = percentile(1);
  return {nearest, percentile(99)};
}

Vec3 depth_preview_color(float t) {
  return depth_color(0.95f - 0.85f * t);
} // stays above black, which may mean missing

Image depth_preview(ImageSize size, std::span<const float> depth, Vec3 missing) {
  const DepthRange range = depth_preview_range(depth);
  const float lo = std::log(range.nearest), hi = std::log(range.farthest);
  return paint(size, depth.size(), [&](size_t i) {
    if (!has_depth(depth[i])) return missing;
    const float t = hi > lo ? std::clamp((std::log(depth[i]) - lo) / (hi - lo), 0.0f, 1.0f) : 0.5f;
    return depth_preview_color(t);
  });
}

Image normal_preview(ImageSize size, std::span<const Vec3> normals, Vec3 missing) {
  return paint(size, normals.size(),
               [&](size_t i) { return normals[i] != Vec3(0) ? 0.5f + 0.5f * normals[i] : missing; });
}

Image id_preview(ImageSize size, std::span<const uint32_t> ids, Vec3 missing) {
  return paint(size, ids.size(), [&](size_t i) { return ids[i] != kNoInstance ? id_color(ids[i]) : missing; });
}

Image level_preview(ImageSize size, std::span<const uint32_t> levels, std::span<const uint32_t> clusters,
                    std::span<const float> shade, Vec3 missing) {
  assert(clusters.size() == levels.size() && shade.size() == levels.size());
  return paint(size, levels.size(), [&](size_t i) {
    if (shade[i] < 0.0f) return missing;
    const float own = 0.82f + 0.06f * static_cast<float>((clusters[i] * 0x9e3779b9u) >> 30);
    return level_color(levels[i]) * (own * (0.3f + 0.7f * srgb_from_linear(std::min(shade[i], 1.0f))));
  });
}

Vec3 scalar_color(float t) { return depth_color(0.06f + 0.86f * std::clamp(t, 0.0f, 1.0f)); }

Vec3 direction_color(float turns) {
  const Vec3 linear = linear_rgb_from_oklch(0.75f, 0.12f, 2.0f * std::numbers::pi_v<float> * turns);
  Vec3 display;
  for (int k = 0; k < 3; ++k) display[k] = srgb_from_linear(std::clamp(linear[k], 0.0f, 1.0f));
  return display;
}

float scale_end(std::span<const float> values) {
  std::vector<float> sorted;
  std::copy_if(values.begin(), values.end(), std::back_inserter(sorted), has_depth);
  if (sorted.empty()) return 1.0f;
  const auto nth = sorted.begin() + static_cast<ptrdiff_t>((sorted.size() - 1) * 99 / 100);
  std::nth_element(sorted.begin(), nth, sorted.end());
  return *nth;
}

Image scalar_preview(ImageSize size, std::span<const float> values, float bright) {
  assert(bright > 0.0f);
  return paint(size, values.size(),
               [&](size_t i) { return scalar_color(values[i] > 0.0f ? values[i] / bright : 0.0f); });
}

Image vector_preview(ImageSize size, std::span<const Vec2> vectors, float bright) {
  assert(bright > 0.0f);
  return paint(size, vectors.size(), [&](size_t i) {
    const float length = std::min(glm::length(vectors[i]) / bright, 1.0f);
    if (!(length > 0.0f)) return Vec3(0.1f); // also for NaN
    const float angle = std::atan2(vectors[i].y, vectors[i].x) / (2.0f * std::numbers::pi_v<float>);
    return glm::mix(Vec3(0.1f), direction_color(angle < 0.0f ? angle + 1.0f : angle), length);
  });
}

Image heat_map(ImageSize size, std::span<const float> errors, float white) {
  assert(white > 0.0f);
  return paint(size, errors.size(), [&](size_t i) { return heat_color(errors[i] / white); });
}

} // namespace packtrace
