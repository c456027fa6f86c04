#pragma once

// Where histories come from: part of history_rows_body.h.

#include <array>
#include <limits>

#include "runtime/denoise/kernels/history_rows.h"
#include "runtime/denoise/kernels/row_math.h"
#include "runtime/denoise/kernels/units.h"

namespace packtrace {
namespace {

constexpr float kLargest = std::numeric_limits<float>::max(), kSmallest = std::numeric_limits<float>::min();

/// Magnitude of the smaller one-sided difference (DepthDerivatives), for centres that are not 0.
inline F32 smaller_step(F32 before, F32 centre, F32 after) {
  const I32 has_before = before > 0.0f, has_after = after > 0.0f;
  const F32 backward = select(has_before, magnitude(centre - before), all(kLargest));
  const F32 least = lesser(backward, select(has_after, magnitude(after - centre), all(kLargest)));
  return select(has_before | has_after, least, F32{});
}

/// Motion of `count` pixels, or of as many as a vector holds.
struct Motion {
  F32 x, y;
  I32 still;

  Motion(int count, const float* motion) {
    const F32 first = load_first(2 * count, motion), second = load_first(2 * count - kFloats, motion + kFloats);
    x = even_lanes(first, second), y = odd_lanes(first, second);
    still = both(magnitude(x) <= kStillMotion, magnitude(y) <= kStillMotion);
  }
};

template <bool kMovedInDepth>
void locate_pixels(int width, const MovingRow& row, const LocateTerms& terms, const LocatedRow& located) {
  const MovingRow r = row;
  const LocateTerms t = terms;
  const LocatedRow o = located;
  const int stride = static_cast<int>(t.stride), row_y = static_cast<int>(t.y);
  for (int x = 0; x < width; x += kFloats) {
    const Motion m(width - x, r.motion + 2 * x);
    const I32 columns = x + kEachLane;
    const F32 from_x = as_floats(columns) - select(m.still, F32{}, m.x), from_y = t.y - select(m.still, F32{}, m.y);
    const F32 now = load(r.here + x);
    F32 before = now;
    I32 inside = now > 0.0f;
    if constexpr (kMovedInDepth) {
      const F32 z = load_first(width - x, r.previous_z + x);
      inside = both(both(inside, z >= kNearestDepth), z <= kFarthestDepth);
      before = select(inside, 1.0f / z, F32{});
    }
    // False for NaN, too. The conversions to integers below cannot overflow.
    inside = both(both(inside, from_x > -1.0f), from_x < t.width);
    inside = both(both(inside, from_y > -1.0f), from_y < t.height);
    const F32 at_x = select(inside, from_x, F32{}), at_y = select(inside, from_y, F32{});
    const I32 column = rounded_down(at_x), line = rounded_down(at_y);
    F32 slope = smaller_step(load(r.here + x - 1), now, load(r.here + x + 1)) +
                smaller_step(load(r.above + x), now, load(r.below + x));
    slope = select(now > 0.0f, slope, F32{});
    if constexpr (kMovedInDepth) slope *= before / greater(now, all(kSmallest));
    store(o.offset + x, inside ? (line - row_y) * stride + (column - columns) : I32{} + kNoOffset);
    store(o.fraction_x + x, at_x - as_floats(column));
    store(o.fraction_y + x, at_y - as_floats(line));
    store(o.disparity + x, select(inside, before, F32{}));
    store(o.tolerance + x, t.depth * before + t.slope * slope + kSmallest);
    store(o.longest + x, select(m.still, all(t.longest_still), all(t.longest_moving)));
  }
}

void locate_row(int width, const MovingRow& row, const LocateTerms& terms, const LocatedRow& located) {
  (row.previous_z != nullptr ? locate_pixels<true> : locate_pixels<false>)(width, row, terms, located);
}

/// The difference between Catmull-Rom and linear interpolation between a and b, where before and after are the outer
/// neighbours: -t (1 - t) / 2 times the linearly interpolated second differences at a and b.
/// Source: R. Keys, "Cubic convolution interpolation for digital image processing", 1981, a = -1/2.
inline F32 sharpening(F32 before, F32 a, F32 b, F32 after, F32 t) {
  return -0.5f * t * (1.0f - t) * ((1.0f - t) * (before - 2.0f * a + b) + t * (a - 2.0f * b + after));
}

/// The surface that the history of some pixels must show.
struct WantedSurfaces {
  F32 disparity, tolerance;
  I32 normal_xy, normal_z, instance;
};

inline WantedSurfaces load(const WantedRow& w, int x) {
  return {load(w.at.disparity + x), load(w.at.tolerance + x), load_pairs(w.normal_x + x, w.normal_y + x),
          load_wide(w.normal_z + x) & 0xffff, load(w.instance + x)};
}

/// The same surface in all lanes.
inline WantedSurfaces one_of(const WantedRow& w, int x) {
  const auto x_and_y = static_cast<uint32_t>(static_cast<uint16_t>(w.normal_x[x])) |
                       static_cast<uint32_t>(static_cast<uint16_t>(w.normal_y[x])) << 16;
  return {all(w.at.disparity[x]), all(w.at.tolerance[x]), I32{} + static_cast<int32_t>(x_and_y),
          I32{} + static_cast<uint16_t>(w.normal_z[x]), I32{} + static_cast<int32_t>(w.instance[x])};
}

/// Returns a mask of the lanes whose previous pixel shows the same surface and has a history.
/// @param ignored bits in which instances may differ
inline I32 shows(const PreviousPixels& p, ptrdiff_t at, const WantedSurfaces& w, int32_t ignored) {
  const F32 there = load(p.disparity + at);
  const I32 differs = (load(p.instance + at) ^ w.instance) & ~ignored;
  const I32 near = magnitude(there - w.disparity) <= 2.0f * w.tolerance;
  return both(both(lesser(there, load(p.samples + at)) > 0.0f, near), differs == 0);
}

/// Weighted sums of what the history has at the pixels around.
struct HistorySums {
  F32 weight{}, mean{}, square{}, fast{}, samples{};

