#include "pbrt_import/scene/separate_motion.h"

#include <map>
#include <optional>
#include <string>
#include <utility>

namespace packtrace {
namespace {

MotionTrack track_of(const AnimatedTransform& animation) {
  MotionTrack track;
  const auto add = [&](double time, const TransformKey& key) {
    track.keys.push_back({time, key.map[3], key.rotation, key.scale});
  };
  add(animation.start_time, animation.start);
  add(animation.end_time, animation.end);
  return track;
}

class Separator {
public:
  explicit Separator(Scene& scene) : scene_(scene), tracks_(scene.animations.size()) {}

  void run() {
    for (uint32_t i = 0; i < scene_.shapes.size(); ++i)
      if (const auto track = track_of_animation(scene_.shapes[i].animation)) motion().instances.push_back({i, *track});
    separate_objects();
    separate_instances();
    for (uint32_t i = 0; i < scene_.cameras.size(); ++i)
      if (const auto track = track_of_animation(scene_.cameras[i].animation)) motion().cameras.push_back({i, *track});
  }

private:
  /// A moving shape that is an object now.
  struct Part {
    uint32_t object = 0;
    uint32_t track = 0;
    DAffine parent_from_mesh{1.0};
  };

  RigidMotion& motion() { return scene_.motion; }

  /// Returns nothing for animations that do not move, among them steps at one time.
  std::optional<uint32_t> track_of_animation(uint32_t number) {
    if (number == kNotAnimated) return std::nullopt;
    const AnimatedTransform& animation = scene_.animations[number];
    if (!(animation.end_time > animation.start_time) || animation.start.map == animation.end.map) return std::nullopt;
    if (!tracks_[number]) tracks_[number] = add_track(track_of(animation));
    return tracks_[number];
  }

  /// Tracks with equal keys are one.
  uint32_t add_track(MotionTrack track) {
    std::string key;
    for (const MotionKey& k : track.keys) key.append(reinterpret_cast<const char*>(&k), sizeof k);
    const auto [found, inserted] = numbers_.try_emplace(key, static_cast<uint32_t>(motion().tracks.size()));
    if (inserted) motion().tracks.push_back(std::move(track));
    return found->second;
  }

  void separate_objects() {
    parts_.resize(scene_.objects.size());
    std::vector<Object> added;
    for (size_t i = 0; i < parts_.size(); ++i) {
      Object& object = scene_.objects[i];
      std::erase_if(object.shapes, [&](const Shape& shape) {
        const auto track = track_of_animation(shape.animation);
        if (!track) return false;
        const auto number = static_cast<uint32_t>(scene_.objects.size() + added.size());
        parts_[i].push_back({number, *track, shape.parent_from_mesh});
        added.push_back({object.name + "/" + scene_.meshes[shape.mesh].name, {shape}});
        added.back().shapes.front().parent_from_mesh = DAffine(1.0);
        added.back().shapes.front().animation = kNotAnimated;
        return true;
      });
    }
    for (Object& object : added) scene_.objects.push_back(std::move(object));
  }

  void separate_instances() {
    std::vector<Instance> instances;
    auto animated = scene_.animated_instances.begin();
    std::vector<AnimatedInstance> renumbered;
    for (uint32_t i = 0; i < scene_.instances.size(); ++i) {
      const Instance& instance = scene_.instances[i];
      const bool listed = animated != scene_.animated_instances.end() && animated->instance == i;
      const uint32_t animation = listed ? (animated++)->animation : kNotAnimated;
      const std::optional<uint32_t> track = track_of_animation(animation);
      const auto& parts = parts_[instance.object];
      if (parts.empty() || !scene_.objects[instance.object].shapes.empty()) {
        if (listed) renumbered.push_back({static_cast<uint32_t>(instances.size()), animation});
        if (track) motion().instances.push_back({number_of(instances.size()), *track});
        instances.push_back(instance);
      }
      const DAffine world_from_object(instance.world_from_object);
      for (const Part& part : parts) {
        InstanceMotion moving{number_of(instances.size()), 0, part.track};
        moving.track = track ? *track : add_track(constant_track(world_from_object));
        motion().instances.push_back(moving);
        instances.push_back({part.object, Affine(compose(world_from_object, part.parent_from_mesh))});
      }
    }
    scene_.instances = std::move(instances);
    scene_.animated_instances = std::move(renumbered);
  }

  uint32_t number_of(size_t instance) const { return static_cast<uint32_t>(scene_.shapes.size() + instance); }

  Scene& scene_;
  std::vector<std::optional<uint32_t>> tracks_; // by animation
  std::map<std::string, uint32_t> numbers_;     // of tracks by the bytes of their keys
  std::vector<std::vector<Part>> parts_;        // by object
};

} // namespace

MotionTrack constant_track(const DAffine& map) {
  MotionTrack track;
  track.keys.push_back({0.0, map[3], glm::dquat(1.0, 0.0, 0.0, 0.0), glm::dmat3(map)});
  return track;
}

void separate_motion(Scene& scene) {
  if (!scene.animations.empty()) Separator(scene).run();
}

} // namespace packtrace
