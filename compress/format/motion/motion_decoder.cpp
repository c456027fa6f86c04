#include <algorithm>
#include <cmath>
#include <cstring>

#include "compress/format/motion/motion_fields.h"
#include "compress/format/motion/motion_stream.h"

namespace packtrace {
namespace {

/// A fault in the part that is being read; thrown within this file only.
struct Damaged {
  const char* what;
};

class MotionReader {
public:
  explicit MotionReader(std::span<const uint8_t> bytes) : bytes_(bytes) {}

  bool at_end() const { return at_ == bytes_.size(); }
  size_t left() const { return bytes_.size() - at_; }

  template <typename T>
  T value() {
    if (left() < sizeof(T)) throw Damaged{"truncated"};
    T result;
    std::memcpy(&result, bytes_.data() + at_, sizeof result);
    at_ += sizeof result;
    return result;
  }

  double finite() {
    const auto d = value<double>();
    if (!std::isfinite(d)) throw Damaged{"number is not finite"};
    return d;
  }

  /// Seven bits per byte, low ones first; the highest bit is set if another byte follows.
  uint32_t count() {
    uint64_t result = 0;
    for (uint32_t shift = 0; shift < 35; shift += 7) {
      const auto byte = value<uint8_t>();
      result |= uint64_t{byte & 0x7fu} << shift;
      if ((byte & 0x80u) == 0) {
        if (result >= ~0u || (byte == 0 && shift > 0)) break;
        return static_cast<uint32_t>(result);
      }
    }
    throw Damaged{"count"};
  }

  /// Reads bit fields, lowest bits first. Fields start at a whole byte after end_fields().
  uint64_t field(uint32_t bits) {
    uint64_t result = 0;
    for (uint32_t done = 0; done < bits;) {
      if (left() == 0) throw Damaged{"truncated"};
      const uint32_t take = std::min(bits - done, 8 - bit_);
      result |= uint64_t{(uint32_t{bytes_[at_]} >> bit_) & ((1u << take) - 1)} << done;
      done += take, bit_ += take;
      if (bit_ == 8) bit_ = 0, ++at_;
    }
    return result;
  }

  void end_fields() {
    if (bit_ == 0) return;
    if (bytes_[at_] >> bit_ != 0) throw Damaged{"padding is not zero"};
    bit_ = 0, ++at_;
  }

private:
  std::span<const uint8_t> bytes_;
  size_t at_ = 0;
  uint32_t bit_ = 0;
};

/// Numbers base + field 2^exponent, one field per key.
struct MotionChannel {
  uint32_t bits = 0;
  double base = 0.0, step = 0.0;

