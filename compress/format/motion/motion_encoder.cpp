#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "compress/format/layout/bit_stream.h"
#include "compress/format/motion/motion_fields.h"
#include "compress/format/motion/motion_stream.h"

namespace packtrace {
namespace {

/// Rotations and scales that differ by less are equal: decompositions of maps leave such differences.
constexpr double kEqual = 0x1p-40;

class MotionWriter {
public:
  template <typename T>
  void value(T v) {
    const auto* bytes = reinterpret_cast<const uint8_t*>(&v);
    bytes_.insert(bytes_.end(), bytes, bytes + sizeof v);
  }

  void count(uint64_t n) {
    for (; n >= 0x80; n >>= 7) bytes_.push_back(static_cast<uint8_t>(n | 0x80));
    bytes_.push_back(static_cast<uint8_t>(n));
  }

  void append(std::span<const uint8_t> bytes) { bytes_.insert(bytes_.end(), bytes.begin(), bytes.end()); }

  std::vector<uint8_t> take() { return std::move(bytes_); }

private:
  std::vector<uint8_t> bytes_;
};

/// A number of each key, rounded to base + field 2^exponent.
struct ChannelFields {
  std::vector<uint64_t> fields;
  double base = 0.0;
  uint32_t bits = 0;
};

/// @return the exponent, raised where fields would have too many bits
int common_exponent(std::span<const std::vector<double>> channels, int exponent) {
  int result = std::max(exponent, kMinChannelExponent);
  for (const std::vector<double>& values : channels) {
    const auto [lo, hi] = std::minmax_element(values.begin(), values.end());
    if (*hi > *lo) result = std::max(result, std::ilogb(*hi - *lo) + 2 - static_cast<int>(kMaxChannelBits));
  }
  return result;
}

ChannelFields round_channel(const std::vector<double>& values, int exponent) {
  ChannelFields channel;
  const auto [lo, hi] = std::minmax_element(values.begin(), values.end());
  channel.base = *lo;
  const auto field = [&](double value) {
    return static_cast<uint64_t>(std::nearbyint(std::ldexp(value - channel.base, -exponent)));
  };
  channel.bits = static_cast<uint32_t>(std::bit_width(field(*hi)));
  for (const double value : values) channel.fields.push_back(field(value));
  return channel;
}

std::vector<ChannelFields> write_channels(MotionWriter& out, std::span<const std::vector<double>> channels,
                                          int wanted_exponent) {
  const int exponent = common_exponent(channels, wanted_exponent);
  std::vector<ChannelFields> result;
  uint32_t most = 0;
  for (const std::vector<double>& values : channels) {
    result.push_back(round_channel(values, exponent));
    out.value(static_cast<uint8_t>(result.back().bits));
    most = std::max(most, result.back().bits);
  }
  if (most > 0) out.value(static_cast<int16_t>(exponent));
  for (const ChannelFields& channel : result) out.value(channel.base);
  return result;
}

double difference(const glm::dmat3& a, const glm::dmat3& b) {
  double most = 0.0;
  for (int column = 0; column < 3; ++column)
    for (int row = 0; row < 3; ++row) most = std::max(most, std::abs(a[column][row] - b[column][row]));
  return most;
}

RotationForm rotation_form(const MotionTrack& track) {
  const glm::dquat first = track.keys.front().rotation;
  for (const MotionKey& key : track.keys)
    if (glm::length(key.rotation - first) > kEqual) return RotationForm::kKeyed;
  return glm::length(first - glm::dquat(1.0, 0.0, 0.0, 0.0)) > kEqual ? RotationForm::kConstant : RotationForm::kNone;
}

ScaleForm scale_form(const MotionTrack& track) {
  auto form = ScaleForm::kNone;
  for (const MotionKey& key : track.keys) {
    const glm::dmat3& s = key.scale;
    const double limit = kEqual * difference(s, glm::dmat3(0.0));
    const glm::dmat3 diagonal(s[0][0], 0, 0, 0, s[1][1], 0, 0, 0, s[2][2]);
    auto own = ScaleForm::kFull;
    if (difference(s, glm::dmat3(1.0)) <= limit)
      own = ScaleForm::kNone;
    else if (difference(s, glm::dmat3(s[0][0])) <= limit)
      own = ScaleForm::kUniform;
    else if (difference(s, diagonal) <= limit)
      own = ScaleForm::kDiagonal;
    else if (difference(s, glm::transpose(s)) <= limit)
      own = ScaleForm::kSymmetric;
    form = std::max(form, own);
  }
  return form;
}

bool uniform_times(const MotionTrack& track) {
  const size_t count = track.keys.size();
  const double first = track.keys.front().time_s, last = track.keys.back().time_s;
  for (size_t i = 0; i + 1 < count; ++i)
    if (track.keys[i].time_s != first + (last - first) * (static_cast<double>(i) / static_cast<double>(count - 1)))
      return false;
  return count > 1;
}

void put_rotation(BitWriter& out, const glm::dquat& rotation, uint32_t bits) {
  const std::array<double, 4> q{rotation.w, rotation.x, rotation.y, rotation.z};
  size_t largest = 0;
  for (size_t i = 1; i < 4; ++i)
    if (std::abs(q[i]) > std::abs(q[largest])) largest = i;
  out.put(largest, 2);
  out.put(q[largest] < 0.0 ? 1 : 0, 1);
  const auto middle = static_cast<double>(rotation_middle(bits));
  for (size_t i = 0; i < 4; ++i) {
    if (i == largest) continue;
    const double field = std::nearbyint((q[i] * 1.41421356237309504880 + 1.0) * middle);
    out.put(static_cast<uint64_t>(std::clamp(field, 0.0, 2.0 * middle)), bits);
  }
}

/// The upper half of a float that is not less.
uint16_t rounded_up(double error) {
  auto value = static_cast<float>(error);
  if (value < error) value = std::nextafter(value, std::numeric_limits<float>::infinity());
  const auto bits = std::bit_cast<uint32_t>(value);
  return static_cast<uint16_t>((bits >> 16) + ((bits & 0xffffu) != 0 ? 1 : 0));
}

} // namespace

std::vector<uint8_t> pack_track(const MotionTrack& track, const TrackSteps& steps) {
  MotionWriter out;
  const size_t count = track.keys.size();
  const bool several = count > 1, uniform = uniform_times(track);
  const RotationForm rotation = rotation_form(track);
  const ScaleForm scale = scale_form(track);
  out.value(static_cast<uint8_t>(
      (several && track.interpolation == KeyInterpolation::kCatmullRom ? kTrackCatmullRom : 0u) |
      (several && track.loop ? kTrackLoops : 0u) | (uniform ? kTrackUniformTimes : 0u) |
      static_cast<uint32_t>(rotation) << kTrackRotationShift | static_cast<uint32_t>(scale) << kTrackScaleShift));
  out.count(count);
  for (size_t i = 0; several && i < count; ++i)
    if (!uniform || i == 0 || i + 1 == count) out.value(track.keys[i].time_s);

  std::array<std::vector<double>, 3> translations;
  for (const MotionKey& key : track.keys)
    for (int axis = 0; axis < 3; ++axis) translations[static_cast<size_t>(axis)].push_back(key.translation[axis]);
  const auto translation = write_channels(out, translations, steps.translation_exponent);
  const glm::dquat first = track.keys.front().rotation;
  if (rotation == RotationForm::kConstant)
    for (const double c : {first.w, first.x, first.y, first.z}) out.value(c);
  if (rotation == RotationForm::kKeyed) out.value(static_cast<uint8_t>(steps.rotation_bits));
  const ScaleEntries& entries = kScaleEntries[static_cast<size_t>(scale)];
  std::vector<std::vector<double>> scales(entries.count);
  for (const MotionKey& key : track.keys)
    for (uint32_t i = 0; i < entries.count; ++i) scales[i].push_back(key.scale[entries.at[i][0]][entries.at[i][1]]);
  const auto scaling = write_channels(out, scales, steps.scale_exponent);

  BitWriter fields;
  uint64_t bits = rotation == RotationForm::kKeyed ? 1 : 0;
  for (const ChannelFields& channel : translation) bits += channel.bits;
  for (const ChannelFields& channel : scaling) bits += channel.bits;
  if (several && bits == 0) { // it does not move by a step; a track of several keys must
    MotionTrack still;
    still.keys = {track.keys.front()};
    return pack_track(still, steps);
  }
  for (size_t i = 0; i < count; ++i) {
    for (const ChannelFields& channel : translation) fields.put(channel.fields[i], channel.bits);
    if (rotation == RotationForm::kKeyed) put_rotation(fields, track.keys[i].rotation, steps.rotation_bits);
    for (const ChannelFields& channel : scaling) fields.put(channel.fields[i], channel.bits);
    fields.align(1);
  }
  out.append(fields.bytes());
  return out.take();
}

std::vector<uint8_t> pack_rigid_motion(const RigidMotion& motion, std::span<const std::vector<uint8_t>> tracks) {
  MotionWriter out;
  if (motion.empty()) return {};
  out.count(tracks.size()), out.count(motion.instances.size()), out.count(motion.cameras.size());
  for (const std::vector<uint8_t>& track : tracks) out.append(track);
  uint64_t next = 0;
  for (const InstanceMotion& instance : motion.instances) {
    const bool chained = instance.inner_track != kNoTrack;
    out.count(instance.instance - next);
    out.value(static_cast<uint8_t>((instance.relative ? kMotionRelative : 0u) | (chained ? kMotionChained : 0u)));
    out.count(instance.track);
    if (chained) out.count(instance.inner_track);
    if (instance.relative)
      for (int axis = 0; axis < 3; ++axis) out.value(instance.pivot[axis]);
    out.value(rounded_up(instance.error_world));
    next = uint64_t{instance.instance} + 1;
  }
  next = 0;
  for (const CameraMotion& camera : motion.cameras) {
    out.count(camera.camera - next), out.count(camera.track);
    out.value(rounded_up(camera.error_world));
    next = uint64_t{camera.camera} + 1;
  }
  return out.take();
}

} // namespace packtrace
