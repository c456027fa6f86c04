#include "pbrt_import/scene/motion_pose.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace packtrace {
namespace {

/// Interpolates along the arc between two quaternions as their signs choose it. glm::slerp would take the shorter arc,
/// which rounding changes at half turns.
glm::dquat along_arc(const glm::dquat& a, const glm::dquat& b, double u) {
  const double angle = 2.0 * std::atan2(glm::length(a - b), glm::length(a + b)), sine = std::sin(angle);
  if (!(std::abs(sine) > 1e-9)) { // almost equal, or opposite, which only damaged files contain
    const glm::dquat mixed = a * (1.0 - u) + b * u;
    return glm::length(mixed) > 1e-9 ? glm::normalize(mixed) : a;
  }
  return a * (std::sin((1.0 - u) * angle) / sine) + b * (std::sin(u * angle) / sine);
}

DAffine map_of(DVec3 translation, const glm::dquat& rotation, const glm::dmat3& scale) {
  const glm::dmat3 linear = glm::mat3_cast(rotation) * scale;
  return DAffine(linear[0], linear[1], linear[2], translation);
}

/// Derivatives of the parts of a key by time.
struct Tangent {
  DVec3 translation;
  glm::dquat rotation;
  glm::dmat3 scale;
};

Tangent operator*(const Tangent& t, double factor) {
  return {t.translation * factor, t.rotation * factor, t.scale * factor};
}

/// Change from one key to a later one, over a time, plus that between two other keys.
Tangent tangent_of(const MotionKey& a, const MotionKey& b) {
  const double dt = b.time_s - a.time_s;
  return Tangent{b.translation - a.translation, b.rotation - a.rotation, b.scale - a.scale} * (1.0 / dt);
}

/// The tangent of a Catmull-Rom track at a key.
Tangent tangent_at(const MotionTrack& track, size_t i) {
  const std::vector<MotionKey>& keys = track.keys;
  const size_t last = keys.size() - 1;
  if (i > 0 && i < last) return tangent_of(keys[i - 1], keys[i + 1]);
  if (!track.loop) return i == 0 ? tangent_of(keys[0], keys[1]) : tangent_of(keys[last - 1], keys[last]);
  const double before = keys[last].time_s - keys[last - 1].time_s, after = keys[1].time_s - keys[0].time_s;
  Tangent begin = tangent_of(keys[0], keys[1]), end = tangent_of(keys[last - 1], keys[last]);
  // A loop may end at the negative of the quaternion that it begins with.
  if (glm::dot(keys[0].rotation, keys[last].rotation) < 0.0) (i == 0 ? end : begin).rotation *= -1.0;
  begin = begin * (after / (before + after)), end = end * (before / (before + after));
  return {begin.translation + end.translation, begin.rotation + end.rotation, begin.scale + end.scale};
}

template <typename T>
T hermite(const T& a, const T& b, const T& tangent_a, const T& tangent_b, double u) {
  const double v = 1.0 - u;
  return a * (v * v * (1.0 + 2.0 * u)) + b * (u * u * (1.0 + 2.0 * v)) + tangent_a * (u * v * v) -
         tangent_b * (u * u * v);
}

DAffine between(const MotionTrack& track, size_t i, double u) {
  const MotionKey &a = track.keys[i], &b = track.keys[i + 1];
  if (track.interpolation == KeyInterpolation::kLinear)
    return map_of(glm::mix(a.translation, b.translation, u), along_arc(a.rotation, b.rotation, u),
                  a.scale * (1.0 - u) + b.scale * u);
  const double dt = b.time_s - a.time_s;
  const Tangent from = tangent_at(track, i) * dt, to = tangent_at(track, i + 1) * dt;
  const glm::dquat rotation = hermite(a.rotation, b.rotation, from.rotation, to.rotation, u);
  const double length = glm::length(rotation);
  return map_of(hermite(a.translation, b.translation, from.translation, to.translation, u),
                length > 1e-6 ? rotation / length : along_arc(a.rotation, b.rotation, u),
                hermite(a.scale, b.scale, from.scale, to.scale, u));
}

double norm(const glm::dmat3& m) {
  return std::sqrt(glm::dot(m[0], m[0]) + glm::dot(m[1], m[1]) + glm::dot(m[2], m[2]));
}

double row_sum(const glm::dmat3& m) {
  const DVec3 sums = glm::abs(m[0]) + glm::abs(m[1]) + glm::abs(m[2]);
  return std::max({sums.x, sums.y, sums.z});
}

bool turns(const MotionTrack& track) {
  for (const MotionKey& key : track.keys)
    if (key.rotation != track.keys.front().rotation) return true;
  return false;
}

/// Calls visit(translation, scale) for points whose hull contains translation and scale at all times: the keys, and the
/// inner Bezier points of a cubic curve.
template <typename Visit>
void visit_hull(const MotionTrack& track, const Visit& visit) {
  for (const MotionKey& key : track.keys) visit(key.translation, key.scale);
  if (track.interpolation == KeyInterpolation::kLinear) return;
  for (size_t i = 0; i + 1 < track.keys.size(); ++i) {
    const MotionKey &a = track.keys[i], &b = track.keys[i + 1];
    const double third = (b.time_s - a.time_s) / 3.0;
    const Tangent from = tangent_at(track, i) * third, to = tangent_at(track, i + 1) * third;
    visit(a.translation + from.translation, a.scale + from.scale);
    visit(b.translation - to.translation, b.scale - to.scale);
  }
}

Bounds padded(Bounds box, double by) {
  if (!box.empty()) box.lo -= by, box.hi += by;
  return box;
}

double largest_length(std::span<const DVec3> points) {
  double largest = 0.0;
  for (const DVec3 p : points) largest = std::max(largest, glm::length(p));
  return largest;
}

/// Bounds of a segment of a linear track. Translation t(u) is linear, and R(u) S(u) x differs from its chord over an
/// interval of length 1/kPieces by at most the second derivative over 8 kPieces^2:
/// |R'' S x + 2 R' S' x| <= (w^2 |S| + 2 w |S'|) |x|, where w is the angle of the turn. So the hull of the poses at
/// the ends of the intervals, padded by that, contains all poses.
Bounds swept_segment(const MotionTrack& track, size_t i, std::span<const DVec3> points) {
  constexpr int kPieces = 16;
  const MotionKey &a = track.keys[i], &b = track.keys[i + 1];
  const double angle = 4.0 * std::atan2(glm::length(a.rotation - b.rotation), glm::length(a.rotation + b.rotation));
  const int pieces = angle > 0.0 ? kPieces : 1; // without a turn the motion is linear
  Bounds box;
  for (int k = 0; k <= pieces; ++k) {
    const DAffine map = between(track, i, static_cast<double>(k) / pieces);
    for (const DVec3 p : points) box.extend(transform_point(map, p));
  }
  const double bend = (angle * std::max(norm(a.scale), norm(b.scale)) + 2.0 * norm(b.scale - a.scale)) * angle;
  return padded(box, bend * largest_length(points) / (8.0 * kPieces * kPieces));
}

/// Bounds of moving points at all times.
Bounds swept(const MotionTrack& track, std::span<const DVec3> points) {
  constexpr size_t kMaxKeys = 64; // beyond, the loose bound keeps the time small for many instances
  Bounds box;
  if (points.empty()) return box;
  if (track.keys.size() == 1 || (track.interpolation == KeyInterpolation::kLinear && track.keys.size() <= kMaxKeys)) {
    if (track.keys.size() == 1)
      for (const DVec3 p : points) box.extend(transform_point(pose(track, 0.0), p));
    for (size_t i = 0; i + 1 < track.keys.size(); ++i) box.extend(swept_segment(track, i, points));
    return box;
  }
  const TrackExtent extent = extent_of(track);
  return padded(extent.translation, extent.scale_norm * largest_length(points));
}

/// Relative motion of an instance, from the pose of its track.
DAffine about_pivot(const DAffine& map, const InstanceMotion& instance, const Affine& placement) {
  const DVec3 pivot(instance.pivot);
  DAffine rest(placement);
  rest[3] -= pivot;
  DAffine moved = compose(map, rest);
  moved[3] += pivot;
  return moved;
}

std::array<DVec3, 8> corners_of(const Bounds& box) {
  std::array<DVec3, 8> corners;
  for (size_t i = 0; i < 8; ++i)
    corners[i] = {i & 1 ? box.hi.x : box.lo.x, i & 2 ? box.hi.y : box.lo.y, i & 4 ? box.hi.z : box.lo.z};
  return corners;
}

} // namespace

