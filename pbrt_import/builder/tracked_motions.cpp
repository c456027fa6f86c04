#include "pbrt_import/builder/tracked_motions.h"

#include <utility>

#include "pbrt_import/base/large_pages.h"
#include "pbrt_import/builder/scene_pruning.h"
#include "pbrt_import/scene/separate_motion.h"

namespace packtrace {

uint32_t TrackedMotions::add_track(MotionTrack track) {
  tracks_.push_back(std::move(track));
  return static_cast<uint32_t>(tracks_.size() - 1);
}

void TrackedMotions::add_instance(uint32_t instance, const TrackedMotion& motion) {
  reserve_one_more(instances_);
  instances_.push_back({instance, motion});
}

void TrackedMotions::renumber(std::span<const uint32_t> numbers) {
  if (numbers.empty()) return;
  for (Instance& one : instances_) one.instance = numbers[one.instance];
  std::erase_if(instances_, [](const Instance& one) { return one.instance == kDropped; });
}

RigidMotion TrackedMotions::take(size_t shape_count, std::span<const uint32_t> camera_tracks) {
  RigidMotion motion;
  std::vector<uint32_t> numbers(tracks_.size(), kNoTrack);
  const auto number_of = [&](uint32_t track) {
    if (numbers[track] == kNoTrack) {
      numbers[track] = static_cast<uint32_t>(motion.tracks.size());
      motion.tracks.push_back(std::move(tracks_[track]));
    }
    return numbers[track];
  };
  for (const Instance& one : instances_) {
    InstanceMotion moving{static_cast<uint32_t>(shape_count) + one.instance, number_of(one.motion.track)};
    if (one.motion.inner != DAffine(1.0)) {
      moving.inner_track = static_cast<uint32_t>(motion.tracks.size());
      motion.tracks.push_back(constant_track(one.motion.inner));
    }
    motion.instances.push_back(moving);
  }
  for (uint32_t camera = 0; camera < camera_tracks.size(); ++camera)
    if (camera_tracks[camera] != kNoTrack) motion.cameras.push_back({camera, number_of(camera_tracks[camera])});
  return motion;
}

} // namespace packtrace
