#include "compress/bake/write/motion_packer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <utility>

#include <tbb/parallel_for.h>

#include "compress/format/motion/motion_stream.h"
#include "pbrt_import/base/error.h"
#include "pbrt_import/scene/motion_pose.h"

namespace packtrace {
namespace {

constexpr int kSamplesPerSegment = 8;
constexpr double kBetweenSamples = 1.25;
constexpr double kPoseRounding = 0x1p-44; ///< of computing poses in doubles, relative to coordinates

/// An instance or a camera, as what moves.
struct Mover {
  InstanceMotion motion;
  Affine placement{1.0f};
  std::array<DVec3, 8> corners;
  double wanted = std::numeric_limits<double>::infinity(); ///< largest error, world units
};

std::array<DVec3, 8> box_corners(const Bounds& box) {
  std::array<DVec3, 8> corners{};
  for (size_t i = 0; !box.empty() && i < 8; ++i)
    corners[i] = {i & 1 ? box.hi.x : box.lo.x, i & 2 ? box.hi.y : box.lo.y, i & 4 ? box.hi.z : box.lo.z};
  return corners;
}

/// Lower bound of the length to which a map takes vectors of length 1; 0 if it is singular.
double least_stretch(const DAffine& map) {
  const glm::dmat3 inverse = glm::inverse(glm::dmat3(map));
  const double norm =
      std::sqrt(glm::dot(inverse[0], inverse[0]) + glm::dot(inverse[1], inverse[1]) + glm::dot(inverse[2], inverse[2]));
  return std::isfinite(norm) && norm > 0.0 ? 1.0 / norm : 0.0;
}

/// Key times of tracks, and times between, in order.
std::vector<double> sample_times(const RigidMotion& motion, const InstanceMotion& moving) {
  std::vector<double> keys, times;
  for (const uint32_t number : {moving.track, moving.inner_track})
    if (number != kNoTrack)
      for (const MotionKey& key : motion.tracks[number].keys) keys.push_back(key.time_s);
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  for (size_t i = 0; i + 1 < keys.size(); ++i)
    for (int k = 0; k < kSamplesPerSegment; ++k)
      times.push_back(keys[i] + (keys[i + 1] - keys[i]) * (static_cast<double>(k) / kSamplesPerSegment));
  times.push_back(keys.back());
  return times;
}

class MotionPacker {
public:
  MotionPacker(const RigidMotion& source, std::span<const MovingBox> boxes, Progress& progress)
      : source_(source), progress_(progress) {
    share_tracks();
    for (size_t i = 0; i < source_.instances.size(); ++i) add_instance(source_.instances[i], boxes[i]);
    for (const CameraMotion& camera : source_.cameras) add_camera(camera);
  }

  PackedMotion run() {
    decoded_ = source_;
    packed_.resize(source_.tracks.size());
    users_.resize(source_.tracks.size());
    for (size_t i = 0; i < movers_.size(); ++i)
      for (const uint32_t track : {movers_[i].motion.track, movers_[i].motion.inner_track})
        if (track != kNoTrack) users_[track].push_back(static_cast<uint32_t>(i));
    progress_.begin("packing motion", source_.tracks.size());
    for (uint32_t i = 0; i < source_.tracks.size(); ++i) {
      progress_.check_cancelled();
      pack(i);
      progress_.advance();
    }
    state_errors();
    PackedMotion result;
    result.bytes = pack_rigid_motion(source_, packed_);
    if (unpack_rigid_motion(result.bytes, result.motion))
      throw Error(ErrorKind::kLimitExceeded, "the scene's motion exceeds the limits of the format");
    return result;
  }

private:
  /// Keeps one of equal tracks, and drops those without users.
  void share_tracks() {
    std::map<std::string, uint32_t> numbers;
    std::vector<MotionTrack> kept;
    const auto share = [&](uint32_t& number) {
      if (number == kNoTrack) return;
      const MotionTrack& track = source_.tracks[number];
      std::string key{static_cast<char>(track.interpolation), static_cast<char>(track.loop)};
      key.append(reinterpret_cast<const char*>(track.keys.data()), track.keys.size() * sizeof(MotionKey));
      const auto [found, inserted] = numbers.try_emplace(std::move(key), static_cast<uint32_t>(kept.size()));
      if (inserted) kept.push_back(track);
      number = found->second;
    };
    for (InstanceMotion& instance : source_.instances) share(instance.track), share(instance.inner_track);
    for (CameraMotion& camera : source_.cameras) share(camera.track);
    source_.tracks = std::move(kept);
  }

  void add_instance(const InstanceMotion& motion, const MovingBox& box) {
    Mover mover{motion, box.placement, box_corners(box.box)};
    const double smallest = box.position_error * least_stretch(DAffine(box.placement));
    if (!box.box.empty() && smallest > 0.0) mover.wanted = kMotionErrorFraction * smallest;
    movers_.push_back(mover);
  }