DAffine pose(const MotionTrack& track, double time_s) {
  const std::vector<MotionKey>& keys = track.keys;
  const auto at_key = [](const MotionKey& key) { return map_of(key.translation, key.rotation, key.scale); };
  if (keys.size() == 1) return at_key(keys.front());
  double time = time_s;
  if (track.loop) {
    const double begin = keys.front().time_s, period = keys.back().time_s - begin;
    time = std::fmod(time_s - begin, period);
    time = begin + (time < 0.0 ? time + period : time);
  }
  if (!(time > keys.front().time_s)) return at_key(keys.front());
  if (time >= keys.back().time_s) return at_key(keys.back());
  const auto next =
      std::upper_bound(keys.begin(), keys.end(), time, [](double t, const MotionKey& key) { return t < key.time_s; });
  const auto i = static_cast<size_t>(next - keys.begin()) - 1;
  const double u = (time - keys[i].time_s) / (keys[i + 1].time_s - keys[i].time_s);
  return between(track, i, u);
}

DAffine pose(const RigidMotion& motion, const InstanceMotion& instance, const Affine& placement, double time_s) {
  const DAffine map = pose(motion.tracks[instance.track], time_s);
  if (instance.relative) return about_pivot(map, instance, placement);
  if (instance.inner_track == kNoTrack) return map;
  return compose(map, pose(motion.tracks[instance.inner_track], time_s));
}

