#pragma once

#include "pbrt_import/scene/separate_motion.h"
#include "tests/compress/test_scenes.h"
#include "tests/pbrt_import/scene_folder.h"

namespace packtrace::test {

/// The corpus' scene of motion in moving things: a floor, a cube that makes half a turn, three instances of a cart
/// whose wheel turns, one of which moves too and one mirrors, and a moving camera.
inline Scene carts() {
  Diagnostics diagnostics;
  Progress progress;
  const std::filesystem::path file =
      std::filesystem::path(PACKTRACE_SOURCE_DIR) / "tests/fuzz/corpus/import/bake_motion";
  return import_scene(file, {}, diagnostics, progress).scene;
}

/// The same after separate_motion().
inline Scene separate_carts() {
  Scene scene = carts();
  separate_motion(scene);
  return scene;
}

inline glm::dquat random_rotation(Random& random) {
  const auto part = [&] { return double{random.uniform(-1.0f, 1.0f)}; };
  return glm::normalize(glm::dquat(part(), part(), part(), part()));
}

/// Keys at uneven times whose rotations follow the shorter way.
inline MotionTrack random_track(uint32_t seed, size_t keys, KeyInterpolation interpolation) {
  Random random(seed);
  const auto between = [&](float lo, float hi) { return double{random.uniform(lo, hi)}; };
  MotionTrack track;
  track.interpolation = interpolation;
  double time = between(-5.0f, 5.0f);
  for (size_t i = 0; i < keys; ++i) {
    MotionKey key;
    key.time_s = time += between(0.01f, 2.0f);
    key.translation = DVec3(between(-50, 50), between(-5, 5), between(900, 1000));
    key.rotation = random_rotation(random);
    if (i > 0 && glm::dot(key.rotation, track.keys.back().rotation) < 0.0) key.rotation = -key.rotation;
    key.scale = glm::dmat3(between(0.5f, 2), 0.1, 0.2, 0.1, between(0.5f, 2), 0.3, 0.2, 0.3, between(0.5f, 2));
    track.keys.push_back(key);
  }
  return track;
}

} // namespace packtrace::test