  /// Cameras have no geometry, so their error must be small compared with the float spacing at their coordinates.
  void add_camera(const CameraMotion& camera) {
    constexpr double kFloatStep = 0x1p-24;
    Bounds box;
    box.lo = DVec3(-1.0), box.hi = DVec3(1.0);
    InstanceMotion motion;
    motion.track = camera.track;
    const Bounds swept = swept_bounds(source_, motion, Affine(1.0f), box);
    const DVec3 far = glm::max(glm::abs(swept.lo), glm::abs(swept.hi));
    Mover mover{motion, Affine(1.0f), box_corners(box)};
    mover.wanted = kFloatStep * std::max({far.x, far.y, far.z});
    movers_.push_back(mover);
  }

  /// Largest distance between the source's and the decoded corners of a mover.
  double measure(const Mover& mover) const {
    double largest = 0.0, far = 0.0;
    for (const double time : sample_times(source_, mover.motion)) {
      const DAffine exact = pose(source_, mover.motion, mover.placement, time);
      const DAffine rounded = pose(decoded_, mover.motion, mover.placement, time);
      for (const DVec3 corner : mover.corners) {
        const DVec3 p = transform_point(exact, corner);
        largest = std::max(largest, glm::distance(p, transform_point(rounded, corner)));
        far = std::max(far, glm::length(p));
      }
    }
    return largest + kPoseRounding * far;
  }

  /// Largest distance from the origin of the space in which a track turns and scales.
  double lever_of(const Mover& mover) const {
    double lever = 0.0;
    for (DVec3 corner : mover.corners) {
      if (mover.motion.relative) corner = transform_point(DAffine(mover.placement), corner) - DVec3(mover.motion.pivot);
      lever = std::max(lever, glm::length(corner));
    }
    return lever;
  }

  /// Finds the largest steps of a track that keep the wanted errors of all its users.
  void pack(uint32_t track) {
    constexpr double kDefaultWanted = 0x1p-20; // if no geometry limits the error
    constexpr int kMaxRefinements = 48;
    double wanted = std::numeric_limits<double>::infinity(), lever = 0.0;
    for (const uint32_t user : users_[track]) {
      wanted = std::min(wanted, movers_[user].wanted);
      lever = std::max(lever, lever_of(movers_[user]));
    }
    if (!std::isfinite(wanted)) wanted = kDefaultWanted;
    const int step = std::ilogb(wanted / 2.0);
    const int scale_step = lever > 0.0 ? std::ilogb(wanted / (4.0 * lever)) : -20;
    const double angles = std::log2(9.0 * std::max(lever, wanted) / wanted);
    for (int finer = 0;; ++finer) {
      const auto bits = static_cast<uint32_t>(
          std::clamp(static_cast<int>(std::ceil(angles)) + finer, 2, static_cast<int>(TrackSteps::kMaxRotationBits)));
      packed_[track] = pack_track(source_.tracks[track], {step - finer, scale_step - finer, bits});
      decoded_.tracks[track] = unpack_track(packed_[track]);
      if (finer == kMaxRefinements || keeps_errors(track)) return;
    }
  }

  bool keeps_errors(uint32_t track) const {
    const std::vector<uint32_t>& users = users_[track];
    std::vector<uint8_t> kept(users.size());
    tbb::parallel_for(size_t{0}, users.size(), [&](size_t i) {
      const Mover& mover = movers_[users[i]];
      // The first of two tracks uses half of the error.
      const bool half = mover.motion.inner_track != kNoTrack &&
                        (packed_[mover.motion.track].empty() || packed_[mover.motion.inner_track].empty());
      kept[i] = measure(mover) <= (half ? 0.5 : 1.0) * mover.wanted;
    });
    return std::all_of(kept.begin(), kept.end(), [](uint8_t one) { return one != 0; });
  }

  void state_errors() {
    tbb::parallel_for(size_t{0}, movers_.size(), [&](size_t i) {
      const double error = kBetweenSamples * measure(movers_[i]);
      const size_t instances = source_.instances.size();
      (i < instances ? source_.instances[i].error_world : source_.cameras[i - instances].error_world) = error;
    });
  }

  RigidMotion source_, decoded_;
  Progress& progress_;
  std::vector<Mover> movers_;                // instances, then cameras
  std::vector<std::vector<uint32_t>> users_; // movers by track
  std::vector<std::vector<uint8_t>> packed_; // by track; empty: not packed yet
};

} // namespace

PackedMotion pack_motion(const RigidMotion& source, std::span<const MovingBox> boxes, Progress& progress) {
  if (source.empty()) return {};
  return MotionPacker(source, boxes, progress).run();
}

} // namespace packtrace