  /// Weighted by similarity, up to 1 for a perfect match.
  /// @param same shows()
  /// @param near weight of the pixels by their distance
  template <int kSquarings>
  void add(const PreviousPixels& p, ptrdiff_t at, const WantedSurfaces& w, I32 same, F32 near) {
    const F32 distance = magnitude(load(p.disparity + at) - w.disparity);
    const I32 dot = sum_of_products(w.normal_xy, load_pairs(p.normal_x + at, p.normal_y + at)) +
                    sum_of_products(w.normal_z, load_wide(p.normal_z + at));
    F32 agreement = lesser(greater(as_floats(dot) * (1.1f * kSquaredNormalUnit), all(0.0f)), all(1.0f));
    for (int i = 0; i < kSquarings; ++i) agreement *= agreement;
    if (any_greater(distance, w.tolerance)) agreement *= w.tolerance / greater(distance, w.tolerance);
    const F32 part = select(same, near * agreement, all(0.0f));
    weight += part;
    mean += part * load(p.mean + at);
    square += part * as_floats(load_wide(p.square + at));
    fast += part * as_floats(load_wide(p.fast + at));
    samples += part * load(p.samples + at);
  }
};

/// Linear interpolation.
/// @param weights sum of the weights, 0 where the history is rejected
template <int kSquarings>
void interpolate_run(int width, const PreviousPixels& from, const WantedRow& wanted, bool test_instances,
                     const PastRow& out, float* weights) {
  const PreviousPixels p = from;
  const WantedRow w = wanted;
  const PastRow o = out;
  const ptrdiff_t s = p.stride;
  const int32_t ignored = test_instances ? 0 : -1;
  for (int x = 0; x < width; x += kFloats) {
    const WantedSurfaces surfaces = load(w, x);
    const F32 fx = load(w.at.fraction_x + x), fy = load(w.at.fraction_y + x), nothing{};
    HistorySums sums;
    const auto corner = [&](ptrdiff_t at, F32 bilinear) {
      if (any_greater(bilinear, nothing))
        sums.add<kSquarings>(p, at, surfaces, shows(p, at, surfaces, ignored), bilinear);
    };
    corner(x, (1.0f - fx) * (1.0f - fy));
    corner(x + 1, fx * (1.0f - fy));
    corner(x + s, (1.0f - fx) * fy);
    corner(x + s + 1, fx * fy);
    const I32 found = both(sums.weight > kMinHistoryWeight, surfaces.disparity > 0.0f);
    const F32 scale = select(found, 1.0f / sums.weight, nothing);
    store(weights + x, select(found, sums.weight, nothing));
    store(o.mean + x, lesser(sums.mean * scale, all(1.0f)));
    store(o.square + x, sums.square * scale * (1.0f / kMomentUnits));
    store(o.fast + x, sums.fast * scale * (1.0f / kMomentUnits));
    store(o.samples + x, select(found, lesser(sums.samples, load(w.at.longest + x)), nothing));
  }
}

/// Bicubic interpolation of the mean, where its footprint and the eight neighbours that share edges with it lie on one
/// surface: a hard test without normals.
void sharpen_run(int width, const PreviousPixels& from, const WantedRow& wanted, const PastRow& out,
                 const float* weights) {
  const PreviousPixels p = from;
  const WantedRow w = wanted;
  const PastRow o = out;
  const ptrdiff_t s = p.stride;
  for (int x = 0; x < width; x += kFloats) {
    const F32 fx = load(w.at.fraction_x + x), fy = load(w.at.fraction_y + x), nothing{};
    const I32 wanted_here = both(load(weights + x) > kMinSharpenWeight, fx + fy > 0.0f);
    if (!any(wanted_here)) continue;
    const F32 disparity = load(w.at.disparity + x);
    const I32 instance = load(w.instance + x);
    F32 farthest{}, fewest = all(kLargest);
    I32 differs{};
    const auto tap = [&](ptrdiff_t at) {
      differs |= load(p.instance + at) ^ instance;
      fewest = lesser(fewest, load(p.samples + at));
      farthest = greater(farthest, magnitude(load(p.disparity + at) - disparity));
      return load(p.mean + at);
    };
    const F32 m00 = tap(x), m10 = tap(x + 1), m01 = tap(x + s), m11 = tap(x + s + 1);
    const F32 left0 = tap(x - 1), right0 = tap(x + 2), left1 = tap(x + s - 1), right1 = tap(x + s + 2);
    const F32 above0 = tap(x - s), below0 = tap(x + 2 * s), above1 = tap(x - s + 1), below1 = tap(x + 2 * s + 1);
    const I32 matches = both(farthest <= load(w.at.tolerance + x), fewest > 0.0f);
    const I32 same = both(both(wanted_here, matches), differs == 0);
    if (!any(same)) continue;
    const F32 along_x =
        (1.0f - fy) * sharpening(left0, m00, m10, right0, fx) + fy * sharpening(left1, m01, m11, right1, fx);
    const F32 along_y =
        (1.0f - fx) * sharpening(above0, m00, m01, below0, fy) + fx * sharpening(above1, m10, m11, below1, fy);
    const F32 linear = load(o.mean + x);
    const F32 sharp = lesser(greater(linear + select(same, along_x + along_y, nothing), nothing), all(1.0f));
    store(o.mean + x, sharp);
    store(o.square + x, load(o.square + x) + (sharp - linear) * (sharp + linear)); // keeps the variance
  }
}

template <int kSquarings>
void resample_run(int width, const PreviousPixels& from, const WantedRow& wanted, bool test_instances,
                  const PastRow& out, float* weights) {
  interpolate_run<kSquarings>(width, from, wanted, test_instances, out, weights);
  sharpen_run(width, from, wanted, out, weights);
}

/// The sum of the pixels of a square, column by column.
inline float sum_of_columns(F32 first, F32 second) {
  std::array<float, 2 * kFloats> each;
  store(each.data(), first), store(each.data() + kFloats, second);
  float sum = 0.0f;
  for (int i = 0; i <= 2 * kNearbyRadius; ++i) sum += each[static_cast<size_t>(i)];
  return sum;
}

template <int kSquarings>
void look_nearby(int x, const PreviousPixels& from, const WantedRow& wanted, bool test_instances,
                 const NearbyTerms& terms, const PastRow& out) {
  // The square is centred at the footprint's nearest pixel. It stays within the borders of the planes.
  const float fx = wanted.at.fraction_x[x], fy = wanted.at.fraction_y[x];
  const int left = (fx >= 0.5f ? 1 : 0) - kNearbyRadius, top = (fy >= 0.5f ? 1 : 0) - kNearbyRadius;
  constexpr int kSide = 2 * kNearbyRadius + 1, kVectors = (kSide + kFloats - 1) / kFloats;
  static_assert(kVectors <= 2);
  const WantedSurfaces surface = one_of(wanted, x);
  const int32_t ignored = test_instances ? 0 : -1;
  std::array<HistorySums, 2> columns;
  for (int i = 0; i < kVectors; ++i) {
    const I32 column = i * kFloats + kEachLane;
    const F32 away_x = as_floats(column + left) - fx;
    const I32 in_square = column < kSide;
    for (int dy = top; dy < top + kSide; ++dy) {
      const ptrdiff_t at = x + dy * from.stride + left + i * kFloats;
      const I32 same = both(in_square, shows(from, at, surface, ignored));
      if (!any(same)) continue;
      const float away_y = static_cast<float>(dy) - fy;
      const F32 reach = 1.0f - (away_x * away_x + away_y * away_y) * (1.0f / (kNearbyReach * kNearbyReach));
      const F32 near = greater(reach, F32{});
      columns[static_cast<size_t>(i)].add<kSquarings>(from, at, surface, same, near * near);
    }
  }
  const auto sum = [&](F32 HistorySums::* sums) { return sum_of_columns(columns[0].*sums, columns[1].*sums); };
  const float weight = sum(&HistorySums::weight);
  if (!(weight > kMinHistoryWeight)) return;
  const float scale = 1.0f / weight;
  out.mean[x] = lesser(sum(&HistorySums::mean) * scale, 1.0f);
  out.square[x] = sum(&HistorySums::square) * scale * (1.0f / kMomentUnits);
  out.fast[x] = sum(&HistorySums::fast) * scale * (1.0f / kMomentUnits);
  out.samples[x] = terms.share * lesser(sum(&HistorySums::samples) * scale, terms.longest);
}

/// The first pixel from x on for which found(x) has a lane that is true; or `width`.
template <typename Found>
int first_lane(int x, int width, const Found& found) {
  for (; x < width; x += kFloats) {
    const I32 lanes = both(found(x), kEachLane < width - x);
    if (!any(lanes)) continue;
    int lane = 0;
    while (lanes[lane] == 0) ++lane;
    return x + lane;
  }
  return width;
}

Run next_run(int x, int width, const int32_t* offsets) {
  const int first = first_lane(x, width, [=](int at) { return load(offsets + at) != kNoOffset; });
  const int32_t offset = first < width ? offsets[first] : kNoOffset;
  const int end = first_lane(first, width, [=](int at) {
    const I32 there = load(offsets + at);
    return both(there != offset, there != kNoOffset);
  });
  return {end, offset};
}

int next_lost(int x, int width, const float* weights, const float* disparity) {
  return first_lane(x, width,
                    [=](int at) { return both(load(weights + at) <= kLostWeight, load(disparity + at) > 0.0f); });
}

} // namespace
} // namespace packtrace