DAffine pose_from_tracks(const InstanceMotion& instance, const Affine& placement, std::span<const DAffine> tracks) {
  const DAffine& map = tracks[instance.track];
  if (instance.relative) return about_pivot(map, instance, placement);
  return instance.inner_track == kNoTrack ? map : compose(map, tracks[instance.inner_track]);
}

TrackExtent extent_of(const MotionTrack& track) {
  TrackExtent extent;
  const bool turning = turns(track);
  const glm::dmat3 turn = glm::mat3_cast(track.keys.front().rotation);
  visit_hull(track, [&](DVec3 translation, const glm::dmat3& scale) {
    extent.translation.extend(translation);
    extent.scale_norm = std::max(extent.scale_norm, norm(scale));
    // A row of R S is at most |S| long, so its absolute sum is at most sqrt(3) |S|, and |S| <= the Frobenius norm and,
    // for symmetric matrices, the largest row sum; for others |S|^2 <= row sum * column sum.
    const double spectral = std::min(norm(scale), std::sqrt(row_sum(scale) * row_sum(glm::transpose(scale))));
    extent.scale_row_sum = std::max(extent.scale_row_sum, turning ? std::sqrt(3.0) * spectral : row_sum(turn * scale));
  });
  return extent;
}

Bounds swept_bounds(const RigidMotion& motion, const InstanceMotion& instance, const Affine& placement,
                    const Bounds& box) {
  if (box.empty()) return box;
  std::array<DVec3, 8> corners = corners_of(box);
  Bounds result;
  if (instance.relative) {
    const DVec3 pivot(instance.pivot);
    for (DVec3& corner : corners) corner = transform_point(DAffine(placement), corner) - pivot;
    result = swept(motion.tracks[instance.track], corners);
    result.lo += pivot, result.hi += pivot;
  } else {
    if (instance.inner_track != kNoTrack) corners = corners_of(swept(motion.tracks[instance.inner_track], corners));
    result = swept(motion.tracks[instance.track], corners);
  }
  constexpr double kFloatRounding = 0x1p-21; // of a pose in floats, and of points transformed by it
  const DVec3 far = glm::max(glm::abs(result.lo), glm::abs(result.hi));
  return padded(result, kFloatRounding * std::max({far.x, far.y, far.z}));
}

double largest_stretch(const RigidMotion& motion, const InstanceMotion& instance, const Affine& placement) {
  double stretch = extent_of(motion.tracks[instance.track]).scale_row_sum;
  if (instance.relative) stretch *= row_sum(glm::dmat3(DAffine(placement)));
  if (instance.inner_track != kNoTrack) stretch *= extent_of(motion.tracks[instance.inner_track]).scale_row_sum;
  return stretch;
}

TimeSpan time_span(const RigidMotion& motion) {
  TimeSpan span;
  for (const MotionTrack& track : motion.tracks) {
    if (track.keys.size() < 2) continue;
    const double begin = track.keys.front().time_s, end = track.keys.back().time_s;
    const bool first = span.begin_s > span.end_s;
    span = {first ? begin : std::min(span.begin_s, begin), first ? end : std::max(span.end_s, end)};
  }
  return span;
}

} // namespace packtrace