  double value(MotionReader& in) const { return base + static_cast<double>(in.field(bits)) * step; }
};

void read_channels(MotionReader& in, std::span<MotionChannel> channels) {
  uint32_t most = 0;
  for (MotionChannel& channel : channels) {
    channel.bits = in.value<uint8_t>();
    if (channel.bits > kMaxChannelBits) throw Damaged{"width"};
    most = std::max(most, channel.bits);
  }
  int exponent = 0;
  if (most > 0) exponent = in.value<int16_t>();
  if (exponent < kMinChannelExponent || exponent > kMaxChannelExponent) throw Damaged{"step"};
  for (MotionChannel& channel : channels) {
    channel.base = in.finite(), channel.step = std::ldexp(1.0, exponent);
    const double reach = std::abs(channel.base) + std::ldexp(1.0, static_cast<int>(channel.bits) + exponent);
    if (!(reach <= kMaxChannelValue)) throw Damaged{"value out of range"};
  }
}

glm::dquat read_rotation(MotionReader& in, uint32_t bits) {
  const auto largest = static_cast<int>(in.field(2));
  const bool negative = in.field(1) != 0;
  std::array<double, 4> q{}; // w, x, y, z
  double squares = 0.0;
  for (int i = 0; i < 4; ++i) {
    if (i == largest) continue;
    const uint64_t field = in.field(bits);
    if (field > 2 * rotation_middle(bits)) throw Damaged{"rotation"};
    q[static_cast<size_t>(i)] = rotation_component(field, bits);
    squares += q[static_cast<size_t>(i)] * q[static_cast<size_t>(i)];
  }
  const double rest = std::sqrt(std::max(1.0 - squares, 0.0));
  q[static_cast<size_t>(largest)] = negative ? -rest : rest;
  return glm::normalize(glm::dquat(q[0], q[1], q[2], q[3]));
}

void read_times(MotionReader& in, bool uniform, MotionTrack& track, size_t count) {
  std::vector<double> times(count, 0.0);
  if (count > 1 && uniform) {
    const double first = in.finite(), last = in.finite();
    for (size_t i = 0; i < count; ++i)
      times[i] =
          i + 1 == count ? last : first + (last - first) * (static_cast<double>(i) / static_cast<double>(count - 1));
  } else if (count > 1) {
    for (double& time : times) time = in.finite();
  }
  track.keys.resize(count);
  for (size_t i = 0; i < count; ++i) {
    if (i > 0 && !(times[i] > times[i - 1] && std::isfinite(times[i] - times[0]))) throw Damaged{"order of times"};
    track.keys[i].time_s = times[i];
  }
}

MotionTrack read_track(MotionReader& in) {
  MotionTrack track;
  const uint32_t flags = in.value<uint8_t>();
  const auto rotation_form = static_cast<RotationForm>(flags >> kTrackRotationShift & 3u);
  const auto scale_form = static_cast<ScaleForm>(flags >> kTrackScaleShift);
  if (rotation_form >= RotationForm::kCount || scale_form >= ScaleForm::kCount) throw Damaged{"flags"};
  track.interpolation = (flags & kTrackCatmullRom) != 0 ? KeyInterpolation::kCatmullRom : KeyInterpolation::kLinear;
  track.loop = (flags & kTrackLoops) != 0;
  const bool uniform = (flags & kTrackUniformTimes) != 0;
  const size_t count = in.count();
  if (count == 0 || (count == 1 && (flags & (kTrackCatmullRom | kTrackLoops | kTrackUniformTimes)) != 0))
    throw Damaged{"number of keys"};
  // A key takes at least a byte, so the number of keys is bounded by the bytes before anything is allocated.
  if (count > 1 && (count > in.left() || (!uniform && count > in.left() / sizeof(double))))
    throw Damaged{"number of keys"};
  read_times(in, uniform, track, count);

  std::array<MotionChannel, 3> translation;
  read_channels(in, translation);
  glm::dquat constant(1.0, 0.0, 0.0, 0.0);
  uint32_t rotation_bits = 0;
  if (rotation_form == RotationForm::kConstant) {
    constant.w = in.finite(), constant.x = in.finite(), constant.y = in.finite(), constant.z = in.finite();
    if (!(std::abs(glm::length(constant) - 1.0) < 1e-6)) throw Damaged{"rotation is not of unit length"};
  } else if (rotation_form == RotationForm::kKeyed) {
    rotation_bits = in.value<uint8_t>();
    if (rotation_bits < 2 || rotation_bits > TrackSteps::kMaxRotationBits) throw Damaged{"width"};
  }
  const ScaleEntries& entries = kScaleEntries[static_cast<size_t>(scale_form)];
  std::array<MotionChannel, 9> scale;
  read_channels(in, std::span(scale).first(entries.count));

  uint32_t bits = rotation_bits > 0 ? 3 + 3 * rotation_bits : 0;
  for (const MotionChannel& channel : translation) bits += channel.bits;
  for (const MotionChannel& channel : scale) bits += channel.bits;
  if (count > 1 && (bits == 0 || (bits + 7) / 8 > in.left() / count)) throw Damaged{"number of keys"};
  for (MotionKey& key : track.keys) {
    for (int axis = 0; axis < 3; ++axis) key.translation[axis] = translation[static_cast<size_t>(axis)].value(in);
    key.rotation = rotation_bits > 0 ? read_rotation(in, rotation_bits) : constant;
    for (uint32_t i = 0; i < entries.count; ++i) {
      const double entry = scale[i].value(in);
      const auto [column, row] = entries.at[i];
      key.scale[column][row] = entry;
      if (scale_form == ScaleForm::kUniform) key.scale[1][1] = key.scale[2][2] = entry;
      if (scale_form == ScaleForm::kSymmetric) key.scale[row][column] = entry;
    }
    in.end_fields();
  }
  return track;
}

uint32_t read_track_number(MotionReader& in, const RigidMotion& motion) {
  const uint32_t track = in.count();
  if (track >= motion.tracks.size()) throw Damaged{"track"};
  return track;
}

/// @param next the smallest number that may follow; becomes the next one
uint32_t read_number(MotionReader& in, uint64_t& next) {
  const uint64_t number = next + in.count();
  if (number >= ~0u) throw Damaged{"number"};
  next = number + 1;
  return static_cast<uint32_t>(number);
}

double read_error(MotionReader& in) {
  const uint32_t bits = uint32_t{in.value<uint16_t>()} << 16;
  float error = 0.0f;
  std::memcpy(&error, &bits, sizeof error);
  if (!(std::isfinite(error) && error >= 0.0f) || bits >> 31 != 0) throw Damaged{"error"};
  return error;
}

InstanceMotion read_instance(MotionReader& in, const RigidMotion& motion, uint64_t& next) {
  InstanceMotion instance;
  instance.instance = read_number(in, next);
  const uint32_t flags = in.value<uint8_t>();
  if (flags > kMotionChained) throw Damaged{"flags"};
  instance.track = read_track_number(in, motion);
  instance.relative = flags == kMotionRelative;
  if (flags == kMotionChained) instance.inner_track = read_track_number(in, motion);
  for (int axis = 0; instance.relative && axis < 3; ++axis) {
    instance.pivot[axis] = in.value<float>();
    if (!std::isfinite(instance.pivot[axis])) throw Damaged{"pivot"};
  }
  instance.error_world = read_error(in);
  return instance;
}

} // namespace

MotionTrack unpack_track(std::span<const uint8_t> bytes) {
  MotionReader in(bytes);
  return read_track(in);
}

std::optional<MotionFault> unpack_rigid_motion(std::span<const uint8_t> bytes, RigidMotion& motion) {
  motion = {};
  if (bytes.empty()) return std::nullopt;
  uint64_t part = 0;
  try {
    MotionReader in(bytes);
    const uint32_t tracks = in.count(), instances = in.count(), cameras = in.count();
    if (uint64_t{tracks} + instances + cameras > in.left()) throw Damaged{"counts"};
    for (; part < tracks; ++part) motion.tracks.push_back(read_track(in));
    uint64_t next = 0;
    for (; part < uint64_t{tracks} + instances; ++part) motion.instances.push_back(read_instance(in, motion, next));
    next = 0;
    for (; part < uint64_t{tracks} + instances + cameras; ++part) {
      CameraMotion camera;
      camera.camera = read_number(in, next);
      camera.track = read_track_number(in, motion);
      camera.error_world = read_error(in);
      motion.cameras.push_back(camera);
    }
    if (!in.at_end() || motion.empty()) throw Damaged{"size"};
  } catch (const Damaged& damaged) {
    return MotionFault{part, damaged.what};
  }
  return std::nullopt;
}

} // namespace packtrace
